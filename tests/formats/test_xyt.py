"""NIST's text formats: one print by three conventions, and which convention a file is taken for."""

from __future__ import annotations

import numpy as np
import pytest
from made_records import sample_record, turn_deg, written

from fpmatch.errors import TemplateError
from fpmatch.formats.record import ReadingOptions, TemplateRecord, View
from fpmatch.formats.registry import codec_of_content, codec_of_name
from fpmatch.minutiae import Minutiae, Template

# One minutia of a print of 300 x 300 pixels as mindtct writes it in three ways: at (22, 284) from
# the top left, direction 31 of 32 clockwise from straight up, reliability 0.16.
MIN = b"""Image (w,h) 300 300

1 Minutiae Detected

   0 :   22,  284 : 31 :  0.160 :BIF : DIS :  2 :   23, 273;  0 :   40, 134;  7
"""
NIST = b"22 16 281 16\n"
M1 = b"22 284 50 16\n"


@pytest.mark.parametrize(("name", "data"), [("min", MIN), ("xyt", NIST), ("xyt-m1", M1)])
def test_three_conventions_say_the_same(name: str, data: bytes) -> None:
    assert codec_of_content(data).name == name
    record = codec_of_name(name).decode(data, ReadingOptions(size=(300, 300)))
    template = record.views[0].template
    assert template.minutiae.xy.tolist() == [[22, 284]]
    assert np.degrees(template.minutiae.angle[0]) == pytest.approx(101.25, abs=1.3)
    assert template.minutiae.quality.tolist() == [16]
    assert (template.width, template.height) == (300, 300)
    assert not record.views[0].dpi_known


def test_the_note_says_which_convention_was_taken() -> None:
    notes = [codec_of_content(data).decode(data, ReadingOptions()).notes for data in (NIST, M1)]
    assert notes == [
        ("angles taken for NIST: y up, degrees",),
        ("angles taken for ANSI/INCITS 378: y down, units of 2°",),
    ]


def test_a_real_print_is_taken_for_what_it_was_written_as() -> None:
    record = sample_record()
    for name in ("xyt", "xyt-m1"):
        assert codec_of_content(written(codec_of_name(name), record)).name == name


def test_without_a_size_only_the_shift_is_lost() -> None:
    before = sample_record().views[0].template
    data = written(codec_of_name("xyt"), sample_record())
    view = codec_of_content(data).decode(data, ReadingOptions()).views[0]
    after = view.template
    assert not view.size_known
    assert np.ptp(after.minutiae.y - before.minutiae.y) <= 1
    assert turn_deg(after.minutiae.angle, before.minutiae.angle).max() <= 0.501
    assert after.minutiae.y.min() >= 0
    assert after.minutiae.y.max() < after.height + 1


def test_quality_may_be_missing() -> None:
    view = (
        codec_of_content(b"1 2 300\n4 5 6\n").decode(b"1 2 300\n4 5 6\n", ReadingOptions()).views[0]
    )
    assert not view.quality_known
    assert view.template.minutiae.quality.tolist() == [100, 100]
    assert written(codec_of_name("xyt"), TemplateRecord("", (view,))) == b"1 2 300\n4 5 6\n"


def test_angles_of_libraries_that_run_from_minus_180_are_read() -> None:
    a, b = (
        codec_of_content(data).decode(data, ReadingOptions()).views[0].template.minutiae
        for data in (b"10 20 -79\n", b"10 20 281\n")
    )
    assert a == b


@pytest.mark.parametrize("name", ["xyt", "xyt-m1"])
def test_a_print_without_minutiae_is_refused_on_writing(name: str) -> None:
    empty = TemplateRecord("", (View(Template(Minutiae.empty(), 9, 9)),))
    with pytest.raises(TemplateError, match="would be an empty file"):
        written(codec_of_name(name), empty)


def test_windows_lines_and_blank_ones_are_read() -> None:
    data = b"\r\n22 16 281 16\r\n\r\n23 17 282 16"
    assert (
        len(codec_of_content(data).decode(data, ReadingOptions()).views[0].template.minutiae) == 2
    )
