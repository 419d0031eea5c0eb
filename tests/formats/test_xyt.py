"""NIST's text formats: one print by two conventions, and which convention a file is taken for."""

import numpy as np
import pytest

from fpmatch.formats.record import TemplateRecord
from fpmatch.formats.registry import recognise
from tests.formats.made_records import only_view, read, sample_record, turn_deg, written

# One minutia of a print of 300 x 300 pixels as mindtct writes it in two ways: at (22, 284) from the
# top left, direction 31 of 32 clockwise from straight up, reliability 0.16.
NIST = b"22 16 281 16\n"
M1 = b"22 284 50 16\n"
TAKEN_FOR = {"xyt": "NIST: y up, degrees", "xyt-m1": "ANSI/INCITS 378: y down"}


@pytest.mark.parametrize(("name", "data"), [("xyt", NIST), ("xyt-m1", M1)])
def test_two_conventions_mean_the_same(name, data):
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
    before = sample_record().views[0].template.minutiae
    view = only_view(written("xyt", sample_record()))
    after = view.template.minutiae
    assert not view.size_known
    assert np.ptp(after.y - before.y) <= 1
    assert turn_deg(after.angle, before.angle).max() <= 0.501
    assert 0 <= after.y.min() <= after.y.max() < view.template.height + 1


def test_quality_may_be_missing_and_angles_may_run_from_minus_180():
    view = only_view(b"\r\n1 2 300\r\n\r\n4 5 -54")
    assert not view.quality_known
    assert view.template.minutiae.quality.tolist() == [100, 100]
    assert written("xyt", TemplateRecord("", (view,))) == b"1 2 300\n4 5 306\n"
