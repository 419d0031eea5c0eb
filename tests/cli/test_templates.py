"""Every command that takes an image takes a template too, of any format and under any name."""

import json

import numpy as np
import pytest
from PIL import Image

from fpmatch import extract, load_template, save_template
from fpmatch.formats.files import save_record
from fpmatch.formats.record import TemplateRecord, View
from tests.conftest import assert_refused
from tests.image.made_files import an2, tagged_print, with_fields


@pytest.fixture(scope="session")
def templates(prints, tmp_path_factory):
    """Return a folder with templates of two fingers in several formats."""
    folder = tmp_path_factory.mktemp("templates")
    for stem, suffix in (("1_1", ".iso"), ("1_2", ".ansi"), ("2_1", ".xyt"), ("2_2", ".csv")):
        image = "2_1" if stem == "2_2" else stem
        save_template(folder / f"{stem}{suffix}", extract(prints / f"{image}.png"))
    return folder


@pytest.mark.parametrize("reference", ["1_2.ansi", "1_2.png"])
def test_verify_compares_templates_and_images(run, prints, templates, reference):
    other = (prints if reference.endswith("png") else templates) / reference
    same = run("verify", templates / "1_1.iso", other, "--json")
    assert (same.exit_code, same.stderr) == (0, "")
    assert json.loads(same.stdout)["transform"]["rotation_deg"] == pytest.approx(-90, abs=1)
    assert run("verify", templates / "2_2.csv", other).exit_code == 1


def test_of_several_prints_the_first_is_taken_and_said(run, prints, tmp_path):
    path = tmp_path / "two.iso"
    views = tuple(View(extract(prints / name)) for name in ("1_1.png", "2_1.png"))
    save_record(path, TemplateRecord("", views))
    result = run("verify", path, prints / "1_1.png")
    assert (result.exit_code, result.stderr.count(f"{path}: ")) == (0, 1)
    enrolled = run("enrol", tmp_path / "x.db", path, "--pattern", "(?P<subject>two)")
    assert (enrolled.exit_code, "2 prints" in enrolled.stderr) == (1, True)


@pytest.fixture(params=["card.an2", "two.iso"])
def several(request, prints, tmp_path):
    """Return a card, whose first finger is missing, or a record of prints of two fingers."""
    path = tmp_path / request.param
    files = prints / "1_1.png", prints / "2_1.png"
    if path.suffix == ".an2":
        amputated = (14, with_fields(14, [(18, b"1\x1fXX")]))
        images = [tagged_print(np.asarray(Image.open(file))) for file in files]
        path.write_bytes(an2(amputated, *images))
    else:
        save_record(path, TemplateRecord("", tuple(View(extract(file)) for file in files)))
    return path


def test_a_print_of_several_is_chosen_by_its_number(run, prints, several, tmp_path):
    for number, status in ((1, 1), (2, 0)):
        chosen = run("verify", several, prints / "2_1.png", "--record", number)
        assert (chosen.exit_code, "first of its 2" in chosen.stderr) == (status, False)
    second = extract(prints / "2_1.png")
    out, gallery, words = tmp_path / "out.json", tmp_path / "x.db", ("--record", 2)
    assert run("convert", several, out, *words).exit_code == 0
    assert len(load_template(out).minutiae) == len(second.minutiae)
    assert run("extract", several, "-o", tmp_path, *words).exit_code == 0
    extracted = load_template(tmp_path / f"{several.stem}.json")
    assert len(extracted.minutiae) == len(second.minutiae)
    assert run("enrol", gallery, several, "--pattern", "(?P<subject>.*)", *words).exit_code == 0
    found = run("identify", gallery, prints / "2_1.png", "--workers", 1, "--json")
    assert json.loads(found.stdout)["probes"][0]["candidates"][0]["score"] > 90
    assert_refused(run("verify", several, several, "--record", 3), "not 3")


def test_inspect_shows_the_image_of_a_number(run, prints, tmp_path):
    path = tmp_path / "card.an2"
    pixels = np.asarray(Image.open(prints / "1_1.png"))
    path.write_bytes(an2(tagged_print(pixels), tagged_print(pixels[:200])))
    assert "280 x 300 px" in (first := run("inspect", path).stdout)
    assert "the first of its 2 images was read (--record chooses one)" in first
    assert "280 x 200 px" in (second := run("inspect", path, "--record", 2).stdout)
    assert "first of its" not in second


def test_extract_takes_templates_and_writes_any_format(run, prints, templates, tmp_path):
    words = [templates / "1_1.iso", prints / "2_1.png", "-o", tmp_path]
    assert run("extract", *words, "--format", "ansi2004").exit_code == 0
    assert {path.name for path in tmp_path.iterdir()} == {"1_1.ansi", "2_1.ansi"}
    again = load_template(tmp_path / "1_1.ansi")
    assert np.array_equal(again.minutiae.xy, load_template(templates / "1_1.iso").minutiae.xy)
