"""`fpmatch inspect`: a line for every file that is known, an error for every one that is not."""

import json
from dataclasses import replace

import pytest
from PIL import Image

from fpmatch import assess
from fpmatch.cli.inspection import extended_kinds
from fpmatch.formats.files import save_record, save_template
from fpmatch.formats.record import TemplateRecord, View
from fpmatch.templates.minutiae import Minutiae, Template


@pytest.fixture
def small():
    return Template(Minutiae([10, 20, 30], [5, 6, 7], [0, 1, 4], [1, 2, 2], [50, 60, 70]), 300, 400)


def test_images_and_templates_are_a_line_each(run, prints, tmp_path, small):
    path, xyt = tmp_path / "odd name.tif", tmp_path / "print.xyt"
    save_template(path, small, file_format="iso2005")
    save_template(xyt, small)
    quality = assess(prints / "1_1.png").quality
    result = run("inspect", prints / "1_1.png", path, xyt)
    assert (result.exit_code, result.stderr) == (0, "")
    image, iso, nist = result.stdout.splitlines()
    assert image == f"{prints / '1_1.png'}: PNG image, 280 x 300 px, 500 dpi, {quality}"
    assert iso == (
        f"{path}: ISO/IEC 19794-2:2005, 300 x 400 px, 500 dpi, "
        "3 minutiae (1 ending, 2 bifurcations), quality 60"
    )
    assert nist.startswith(f"{xyt}: NIST XYT, size unknown, resolution unknown, 3 minutiae; ")


def test_prints_of_one_file_stand_between_bars(run, tmp_path, small):
    path = tmp_path / "hand.iso"
    one = replace(small, minutiae=small.minutiae.take([0]))
    cores = b"\x00\x02\x00\x05\x00"
    rolled = View(one, finger=7, impression=1, quality=60, quality_known=False, extended=cores)
    save_record(path, TemplateRecord("iso2005", (View(small, finger=2, quality=80), rolled)))
    assert run("inspect", path).stdout == (
        f"{path}: ISO/IEC 19794-2:2005, 300 x 400 px, 500 dpi, 2 prints: "
        "right index, 3 minutiae (1 ending, 2 bifurcations), quality 80 | "
        "left index, live rolled, 1 minutia (1 ending), quality 60, no quality of minutiae, "
        "cores and deltas\n"
    )
    (document,) = json.loads(run("inspect", path, "--json").stdout)
    shown = [(each["finger"], each["minutia_quality"]) for each in document["prints"]]
    assert shown == [("right index", 60), ("left index", None)]
    assert document["image"] is None


def test_json_of_an_image(run, prints):
    (document,) = json.loads(run("inspect", prints / "untagged.tif", "--json").stdout)
    quality = assess(prints / "untagged.tif").quality.as_dict()
    assert document["image"].pop("quality") == quality
    size = {"width": 280, "height": 300}
    assert document["image"] == {**size, "dpi": None, "notes": [], "likely_dpi": None}
    assert (document["format"], document["prints"]) == ("TIFF", [])


def test_what_is_wrong_with_an_image_follows(run, prints, tmp_path):
    few = tmp_path / "few.png"  # 1000 dpi: too few pixels for a print
    Image.new("L", (50, 50), 200).save(few, dpi=(1000, 1000))
    result = run("inspect", prints / "blank.png", few)
    assert result.exit_code == 0
    blank, small = result.stdout.splitlines()
    assert "500 dpi, quality 0; no ridges: " in blank
    assert ("quality" in small, "; no print: " in small) == (False, True)


def test_what_is_not_known_is_an_error_a_line_and_the_rest_is_told(run, prints):
    bad = [prints / name for name in ("text.png", "gone.png", "truncated.png", "folder.png")]
    result = run("inspect", *bad[:2], prints / "1_1.png", *bad[2:])
    assert (result.exit_code, result.stdout.count("\n")) == (1, 1)
    for line, path in zip(result.stderr.splitlines(), bad, strict=True):
        assert line.startswith(f"fpmatch: error: {path}: ")
    assert run("inspect", *bad).exit_code == 2


def test_folders_are_taken_as_enrol_takes_them(run, prints, tmp_path):
    for folder in ("7", "8"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "1_1.png").write_bytes((prints / "1_1.png").read_bytes())
    (tmp_path / "dataset.toml").write_text("dpi = 569\n")
    lines = run("inspect", tmp_path).stdout.splitlines()
    assert [line.split(": ")[0] for line in lines] == [
        str(tmp_path / folder / "1_1.png") for folder in ("7", "8")
    ]
    assert len(json.loads(run("inspect", tmp_path / "7", "--json").stdout)) == 1
    (tmp_path / "none").mkdir()
    nothing = run("inspect", tmp_path / "none")
    assert (nothing.exit_code, nothing.stdout) == (2, "")
    assert "is a folder, not an image" in nothing.stderr


@pytest.mark.parametrize(
    ("data", "kinds"),
    [
        (b"\x01\x44\x00\x05\x97", ["maker's own 0x0144"]),
        (b"\x00\x01\x00\x06\x12\x34\x00\x02\x00\x05\x00", ["ridge counts", "cores and deltas"]),
        (b"\x00\x02\x00\x02\x12\x34", ["cores and deltas"]),  # length without its header
        (b"\x00\x02\x00\xff", ["blocks that do not fill their area"]),
    ],
)
def test_extended_data_are_named(data, kinds):
    assert extended_kinds(data) == kinds
