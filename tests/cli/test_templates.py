"""Every command that takes an image takes a template too, of any format and under any name."""

import json

import pytest
from PIL import Image

from fpmatch import extract, load_template, save_template
from fpmatch.formats.files import save_record
from fpmatch.formats.record import TemplateRecord, View
from fpmatch.prints.reading import ASSUMED_DPI


@pytest.fixture(scope="session")
def templates(prints, tmp_path_factory):
    """Return a folder with templates of two fingers in several formats."""
    folder = tmp_path_factory.mktemp("templates")
    for stem, suffix in (("1_1", ".iso"), ("1_2", ".ansi2009"), ("2_1", ".xyt"), ("2_2", ".csv")):
        image = "2_1" if stem == "2_2" else stem
        save_template(folder / f"{stem}{suffix}", extract(prints / f"{image}.png"))
    return folder


@pytest.mark.parametrize("reference", ["1_2.ansi2009", "1_2.png"])
def test_verify_compares_templates_and_images(run, prints, templates, reference):
    other = (prints if reference.endswith("png") else templates) / reference
    same = run("verify", templates / "1_1.iso", other, "--json")
    assert (same.exit_code, same.stderr) == (0, "")
    assert json.loads(same.stdout)["transform"]["rotation_deg"] == pytest.approx(-90, abs=1)
    assert run("verify", templates / "2_2.csv", other).exit_code == 1


def test_what_a_template_does_not_tell_is_said(run, templates):
    words = ("verify", templates / "2_1.xyt", templates / "2_2.csv")
    result = run(*words)
    angles, dpi = result.stderr.splitlines()
    assert (result.exit_code, "NIST" in angles, ASSUMED_DPI in dpi) == (0, True, True)
    assert ASSUMED_DPI not in run(*words, "--probe-dpi", 500).stderr


def test_of_several_prints_the_first_is_taken_and_said(run, prints, tmp_path):
    path = tmp_path / "two.iso2011"
    views = tuple(View(extract(prints / name)) for name in ("1_1.png", "2_1.png"))
    save_record(path, TemplateRecord("", views))
    result = run("verify", path, prints / "1_1.png")
    assert (result.exit_code, result.stderr.count(f"{path}: ")) == (0, 1)
    enrolled = run("enrol", tmp_path / "x.db", path, "--pattern", "(?P<subject>two)")
    assert (enrolled.exit_code, "2 prints" in enrolled.stderr) == (1, True)


def test_overlays_show_templates_on_white(run, prints, templates, tmp_path):
    out = tmp_path / "out.png"
    assert run("verify", templates / "1_1.iso", prints / "1_2.png", "--overlay", out).exit_code == 0
    with Image.open(out) as picture:
        assert picture.size[0] > 300


def test_extract_takes_templates_and_writes_any_format(run, prints, templates, tmp_path):
    words = [templates / "1_1.iso", prints / "2_1.png", "-o", tmp_path]
    assert run("extract", *words, "--format", "iso2011").exit_code == 0
    assert {path.name for path in tmp_path.iterdir()} == {"1_1.iso2011", "2_1.iso2011"}
    again = load_template(tmp_path / "1_1.iso2011")
    assert again.minutiae == load_template(templates / "1_1.iso").minutiae


def test_galleries_are_filled_and_searched_with_templates(run, prints, templates, tmp_path):
    gallery = tmp_path / "prints.db"
    enrolled = json.loads(run("enrol", gallery, templates, "--workers", 1, "--json").stdout)
    assert (enrolled["enrolled"], enrolled["failed"], enrolled["dpi_assumed"]) == (4, 0, 1)
    words = ["--json", "-k", 1, "--workers", 1]
    searched = run("identify", gallery, templates / "1_2.ansi2009", prints / "2_1.png", *words)
    probes = json.loads(searched.stdout)["probes"]
    assert [probe["candidates"][0]["subject"] for probe in probes] == ["1", "2"]
