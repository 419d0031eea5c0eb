"""`fpmatch inspect`: a line for every file that is known, an error for every one that is not."""

import json
from dataclasses import replace

import pytest
from PIL import Image

from fpmatch import assess
from fpmatch.formats.files import save_record, save_template
from fpmatch.formats.record import ExtendedData, TemplateRecord, View
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
    assert result.stdout.splitlines() == [
        f"{prints / '1_1.png'}: PNG image, 280 x 300 px, 500 dpi, {quality}",
        f"{path}: ISO/IEC 19794-2:2005, 300 x 400 px, 500 dpi, "
        "3 minutiae (1 ending, 2 bifurcations), quality 60",
        f"{xyt}: NIST XYT, size unknown, resolution unknown, 3 minutiae; "
        "angles taken for NIST: y up, degrees",
    ]


def test_prints_of_one_file_stand_between_bars(run, tmp_path, small):
    path = tmp_path / "hand.iso2011"
    views = (
        View(small, finger=2, quality=80),
        View(
            replace(small, minutiae=small.minutiae.take([0])),
            finger=7,
            impression=1,
            quality_known=False,
            extended=ExtendedData("iso2011", b"\x00\x02\x00\x05\x00"),
        ),
    )
    save_record(path, TemplateRecord("", views))
    assert run("inspect", path).stdout == (
        f"{path}: ISO/IEC 19794-2:2011, 300 x 400 px, 500 dpi, 2 prints: "
        "right index, 3 minutiae (1 ending, 2 bifurcations), quality 80 | "
        "left index, live rolled, 1 minutia (1 ending), no quality of minutiae, "
        "cores and deltas\n"
    )
    found = json.loads(run("inspect", path, "--json").stdout)
    assert [print_["finger"] for print_ in found[0]["prints"]] == ["right index", "left index"]
    assert [print_["minutia_quality"] for print_ in found[0]["prints"]] == [60, None]
    assert found[0]["image"] is None


def test_json_of_an_image(run, prints):
    (found,) = json.loads(run("inspect", prints / "untagged.tif", "--json").stdout)
    assert found["format"] == "TIFF"
    quality = assess(prints / "untagged.tif").quality.as_dict()
    assert found["image"].pop("quality") == quality
    assert found["image"] == {"width": 280, "height": 300, "dpi": None, "notes": []}
    assert found["prints"] == []


def test_what_is_wrong_with_an_image_follows(run, prints, tmp_path):
    few = tmp_path / "few.png"  # 1000 dpi: too few pixels for a print
    Image.new("L", (50, 50), 200).save(few, dpi=(1000, 1000))
    result = run("inspect", prints / "blank.png", few)
    assert result.exit_code == 0
    blank, small = result.stdout.splitlines()
    assert blank.endswith("500 dpi, quality 0; no ridges: no fingerprint is found in the image")
    assert "quality" not in small
    assert "; no print: resampled from 1000 to 500 dpi, " in small


def test_what_is_not_known_is_an_error_a_line_and_the_rest_is_told(run, prints):
    bad = [prints / name for name in ("text.png", "gone.png", "truncated.png", "folder.png")]
    result = run("inspect", *bad[:2], prints / "1_1.png", *bad[2:])
    assert result.exit_code == 1
    assert result.stdout.count("\n") == 1
    lines = result.stderr.splitlines()
    assert len(lines) == len(bad)
    for line, path in zip(lines, bad, strict=True):
        assert line.startswith(f"fpmatch: error: {path}: ")
    assert run("inspect", *bad).exit_code == 2


def test_a_line_is_a_line_whatever_the_name(run, tmp_path, small):
    odd, bad = tmp_path / "two\nlines.iso", tmp_path / "bad\n.iso"
    save_template(odd, small)
    bad.write_bytes(odd.read_bytes()[:20])
    result = run("inspect", odd, bad)
    assert result.stdout.count("\n") == result.stderr.count("\n") == 1
