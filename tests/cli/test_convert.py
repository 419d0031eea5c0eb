"""`fpmatch convert`: from any format to any other, and what is lost on the way."""

import numpy as np
import pytest

from fpmatch import extract, load_template, save_template
from fpmatch.formats.files import load_record, save_record
from fpmatch.formats.record import TemplateRecord, View
from fpmatch.formats.registry import codec_of_name, written_formats
from fpmatch.templates.minutiae import Minutiae, Template
from tests.conftest import assert_refused


@pytest.fixture
def small():
    return Template(Minutiae([10, 20], [5, 6], [0, 4], [1, 2], [50, 60]), 300, 400, 569)


@pytest.mark.parametrize("name", written_formats())
def test_every_format_is_written_and_read(run, tmp_path, small, name):
    save_template(tmp_path / "in.json", small)
    codec = codec_of_name(name)
    out = tmp_path / f"out{codec.suffixes[0]}"
    result = run("convert", tmp_path / "in.json", out, "--format", name)
    assert result.exit_code == 0
    assert result.stdout == f"{out}: {codec.title}, 2 minutiae\n"
    assert load_record(out).format == name
    back = run("convert", out, tmp_path / "back.json", "--size", "300x400", "--dpi", "569")
    assert back.exit_code == 0
    again = load_template(tmp_path / "back.json")
    assert (again.width, again.height, again.dpi) == (300, 400, 569)
    assert np.allclose(again.minutiae.xy, small.minutiae.xy, atol=0.51)


def test_losses_are_notes(run, prints, tmp_path):
    n, out = 260, tmp_path / "out.iso"
    many = Template(Minutiae(np.arange(n), np.arange(n), np.zeros(n)), 300, 300)
    save_template(tmp_path / "in.json", many)
    result = run("convert", tmp_path / "in.json", out)
    assert result.stderr.startswith(f"fpmatch: note: {out}: 5 minutiae ")
    assert len(load_template(out).minutiae) == 255
    assert run("convert", prints / "1_1.png", out).exit_code == 0
    assert len(load_template(out).minutiae) == len(extract(prints / "1_1.png").minutiae)


def test_prints_stay_together_or_one_is_taken(run, tmp_path, small):
    source, ansi, out = (tmp_path / name for name in ("in.iso", "out.ansi", "out.csv"))
    save_record(source, TemplateRecord("", (View(small, finger=1), View(small, finger=2))))
    assert run("convert", source, ansi).stdout.endswith("2 prints, 4 minutiae\n")
    assert [view.finger for view in load_record(ansi).views] == [1, 2]
    for view in ((), ("--record", 3)):
        assert_refused(run("convert", source, out, *view), "2")
        assert not out.exists()
    assert run("convert", source, out, "--record", 2).exit_code == 0


def test_what_is_assumed_of_a_source_is_said(run, tmp_path):
    source, out = tmp_path / "in.xyt", tmp_path / "out.iso"
    source.write_text("22 16 281 16\n")
    angles, dpi, size = run("convert", source, out).stderr.splitlines()
    assert ("NIST" in angles, "500 dpi" in dpi, "23 x 16 px" in size) == (True, True, True)
    for name, y in (("xyt", 300 - 16), ("xyt-m1", 16)):
        stated = ("--from", name, "--format", "csv", "--size", "300x300", "--dpi", 569)
        note = run("convert", source, out, *stated).stderr
        assert note.count("\n") == 1
        assert (note == f"{angles}\n") is (name == "xyt")
        assert (load_template(out).minutiae.y.tolist(), load_template(out).dpi) == ([y], 569)
