"""NIST's text formats: one print by three conventions, and which convention a file is taken for."""

import numpy as np
import pytest
from made_records import only_view, read, record_of, sample_record, turn_deg, written

from fpmatch.errors import TemplateError
from fpmatch.formats.record import TemplateRecord
from fpmatch.formats.registry import recognise
from fpmatch.templates.minutiae import Minutiae, Template

# One minutia of a print of 300 x 300 pixels as mindtct writes it in two ways: at (22, 284) from the
# top left, direction 31 of 32 clockwise from straight up, reliability 0.16.
NIST = b"22 16 281 16\n"
M1 = b"22 284 50 16\n"
TAKEN_FOR = {"xyt": "NIST: y up, degrees", "xyt-m1": "ANSI/INCITS 378: y down"}


@pytest.mark.parametrize(("name", "data"), [("xyt", NIST), ("xyt-m1", M1)])
def test_two_conventions_say_the_same(name, data):
    record = read(data, size=(300, 300))
    assert record.format == name
    assert [TAKEN_FOR[name] in note for note in record.notes] == [True]
    template = record.views[0].template
    assert template.minutiae.xy.tolist() == [[22, 284]]
    assert np.degrees(template.minutiae.angle[0]) == pytest.approx(101.25, abs=1.3)
    assert template.minutiae.quality.tolist() == [16]
    assert (template.width, template.height) == (300, 300)
    assert not record.views[0].dpi_known


@pytest.mark.parametrize("name", ["xyt", "xyt-m1"])
def test_a_real_print_is_taken_for_what_it_was_written_as(name):
    assert recognise(written(name, sample_record())).name == name


def test_without_a_size_only_the_shift_is_lost():
    before = sample_record().views[0].template
    view = only_view(written("xyt", sample_record()))
    after = view.template
    assert not view.size_known
    assert np.ptp(after.minutiae.y - before.minutiae.y) <= 1
    assert turn_deg(after.minutiae.angle, before.minutiae.angle).max() <= 0.501
    assert after.minutiae.y.min() >= 0
    assert after.minutiae.y.max() < after.height + 1


def test_quality_may_be_missing():
    view = only_view(b"1 2 300\n4 5 6\n")
    assert not view.quality_known
    assert view.template.minutiae.quality.tolist() == [100, 100]
    assert written("xyt", TemplateRecord("", (view,))) == b"1 2 300\n4 5 6\n"


def test_angles_of_libraries_that_run_from_minus_180_are_read():
    a, b = (only_view(data).template for data in (b"10 20 -79\n", b"10 20 281\n"))
    assert a == b


@pytest.mark.parametrize("name", ["xyt", "xyt-m1"])
def test_a_print_without_minutiae_is_refused_on_writing(name):
    with pytest.raises(TemplateError, match="empty file"):
        written(name, record_of(Template(Minutiae.empty(), 9, 9)))


def test_windows_lines_and_blank_ones_are_read():
    view = only_view(b"\r\n22 16 281 16\r\n\r\n23 17 282 16")
    assert len(view.template.minutiae) == 2
