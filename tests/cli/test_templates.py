"""Every command that takes an image takes a template too, of any format and under any name."""

import json

import pytest
from PIL import Image

from fpmatch import extract, load_template, save_template
from fpmatch.formats.files import save_record
from fpmatch.formats.record import TemplateRecord, View
from fpmatch.prints.reading import ASSUMED_DPI

from .conftest import assert_refused, copied, rows_of


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
    assert same.exit_code == 0
    assert same.stderr == ""
    found = json.loads(same.stdout)
    assert found["transform"]["rotation_deg"] == pytest.approx(-90, abs=1)
    assert run("verify", templates / "2_2.csv", other).exit_code == 1


def test_what_a_template_does_not_tell_is_said(run, templates):
    path = templates / "2_1.xyt"
    result = run("verify", path, templates / "2_2.csv")
    assert result.exit_code == 0
    assert result.stderr.splitlines() == [
        f"fpmatch: note: {path}: angles taken for NIST: y up, degrees",
        f"fpmatch: note: {path}: {ASSUMED_DPI} (--dpi sets it)",
    ]
    told = run("verify", path, templates / "2_2.csv", "--probe-dpi", 500)
    assert "assumed" not in told.stderr


def test_of_several_prints_the_first_is_taken_and_said(run, prints, tmp_path):
    path = tmp_path / "two.iso2011"
    views = tuple(View(extract(prints / name)) for name in ("1_1.png", "2_1.png"))
    save_record(path, TemplateRecord("", views))
    result = run("verify", path, prints / "1_1.png")
    assert result.exit_code == 0
    assert result.stderr == f"fpmatch: note: {path}: the first of its 2 prints is used\n"
    enrolled = run("enrol", tmp_path / "x.db", path, "--pattern", "(?P<subject>two)")
    assert enrolled.exit_code == 1
    assert "contains 2 prints, and one is expected" in enrolled.stderr


def test_overlays_show_templates_on_white(run, prints, templates, tmp_path):
    out = tmp_path / "out.png"
    assert run("overlay", templates / "1_1.iso", prints / "1_2.png", "-o", out).exit_code == 0
    with Image.open(out) as picture:
        assert picture.size[0] > 300


def test_a_damaged_template_is_one_line(run, templates, tmp_path):
    path = tmp_path / "cut.tif"
    path.write_bytes((templates / "1_1.iso").read_bytes()[:60])
    assert_refused(run("verify", path, templates / "1_1.iso"), f"{path}: cut short: ")


def test_extract_takes_templates_and_writes_any_format(run, prints, templates, tmp_path):
    words = [templates / "1_1.iso", prints / "2_1.png", "-o", tmp_path]
    assert run("extract", *words, "--format", "iso2011").exit_code == 0
    assert {path.name for path in tmp_path.iterdir()} == {"1_1.iso2011", "2_1.iso2011"}
    again = load_template(tmp_path / "1_1.iso2011")
    assert again.minutiae == load_template(templates / "1_1.iso").minutiae


def test_galleries_are_filled_and_searched_with_templates(run, prints, templates, tmp_path):
    gallery = tmp_path / "prints.db"
    enrolled = run("enrol", gallery, templates, "--workers", 1, "--json")
    assert enrolled.exit_code == 0
    assert json.loads(enrolled.stdout)["enrolled"] == 4
    assert json.loads(enrolled.stdout)["dpi_assumed"] == 1
    words = ["--json", "-k", 1, "--workers", 1]
    found = run("identify", gallery, templates / "1_2.ansi2009", prints / "2_1.png", *words)
    assert found.exit_code == 0
    probes = json.loads(found.stdout)["probes"]
    assert [probe["candidates"][0]["subject"] for probe in probes] == ["1", "2"]


def test_scores_of_a_folder_of_templates(run, prints, templates, tmp_path):
    images, out = copied(prints, tmp_path / "images", "1_1.png"), tmp_path / "scores.csv"
    sides = ("--references", templates, "--probes", images, "-o", out)
    assert run("score", *sides, "--workers", 1).exit_code == 0
    scores = {row["reference"]: float(row["score"]) for row in rows_of(out)}
    assert set(scores) == {"1_1.iso", "1_2.ansi2009", "2_1.xyt", "2_2.csv"}
    assert min(scores["1_1.iso"], scores["1_2.ansi2009"]) > 40
    assert max(scores["2_1.xyt"], scores["2_2.csv"]) < 40


def test_a_batch_lists_exactly_the_damaged_templates(run, templates, tmp_path):
    folder, gallery = tmp_path / "prints", tmp_path / "prints.db"
    folder.mkdir()
    good = (templates / "1_1.iso").read_bytes()
    contents = {3: good[:-30], 8: b"no template"}
    for number in range(1, 11):
        data = contents.get(number, good) + bytes(number)
        (folder / f"{number}_1.iso").write_bytes(data)
    result = run("enrol", gallery, folder, "--workers", 1)
    assert result.exit_code == 1
    assert result.stdout.startswith("enrolled 8 of 10 pictures, 2 failed")
    failed = [line for line in result.stderr.splitlines() if "failed" in line]
    for number, line in zip(contents, failed, strict=True):
        assert f"{number}_1.iso: " in line
    sides = ("--references", gallery, "--probes", folder, "-o", tmp_path / "s.csv")
    scored = run("score", *sides, "--workers", 1, "--json")
    assert scored.exit_code == 1
    failures = json.loads(scored.stdout)["failures"]
    assert {failure["name"] for failure in failures} == {"3_1.iso", "8_1.iso"}
