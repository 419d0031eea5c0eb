"""What is written is read again, to a step of the format, and then written alike byte by byte."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_records import (
    ANGLE_STEP_DEG,
    FMR,
    WRITTEN,
    reading_of,
    records,
    sample_record,
    templates,
    turn_deg,
    written,
)

from fpmatch.errors import TemplateError
from fpmatch.formats.record import ExtendedData, ReadingOptions, TemplateRecord, View
from fpmatch.formats.registry import codec_of_content, codec_of_name
from fpmatch.minutiae import Minutiae, Template

TEXT_EXACT = ("csv", "json")
NO_KIND = ("xyt", "xyt-m1")


@pytest.mark.parametrize("name", WRITTEN)
@settings(max_examples=30)
@given(record=records(fewest=1))
def test_minutiae_come_back_to_a_step_of_the_format(name: str, record: TemplateRecord) -> None:
    codec = codec_of_name(name)
    again = codec.decode(written(codec, record), reading_of(record)).views[0]
    before, after = record.views[0].template, again.template
    position = 0.0 if name in TEXT_EXACT else 0.5001
    assert len(after.minutiae) == len(before.minutiae)
    assert np.abs(after.minutiae.x - before.minutiae.x).max() <= position
    assert np.abs(after.minutiae.y - before.minutiae.y).max() <= position
    turned = turn_deg(after.minutiae.angle, before.minutiae.angle)
    assert turned.max() <= ANGLE_STEP_DEG[name] / 2 + 1e-3
    assert (after.width, after.height) == (before.width, before.height)
    assert abs(after.dpi - before.dpi) <= (2.54 if name in FMR else 0.0)
    if name in FMR:
        assert np.array_equal(after.minutiae.kind, before.minutiae.kind)
        assert again.quality_known is record.views[0].quality_known
        assert (again.finger, again.impression) == (
            record.views[0].finger,
            record.views[0].impression,
        )
    if record.views[0].quality_known:
        loss = after.minutiae.quality.astype(int) - before.minutiae.quality
        assert ((loss == 0) | ((loss == 1) & (before.minutiae.quality == 0))).all()


@pytest.mark.parametrize("name", WRITTEN)
@settings(max_examples=30)
@given(record=records(fewest=1))
def test_what_is_read_is_written_alike(name: str, record: TemplateRecord) -> None:
    codec = codec_of_name(name)
    once = written(codec, record)
    again = codec.decode(once, ReadingOptions())  # told nothing of what the format does not keep
    assert written(codec, again) == once
    assert written(codec, codec.decode(once, reading_of(record))) == once


@pytest.mark.parametrize("name", FMR)
@settings(max_examples=20)
@given(record=records(views=3))
def test_all_views_come_back(name: str, record: TemplateRecord) -> None:
    codec = codec_of_name(name)
    data = written(codec, record)
    assert codec_of_content(data).name == name
    again = codec.decode(data, ReadingOptions())
    assert not again.notes
    assert [view.finger for view in again.views] == [view.finger for view in record.views]
    assert [len(view.template.minutiae) for view in again.views] == [
        len(view.template.minutiae) for view in record.views
    ]
    assert written(codec, again) == data


@pytest.mark.parametrize("name", sorted(set(WRITTEN) - set(FMR)))
def test_a_format_of_one_print_refuses_two(name: str) -> None:
    record = sample_record()
    with pytest.raises(TemplateError, match="one print a file, and there are 2"):
        written(codec_of_name(name), replace(record, views=record.views * 2))


@pytest.mark.parametrize("name", ["iso2005", "ansi2004"])
def test_views_of_two_sizes_need_the_later_formats(name: str) -> None:
    first = sample_record().views[0]
    other = replace(first, template=replace(first.template, width=301))
    both = TemplateRecord("", (first, other))
    with pytest.raises(TemplateError, match="one size and resolution for all"):
        written(codec_of_name(name), both)
    later = codec_of_name(name.replace("2005", "2011").replace("2004", "2009"))
    assert len(later.decode(written(later, both), ReadingOptions()).views) == 2


@pytest.mark.parametrize("name", FMR)
def test_of_too_many_minutiae_the_worst_are_dropped_first(name: str) -> None:
    n = 300
    minutiae = Minutiae(
        np.arange(n), np.zeros(n), np.zeros(n), np.ones(n), np.where(np.arange(n) % 2, 90, 40)
    )
    codec = codec_of_name(name)
    assert codec.encode is not None
    encoded = codec.encode(TemplateRecord("", (View(Template(minutiae, n, 10)),)))
    assert encoded.notes == ("45 minutiae of lowest quality dropped: 255 fit in",)
    kept = codec.decode(encoded.data, ReadingOptions()).views[0].template.minutiae
    assert kept.x.tolist() == [x for x in range(n) if x % 2 or x < 210]


@pytest.mark.parametrize("name", FMR)
def test_minutiae_outside_the_print_are_dropped_with_a_word(name: str) -> None:
    minutiae = Minutiae([5, -3, 9, 50], [5, 5, 5, 5], [0, 0, 0, 0])
    codec = codec_of_name(name)
    assert codec.encode is not None
    encoded = codec.encode(TemplateRecord("", (View(Template(minutiae, 10, 10)),)))
    assert encoded.notes == ("2 minutiae outside the print dropped",)


@pytest.mark.parametrize("name", FMR)
def test_a_print_too_large_for_the_format_is_refused(name: str) -> None:
    wide = TemplateRecord("", (View(Template(Minutiae.empty(), 16_385, 10)),))
    with pytest.raises(TemplateError, match="cannot hold"):
        written(codec_of_name(name), wide)


@pytest.mark.parametrize("name", FMR)
def test_extended_data_stay_in_their_format_and_nowhere_else(name: str) -> None:
    codec = codec_of_name(name)
    view = sample_record().views[0]
    layout = "ansi2009" if name == "ansi2009am1" else name
    own = replace(view, extended=ExtendedData(layout, b"\x01\x44\x00\x05\x97"))
    again = codec.decode(written(codec, TemplateRecord("", (own,))), ReadingOptions()).views[0]
    assert again.extended == own.extended
    foreign = replace(view, extended=ExtendedData("other", b"\x01\x44\x00\x05\x97"))
    assert codec.encode is not None
    encoded = codec.encode(TemplateRecord("", (foreign,)))
    assert "extended data of other dropped" in encoded.notes
    assert codec.decode(encoded.data, ReadingOptions()).views[0].extended is None


@given(templates(fewest=1), st.sampled_from(FMR), st.sampled_from(FMR))
@settings(max_examples=30)
def test_from_one_format_to_another_and_back_costs_a_step_of_each(
    template: Template, first: str, second: str
) -> None:
    minutiae, total = template.minutiae, 0.0
    record = TemplateRecord("", (View(template),))
    for name in (first, second):
        codec = codec_of_name(name)
        record = codec.decode(written(codec, record), ReadingOptions())
        total += ANGLE_STEP_DEG[name] / 2
    after = record.views[0].template.minutiae
    assert np.abs(after.xy - minutiae.xy).max() <= 0.5001
    assert turn_deg(after.angle, minutiae.angle).max() <= total + 1e-3
