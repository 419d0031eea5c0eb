"""Finger minutiae records: distinguished, and read in spite of what writers got wrong."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from fpmatch.errors import TemplateError
from fpmatch.formats.fmr import WITHOUT_EXTENDED
from fpmatch.formats.record import TemplateRecord
from fpmatch.templates.minutiae import MAX_DPI, MIN_DPI, Minutiae, Template
from tests.formats.made_records import (
    BY_HAND,
    FMR,
    only_view,
    read,
    record_of,
    sample_record,
    written,
)

ISO_2005, ANSI_2004, ISO_2011 = (BY_HAND[name] for name in (*FMR, "iso2011"))


@pytest.mark.parametrize("name", BY_HAND)
def test_a_record_by_hand_is_read_and_written(name):
    record = read(BY_HAND[name])
    assert (record.format, record.notes) == (name, ())
    (view,) = record.views
    template, minutiae = view.template, view.template.minutiae
    assert (template.width, template.height, template.dpi) == (300, 400, 500)
    assert (view.finger, view.quality, view.quality_known) == (2, 80, True)
    assert minutiae.xy.tolist() == [[100, 50]]
    assert minutiae.angle[0] == pytest.approx(np.pi / 2)
    assert (minutiae.kind[0], minutiae.quality[0]) == (2, 77)
    if name in FMR:
        assert written(name, record) == BY_HAND[name]


def test_a_producer_in_the_header_does_not_make_ansi_2009_iso_2011():
    data = BY_HAND["ansi2009"]
    record = read(data[:12] + bytes.fromhex("0001 0000 00 0028") + data[19:])
    assert (record.format, len(record.views[0].template)) == ("ansi2009", 1)


def test_minutiae_of_five_bytes_have_no_quality():
    at = ISO_2011.index(bytes.fromhex("8064"))
    short = ISO_2011[: at - 2] + b"\x50\x01" + ISO_2011[at : at + 5] + bytes(2)
    record = read(short)
    assert record.format == "iso2011"
    assert not record.views[0].quality_known
    assert record.views[0].template.minutiae.xy.tolist() == [[100, 50]]
    assert record.notes[0] == "a view declares 45 bytes and has 44"
    with pytest.raises(TemplateError, match="a minutia has 7 bytes"):
        read(ISO_2011[: at - 2] + b"\x70" + ISO_2011[at - 1 :])


def test_a_size_and_resolution_of_zero_are_unknown():
    data = ISO_2005[:14] + bytes(8) + ISO_2005[22:]
    view = only_view(data)
    assert (view.template.dpi_known, view.size_known) == (False, False)
    assert (view.template.width, view.template.height, view.template.dpi) == (101, 51, 500)
    stated = only_view(data, dpi=1000, size=(640, 480)).template
    assert (stated.width, stated.height, stated.dpi) == (640, 480, 1000)


def test_no_quality_is_not_the_worst_and_a_reserved_kind_is_other():
    data = ISO_2005[:33] + bytes(1) + ISO_2005[34:]
    record = read(data)
    assert not record.views[0].quality_known
    assert record.views[0].template.minutiae.quality.tolist() == [100]
    assert written("iso2005", record) == data
    odd = read(ISO_2005[:28] + b"\xc0" + ISO_2005[29:])
    assert odd.notes == ("1 minutia of a reserved kind read as other",)
    assert odd.views[0].template.minutiae.kind.tolist() == [0]


@pytest.mark.parametrize(
    ("data", "angle_deg", "note"),
    [
        (ANSI_2004[:34] + bytes([0xC0]) + ANSI_2004[35:], 270, "steps of ISO"),
        (ISO_2005[:-2] + b"\x00\x09\x01\x44", 90, "data cut short (2 of 9 bytes) and passed over"),
    ],
)
def test_what_is_odd_costs_no_minutiae_and_is_noted(data, angle_deg, note):
    record = read(data)
    (view,) = record.views
    assert np.degrees(view.template.minutiae.angle).tolist() == pytest.approx([angle_deg])
    assert not view.extended
    assert any(note in one for one in record.notes)


@pytest.mark.parametrize("name", FMR)
def test_bytes_after_a_record_are_passed_over_with_a_note_and_zeros_in_silence(name):
    data = written(name, sample_record())
    for more, notes in ((b"foreign", ("7 bytes after the record passed over",)), (bytes(7), ())):
        record = read(data + more)
        assert (record.format, record.notes) == (name, notes)


@pytest.mark.parametrize("name", FMR)
@pytest.mark.parametrize("fingers", [(1,), (1, 2), (0, 0), (7, 8, 9)])
def test_views_may_end_without_the_length_of_extended_data(name, fingers):
    whole = BY_HAND[name]
    start, length_bytes = (24, 4) if name == "iso2005" else (26, 2)
    body = b"".join(bytes([finger]) + whole[start + 1 : -2] for finger in fingers)
    length = (start + len(body)).to_bytes(length_bytes, "big")
    head = whole[:8] + length + whole[8 + length_bytes : start - 2]
    record = read(head + bytes([len(fingers), 0]) + body)
    assert (record.format, record.notes) == (name, (WITHOUT_EXTENDED,))
    assert tuple(view.finger for view in record.views) == fingers
    assert {view.template.minutiae.x.item() for view in record.views} == {100}
    with pytest.raises(TemplateError, match="cut short"):  # by its length it has two bytes more
        read(whole[:-2])


@pytest.mark.parametrize(
    ("name", "length"),
    [
        *(("iso2005", text) for text in ("00000000", "00000001", "00000fff")),
        ("ansi2004", "2600"),
    ],
)
def test_a_wrong_length_is_noted(name, length):
    whole, stated = BY_HAND[name], bytes.fromhex(length)
    record = read(whole[:8] + stated + whole[8 + len(stated) :])
    assert record.format == name
    assert record.views[0].template.minutiae.xy.tolist() == [[100, 50]]
    declares = f"the header declares {int(length, 16)} bytes, the record has {len(whole)}"
    assert record.notes == (declares,)


@given(st.integers(round(MIN_DPI), round(MAX_DPI)))
@example(500)
@example(569)
def test_a_resolution_comes_back_to_its_step_and_that_of_a_scanner_exactly(dpi):
    data = written("iso2005", record_of(Template(Minutiae.empty(), 9, 9, dpi)))
    again = only_view(data).template
    assert abs(again.dpi - dpi) <= (0 if dpi % 100 == 0 or dpi == 569 else 2.54)
    assert written("iso2005", TemplateRecord("", (only_view(data),))) == data
