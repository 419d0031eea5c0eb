"""Finger minutiae records: told apart, and read in spite of what writers got wrong."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_records import FMR, sample_record, written

from fpmatch.errors import TemplateError
from fpmatch.formats import fmr
from fpmatch.formats.fmr_header import dpi_of, per_cm
from fpmatch.formats.record import ExtendedData, ReadingOptions, TemplateRecord
from fpmatch.formats.registry import codec_of_content, codec_of_name
from fpmatch.minutiae import MAX_DPI, MIN_DPI

# A record of ISO/IEC 19794-2:2005 by hand: 300 x 400 pixels at 500 dpi, right index, and one
# bifurcation at (100, 50), 90 degrees, quality 77.
ISO_2005 = bytes.fromhex(
    "464d5200 20323000 00000024 0000 012c 0190 00c5 00c5 01 00"
    "02 00 50 01 8064 0032 40 4d 0000".replace(" ", "")
)
# The same by ANSI/INCITS 378-2004.
ANSI_2004 = bytes.fromhex(
    "464d5200 20323000 0026 0000 0000 0000 012c 0190 00c5 00c5 01 00"
    "02 00 50 01 8064 0032 2d 4d 0000".replace(" ", "")
)
# The same by ANSI/INCITS 378-2009, and by ISO/IEC 19794-2:2011.
ANSI_2009 = bytes.fromhex(
    "464d5200 30333000 0000002e 0000 0000 00 0000 01 00"
    "02 00 00 50 0000 0000 012c 0190 00c5 00c5 01 8064 0032 2d 4d 0000".replace(" ", "")
)
ISO_2011 = bytes.fromhex(
    "464d5200 30333000 0000003c 0001 00"
    "0000002d ffffffffffffffffff 00 0000 0000 01 50 0000 0000"
    "02 00 00c5 00c5 00 012c 0190 60 01 8064 0032 40 4d 0000".replace(" ", "")
)
BY_HAND = {"iso2005": ISO_2005, "ansi2004": ANSI_2004, "ansi2009": ANSI_2009, "iso2011": ISO_2011}


@pytest.mark.parametrize("name", BY_HAND)
def test_a_record_by_hand_is_read_and_written(name: str) -> None:
    data = BY_HAND[name]
    codec = codec_of_content(data)
    assert codec.name == name
    record = codec.decode(data, ReadingOptions())
    (view,) = record.views
    template, minutiae = view.template, view.template.minutiae
    assert record.notes == ()
    assert (template.width, template.height, template.dpi) == (300, 400, 500)
    assert (view.finger, view.quality, view.quality_known) == (2, 80, True)
    assert minutiae.xy.tolist() == [[100, 50]]
    assert minutiae.angle[0] == pytest.approx(np.pi / 2)
    assert (minutiae.kind[0], minutiae.quality[0]) == (2, 77)
    assert written(codec, record) == data


def test_a_header_one_byte_short_is_that_of_the_draft_of_2007() -> None:
    draft = ANSI_2009[:16] + ANSI_2009[17:]
    record = codec_of_content(draft).decode(draft, ReadingOptions())
    assert record.format == "ansi2009"
    assert record.notes[0] == "the layout is that of the draft of 2007"
    assert record.views[0].template.minutiae.xy.tolist() == [[100, 50]]


def test_a_producer_in_the_header_does_not_make_ansi_2009_iso_2011() -> None:
    marked = ANSI_2009[:12] + bytes.fromhex("0001 0000 00 0028".replace(" ", "")) + ANSI_2009[19:]
    record = codec_of_content(marked).decode(marked, ReadingOptions())
    assert record.format == "ansi2009"
    assert record.views[0].fields == (("product", "0x0001 0x0000"), ("capture device", "0x0028"))


def test_a_long_record_of_2004_has_a_length_of_six_bytes() -> None:
    views = sample_record(250).views * 45
    codec = codec_of_name("ansi2004")
    data = written(codec, TemplateRecord("", views))
    assert len(data) > 2**16
    assert data[8:10] == b"\0\0"
    assert codec_of_content(data) is codec
    assert len(codec.decode(data, ReadingOptions()).views) == 45


def test_angles_beyond_179_in_ansi_are_read_as_iso_steps() -> None:
    iso_angles = ANSI_2004[:34] + bytes([0xC0]) + ANSI_2004[35:]
    record = codec_of_content(iso_angles).decode(iso_angles, ReadingOptions())
    assert record.views[0].template.minutiae.angle[0] == pytest.approx(np.pi * 1.5)
    assert any("steps of ISO" in note for note in record.notes)


def test_a_size_and_resolution_of_zero_are_not_told() -> None:
    data = ISO_2005[:14] + bytes(8) + ISO_2005[22:]
    codec = codec_of_content(data)
    view = codec.decode(data, ReadingOptions()).views[0]
    assert not view.dpi_known
    assert not view.size_known
    assert (view.template.width, view.template.height, view.template.dpi) == (101, 51, 500)
    told = codec.decode(data, ReadingOptions(dpi=1000, size=(640, 480))).views[0].template
    assert (told.width, told.height, told.dpi) == (640, 480, 1000)


def test_no_quality_is_not_the_worst() -> None:
    data = ISO_2005[:33] + bytes(1) + ISO_2005[34:]
    record = codec_of_content(data).decode(data, ReadingOptions())
    assert not record.views[0].quality_known
    assert record.views[0].template.minutiae.quality.tolist() == [100]
    assert written(codec_of_name("iso2005"), record) == data
    short = written(codec_of_name("iso2011"), record)
    assert len(short) == len(ISO_2011) - 1  # five bytes a minutia
    assert not codec_of_content(short).decode(short, ReadingOptions()).views[0].quality_known


@pytest.mark.parametrize("name", FMR)
def test_bytes_after_a_record_are_passed_over_with_a_word(name: str) -> None:
    data = written(codec_of_name(name), sample_record()) + b"foreign"
    record = codec_of_content(data).decode(data, ReadingOptions())
    assert record.format == name
    assert "7 bytes after the record passed over" in record.notes


@pytest.mark.parametrize("name", FMR)
def test_zeros_after_a_record_are_passed_over_in_silence(name: str) -> None:
    data = written(codec_of_name(name), sample_record()) + bytes(7)
    record = codec_of_content(data).decode(data, ReadingOptions())
    assert record.format == name
    assert record.notes == ()


def test_extended_data_cut_short_cost_no_minutiae() -> None:
    data = ISO_2005[:-2] + b"\x00\x09\x01\x44"
    record = codec_of_content(data).decode(data, ReadingOptions())
    assert len(record.views[0].template.minutiae) == 1
    assert record.views[0].extended is None
    assert "extended data cut short (2 of 9 bytes) and passed over" in record.notes


def test_different_resolutions_across_and_down_are_refused() -> None:
    data = ISO_2005[:20] + b"\x00\x62" + ISO_2005[22:]
    with pytest.raises(TemplateError, match="resolution differ"):
        codec_of_content(data).decode(data, ReadingOptions())


@pytest.mark.parametrize(
    ("data", "kinds"),
    [
        (b"\x01\x44\x00\x05\x97", ["maker's own 0x0144"]),
        (b"\x00\x01\x00\x06\x12\x34\x00\x02\x00\x05\x00", ["ridge counts", "cores and deltas"]),
        (b"\x00\x02\x00\x02\x12\x34", ["cores and deltas"]),  # length without its header
        (b"\x00\x02\x00\xff", ["blocks that do not fill their area"]),
    ],
)
def test_extended_data_are_named(data: bytes, kinds: list[str]) -> None:
    assert fmr.extended_kinds(ExtendedData("iso2005", data)) == kinds


@given(st.integers(round(MIN_DPI), round(MAX_DPI)))
def test_a_resolution_comes_back_to_its_step(dpi: int) -> None:
    step = per_cm(dpi)
    assert abs(dpi_of(step, step) - dpi) <= 2.54
    assert per_cm(dpi_of(step, step)) == step


@pytest.mark.parametrize("dpi", [300, 400, 500, 569, 600, 1000, 1200])
def test_resolutions_of_scanners_come_back_exactly(dpi: int) -> None:
    assert dpi_of(per_cm(dpi), per_cm(dpi)) == dpi
