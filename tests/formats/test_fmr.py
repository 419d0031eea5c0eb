"""Finger minutiae records: told apart, and read in spite of what writers got wrong."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_records import FMR, only_view, read, sample_record, written

from fpmatch.errors import TemplateError
from fpmatch.formats.fmr_reader import WITHOUT_EXTENDED, dpi_of, per_cm
from fpmatch.formats.record import TemplateRecord
from fpmatch.templates.minutiae import MAX_DPI, MIN_DPI

# Records by hand: 300 x 400 pixels at 500 dpi, right index, and one bifurcation at (100, 50), 90
# degrees, quality 77.
ISO_2005 = bytes.fromhex(
    "464d5200 20323000 00000024 0000 012c 0190 00c5 00c5 01 0002 00 50 01 8064 0032 40 4d 0000"
)
ANSI_2004 = bytes.fromhex(
    "464d5200 20323000 0026 0000 0000 0000 012c 0190 00c5 00c5 01 00"
    "02 00 50 01 8064 0032 2d 4d 0000"
)
ANSI_2009 = bytes.fromhex(
    "464d5200 30333000 0000002e 0000 0000 00 0000 01 00"
    "02 00 00 50 0000 0000 012c 0190 00c5 00c5 01 8064 0032 2d 4d 0000"
)
ISO_2011 = bytes.fromhex(
    "464d5200 30333000 0000003c 0001 00"
    "0000002d ffffffffffffffffff 00 0000 0000 01 50 0000 0000"
    "02 00 00c5 00c5 00 012c 0190 60 01 8064 0032 40 4d 0000"
)
BY_HAND = {"iso2005": ISO_2005, "ansi2004": ANSI_2004, "ansi2009": ANSI_2009, "iso2011": ISO_2011}


@pytest.mark.parametrize("name", BY_HAND)
def test_a_record_by_hand_is_read_and_written(name):
    record = read(BY_HAND[name])
    assert record.format == name
    (view,) = record.views
    template, minutiae = view.template, view.template.minutiae
    assert record.notes == ()
    assert (template.width, template.height, template.dpi) == (300, 400, 500)
    assert (view.finger, view.quality, view.quality_known) == (2, 80, True)
    assert minutiae.xy.tolist() == [[100, 50]]
    assert minutiae.angle[0] == pytest.approx(np.pi / 2)
    assert (minutiae.kind[0], minutiae.quality[0]) == (2, 77)
    assert written(name, record) == BY_HAND[name]


def test_a_producer_in_the_header_does_not_make_ansi_2009_iso_2011():
    record = read(ANSI_2009[:12] + bytes.fromhex("0001 0000 00 0028") + ANSI_2009[19:])
    assert record.format == "ansi2009"
    assert record.views[0].fields == (("product", "0x0001 0x0000"), ("capture device", "0x0028"))


def test_date_and_sensor_of_iso_2011_are_fields():
    captured = bytes.fromhex("07db 0c 1f 0000000000 09 0001 0028")
    fields = only_view(ISO_2011[:19] + captured + ISO_2011[33:]).fields
    assert fields == (
        ("captured", "2011-12-31"),
        ("sensor technology", "9"),
        ("capture device", "0x0001 0x0028"),
    )


def test_a_long_record_of_2004_has_a_length_of_six_bytes():
    data = written("ansi2004", TemplateRecord("", sample_record(250).views * 45))
    assert len(data) > 2**16
    assert data[8:10] == b"\0\0"
    record = read(data)
    assert (record.format, len(record.views)) == ("ansi2004", 45)


def test_angles_beyond_179_in_ansi_are_read_as_iso_steps():
    record = read(ANSI_2004[:34] + bytes([0xC0]) + ANSI_2004[35:])
    assert record.views[0].template.minutiae.angle[0] == pytest.approx(np.pi * 1.5)
    assert any("steps of ISO" in note for note in record.notes)


def test_a_size_and_resolution_of_zero_are_not_told():
    data = ISO_2005[:14] + bytes(8) + ISO_2005[22:]
    view = only_view(data)
    assert not view.dpi_known
    assert not view.size_known
    assert (view.template.width, view.template.height, view.template.dpi) == (101, 51, 500)
    told = only_view(data, dpi=1000, size=(640, 480)).template
    assert (told.width, told.height, told.dpi) == (640, 480, 1000)


def test_no_quality_is_not_the_worst():
    data = ISO_2005[:33] + bytes(1) + ISO_2005[34:]
    record = read(data)
    assert not record.views[0].quality_known
    assert record.views[0].template.minutiae.quality.tolist() == [100]
    assert written("iso2005", record) == data
    short = written("iso2011", record)
    assert len(short) == len(ISO_2011) - 1  # five bytes a minutia
    assert not only_view(short).quality_known


@pytest.mark.parametrize("name", FMR)
def test_bytes_after_a_record_are_passed_over_with_a_word_and_zeros_in_silence(name):
    data = written(name, sample_record())
    for more, notes in ((b"foreign", ("7 bytes after the record passed over",)), (bytes(7), ())):
        record = read(data + more)
        assert record.format == name
        assert record.notes == notes


def test_extended_data_cut_short_cost_no_minutiae():
    record = read(ISO_2005[:-2] + b"\x00\x09\x01\x44")
    assert len(record.views[0].template.minutiae) == 1
    assert record.views[0].extended is None
    assert "extended data cut short (2 of 9 bytes) and passed over" in record.notes


@pytest.mark.parametrize("name", ["iso2005", "ansi2004"])
def test_a_record_may_end_without_the_length_of_extended_data(name):
    whole = BY_HAND[name]
    length = len(whole) - 2
    at = 11 if name == "iso2005" else 9  # the last byte of the length
    record = read(whole[:at] + bytes([length]) + whole[at + 1 : -2])
    assert record.format == name
    assert record.views[0].template.minutiae.xy.tolist() == [[100, 50]]
    assert record.notes == (WITHOUT_EXTENDED,)
    with pytest.raises(TemplateError, match="cut short"):  # by its length it has two bytes more
        read(whole[:-2])


@pytest.mark.parametrize("fingers", [(1, 2), (0, 0), (7, 8, 9)])
def test_several_views_may_end_without_the_length_of_extended_data(fingers):
    view = ISO_2005[25:-2]
    body = b"".join(bytes([finger]) + view for finger in fingers)
    head = ISO_2005[:8] + (24 + len(body)).to_bytes(4, "big") + ISO_2005[12:22]
    record = read(head + bytes([len(fingers), 0]) + body)
    assert record.format == "iso2005"
    assert tuple(view.finger for view in record.views) == fingers
    assert {view.template.minutiae.x.item() for view in record.views} == {100}
    assert record.notes == (WITHOUT_EXTENDED,)


@pytest.mark.parametrize("length", ["00000000", "00000001", "24000000", "00000fff"])
def test_iso_records_with_a_wrong_length_are_read_with_a_note(length):
    record = read(ISO_2005[:8] + bytes.fromhex(length) + ISO_2005[12:])
    assert record.format == "iso2005"
    assert record.views[0].template.minutiae.xy.tolist() == [[100, 50]]
    assert record.notes == (f"the header declares {int(length, 16)} bytes, the record has 36",)


@pytest.mark.parametrize("length", ["0000", "0001", "2600"])
def test_ansi_records_with_a_wrong_length_are_read_with_a_note(length):
    record = read(ANSI_2004[:8] + bytes.fromhex(length) + ANSI_2004[10:])
    assert record.format == "ansi2004"
    assert record.views[0].template.minutiae.xy.tolist() == [[100, 50]]
    assert record.notes == (f"the header declares {int(length, 16)} bytes, the record has 38",)


def test_different_resolutions_across_and_down_are_refused():
    with pytest.raises(TemplateError, match="resolution differ"):
        read(ISO_2005[:20] + b"\x00\x62" + ISO_2005[22:])


@given(st.integers(round(MIN_DPI), round(MAX_DPI)))
def test_a_resolution_comes_back_to_its_step(dpi):
    step = per_cm(dpi)
    assert abs(dpi_of(step, step) - dpi) <= 2.54
    assert per_cm(dpi_of(step, step)) == step


@pytest.mark.parametrize("dpi", [300, 400, 500, 569, 600, 1000, 1200])
def test_resolutions_of_scanners_come_back_exactly(dpi):
    assert dpi_of(per_cm(dpi), per_cm(dpi)) == dpi
