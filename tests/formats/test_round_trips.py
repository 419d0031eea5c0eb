"""What is written is read again, to a step of the format, and then written alike byte by byte."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings

from fpmatch.errors import TemplateError
from fpmatch.formats.record import TemplateRecord
from fpmatch.formats.registry import codec_of_name
from fpmatch.templates.minutiae import Minutiae, Template
from tests.formats.made_records import (
    ANGLE_STEP_DEG,
    FMR,
    WRITTEN,
    frame_of,
    read,
    record_of,
    records,
    sample_record,
    turn_deg,
    written,
)


@pytest.mark.parametrize("name", WRITTEN)
@given(record=records(fewest=1))
def test_minutiae_come_back_to_a_step_of_the_format(name, record):
    data = written(name, record)
    again = read(data, file_format=name, **frame_of(record)).views[0]
    view = record.views[0]
    before, after = view.template, again.template
    assert len(after) == len(before)
    moved = np.abs(after.minutiae.xy - before.minutiae.xy).max()
    assert moved <= (0.0 if name in {"csv", "json", "minutiae-csv"} else 0.5001)
    turned = turn_deg(after.minutiae.angle, before.minutiae.angle)
    assert turned.max() <= ANGLE_STEP_DEG[name] / 2 + 1e-3
    assert (after.width, after.height) == (before.width, before.height)
    assert abs(after.dpi - before.dpi) <= (2.54 if name in FMR else 0.0)
    if name in FMR:
        assert np.array_equal(after.minutiae.kind, before.minutiae.kind)
        assert again.quality_known is view.quality_known
        assert (again.finger, again.impression) == (view.finger, view.impression)
    if view.quality_known:
        loss = after.minutiae.quality.astype(int) - before.minutiae.quality
        assert ((loss == 0) | ((loss == 1) & (before.minutiae.quality == 0))).all()
    unknown = read(data, file_format=name)  # without what the format does not keep
    for one in (unknown, read(data, file_format=name, **frame_of(record))):
        assert written(name, one) == data


@pytest.mark.parametrize("name", FMR)
@settings(max_examples=20)
@given(record=records(views=3))
def test_all_views_come_back(name, record):
    data = written(name, record)
    again = read(data)
    assert (again.format, again.notes) == (name, ())
    for one, other in zip(again.views, record.views, strict=True):
        assert one.finger == other.finger
        assert len(one.template) == len(other.template)
    assert written(name, again) == data


@pytest.mark.parametrize("name", WRITTEN)
def test_what_a_format_cannot_hold_is_refused(name):
    view = sample_record().views[0]
    wider = replace(view, template=replace(view.template, width=301))
    nothing = record_of(Template(Minutiae.empty(), 16_385, 10))
    refused = [(TemplateRecord("", (view, wider)), "one print a file")]
    if name in FMR:
        refused = [(refused[0][0], "one size"), (nothing, "cannot hold a position of 16384")]
        refused += [(TemplateRecord("", (view,) * 256), "255 prints at most")]
    if name == "ansi2004":
        refused += [(TemplateRecord("", sample_record(250).views * 45), "a length")]
    if name.startswith("xyt"):
        refused += [(nothing, "empty file")]
    for record, reason in refused:
        with pytest.raises(TemplateError, match=reason):
            written(name, record)


@pytest.mark.parametrize("name", FMR)
def test_what_does_not_fit_is_dropped_with_a_note(name):
    encode = codec_of_name(name).encode
    n = 300
    quality = np.where(np.arange(n) % 2, 90, 40)
    minutiae = Minutiae(np.arange(n), np.zeros(n), np.zeros(n), np.ones(n), quality)
    many = encode(record_of(Template(minutiae, n, 10)))
    assert many.notes == ("45 minutiae of lowest quality dropped: 255 fit in",)
    kept = read(many.data).views[0].template.minutiae
    assert kept.x.tolist() == [x for x in range(n) if x % 2 or x < 210]
    outside = Template(Minutiae([5, -3, 9, 50], [5, 5, 5, 5], [0, 0, 0, 0]), 10, 10)
    assert encode(record_of(outside)).notes == ("2 minutiae outside the print dropped",)
    view = sample_record().views[0]
    odd = encode(TemplateRecord("", (replace(view, impression=24),) * 17))
    assert set(odd.notes) == {"impression type 24 written as 0, live plain"}
    assert len(read(odd.data).views) == 17
    ungraded = read(encode(TemplateRecord("", (replace(view, quality=None),))).data).views[0]
    assert ungraded.quality == round(view.template.minutiae.quality.mean())


@pytest.mark.parametrize("name", FMR)
def test_extended_data_stay_in_their_format_and_nowhere_else(name):
    encode = codec_of_name(name).encode
    view = replace(sample_record().views[0], extended=b"\x01\x44\x00\x05\x97")
    assert read(written(name, TemplateRecord(name, (view,)))).views[0].extended == view.extended
    without = encode(TemplateRecord("other", (view,)))
    assert without.notes == ("extended data of other dropped",)
    assert not read(without.data).views[0].extended
    fewer = replace(view, template=replace(view.template, width=100))
    assert (
        "extended data dropped, as they count" in encode(TemplateRecord(name, (fewer,))).notes[-1]
    )
