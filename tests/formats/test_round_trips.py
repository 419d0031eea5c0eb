"""What is written is read again, to a step of the format, and then written alike byte by byte."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_records import (
    ANGLE_STEP_DEG,
    FMR,
    WRITTEN,
    encoded,
    frame_of,
    read,
    record_of,
    records,
    sample_record,
    templates,
    turn_deg,
    written,
)

from fpmatch.errors import TemplateError
from fpmatch.formats.record import ExtendedData, TemplateRecord
from fpmatch.templates.minutiae import Minutiae, Template

TEXT_EXACT = ("csv", "json")


@pytest.mark.parametrize("name", WRITTEN)
@given(record=records(fewest=1))
def test_minutiae_come_back_to_a_step_of_the_format(name, record):
    data = written(name, record)
    again = read(data, file_format=name, **frame_of(record)).views[0]
    view = record.views[0]
    before, after = view.template, again.template
    assert len(after.minutiae) == len(before.minutiae)
    moved = np.abs(after.minutiae.xy - before.minutiae.xy).max()
    assert moved <= (0.0 if name in TEXT_EXACT else 0.5001)
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
    unknown = read(data, file_format=name)  # told nothing of what the format does not keep
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
        assert len(one.template.minutiae) == len(other.template.minutiae)
    assert written(name, again) == data


@pytest.mark.parametrize("name", sorted(set(WRITTEN) - set(FMR)))
def test_a_format_of_one_print_refuses_two(name):
    record = sample_record()
    with pytest.raises(TemplateError, match="one print a file"):
        written(name, replace(record, views=record.views * 2))


@pytest.mark.parametrize(
    ("name", "later"), [("iso2005", "iso2011"), ("ansi2004", "ansi2009")], ids=str
)
def test_views_of_two_sizes_need_the_later_formats(name, later):
    first = sample_record().views[0].template
    both = record_of(first, replace(first, width=301))
    with pytest.raises(TemplateError, match="one size"):
        written(name, both)
    assert len(read(written(later, both)).views) == 2


@pytest.mark.parametrize("name", FMR)
def test_what_does_not_fit_is_dropped_with_a_word_or_refused(name):
    n = 300
    minutiae = Minutiae(
        np.arange(n), np.zeros(n), np.zeros(n), np.ones(n), np.where(np.arange(n) % 2, 90, 40)
    )
    many = encoded(name, record_of(Template(minutiae, n, 10)))
    assert many.notes == ("45 minutiae of lowest quality dropped: 255 fit in",)
    kept = read(many.data).views[0].template.minutiae
    assert kept.x.tolist() == [x for x in range(n) if x % 2 or x < 210]
    outside = Template(Minutiae([5, -3, 9, 50], [5, 5, 5, 5], [0, 0, 0, 0]), 10, 10)
    notes = encoded(name, record_of(outside)).notes
    assert notes == ("2 minutiae outside the print dropped",)
    with pytest.raises(TemplateError, match="cannot hold"):
        written(name, record_of(Template(Minutiae.empty(), 16_385, 10)))


@pytest.mark.parametrize("name", FMR)
def test_extended_data_stay_in_their_format_and_nowhere_else(name):
    view = sample_record().views[0]
    own = replace(view, extended=ExtendedData(name, b"\x01\x44\x00\x05\x97"))
    again = read(written(name, TemplateRecord("", (own,)))).views[0]
    assert again.extended == own.extended
    foreign = replace(view, extended=ExtendedData("other", b"\x01\x44\x00\x05\x97"))
    without = encoded(name, TemplateRecord("", (foreign,)))
    assert "extended data of other dropped" in without.notes
    assert read(without.data).views[0].extended is None


@given(templates(fewest=1), st.sampled_from(FMR), st.sampled_from(FMR))
def test_from_one_format_to_another_and_back_costs_a_step_of_each(template, first, second):
    after = read(written(second, read(written(first, record_of(template)))))
    minutiae = after.views[0].template.minutiae
    assert np.abs(minutiae.xy - template.minutiae.xy).max() <= 0.5001
    steps = ANGLE_STEP_DEG[first] + ANGLE_STEP_DEG[second]
    assert turn_deg(minutiae.angle, template.minutiae.angle).max() <= steps / 2 + 1e-3
