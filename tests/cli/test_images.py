"""What commands make of images: bare pixels, ``--polarity``, ``--enhance``, wrong resolutions."""

import io
import json
import sys

import click
import pytest
from PIL import Image

from fpmatch import load_template, verify
from fpmatch.cli.options import PRINT
from fpmatch.image import extract as extraction_of_one
from fpmatch.image.extract import DEFAULT_ENHANCEMENT, assess
from fpmatch.image.io import grey
from fpmatch.image.quality.polarity import INVERTED
from fpmatch.prints import reading
from tests.conftest import assert_refused, copied


def first_score(result):
    return json.loads(result.stdout)["probes"][0]["candidates"][0]["score"]


@pytest.fixture
def bare(tmp_path, fingers):
    """Return a file that is the pixels of a print, 280 x 300."""
    path = tmp_path / "1_1.dat"
    path.write_bytes(fingers[0].tobytes())
    return path


def test_bare_pixels_are_the_print_that_they_are(run, prints, bare, tmp_path):
    size = ("--raw", "280x300", "--dpi", 500)
    result = run("verify", bare, prints / "1_1.png", "--raw", "100x100", *size, "--json")
    assert (result.exit_code, result.stderr) == (0, "")
    itself = run("verify", prints / "1_1.png", prints / "1_1.png", "--json")
    assert json.loads(result.stdout)["score"] == json.loads(itself.stdout)["score"] >= 40
    for name in ("both", "stages"):
        written = run("extract", bare, "-o", tmp_path / name, "--format", name, *size)
        assert (written.exit_code, written.stderr) == (0, "")
    assert load_template(tmp_path / "both" / "1_1.json").width == 280
    gallery = tmp_path / "prints.db"
    assert run("enrol", gallery, bare, *size, "--workers", 1).exit_code == 0
    assert first_score(run("identify", gallery, bare, *size, "--workers", 1, "--json")) > 40
    assert "280 x 300 px" in run("inspect", bare, "--raw", "280x300").stdout


def test_a_dash_is_standard_input(run, prints, tmp_path):
    print_ = prints / "1_1.png"
    one = print_.read_bytes()
    itself = run("verify", print_, print_, "--json")
    for pair in (("-", print_), (print_, "-")):
        piped = run("verify", *pair, "--json", "--case-report", tmp_path / "case.html", input=one)
        assert not piped.stderr
        assert json.loads(piped.stdout)["score"] == json.loads(itself.stdout)["score"]
    assert run("extract", "-", "-o", tmp_path, "--format", "json", input=one).exit_code == 0
    template = tmp_path / "standard-input.json"
    converted = run("convert", "-", tmp_path / "p.iso", input=template.read_bytes())
    assert (converted.exit_code, run("inspect", "-", input=one).exit_code) == (0, 0)
    assert len(load_template(tmp_path / "p.iso").minutiae) == len(load_template(template).minutiae)
    for words in (("verify", "-", "-"), ("extract", "-", "-", "-o", tmp_path)):
        twice = run(*words, input=one)
        assert (twice.exit_code, "only one print can come from" in twice.stderr) == (2, True)
    assert_refused(run("verify", print_, "-", input=b""), "empty")


def test_standard_input_may_be_closed_or_too_large(monkeypatch):
    monkeypatch.setattr(grey, "DEFAULT_LIMITS", grey.ImageLimits(max_file_megabytes=0.001))
    with click.Context(click.Command("verify")) as context:
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(bytes(5000))))
        assert PRINT.convert("-", None, context).stat().st_size == 1001
    monkeypatch.setattr(sys, "stdin", None)
    with (
        click.Context(click.Command("verify")) as context,
        pytest.raises(click.BadParameter, match="standard input is closed"),
    ):
        PRINT.convert("-", None, context)


def test_a_size_that_does_not_fit_is_one_line(run, prints, bare):
    words = ("verify", bare, prints / "1_1.png", "--raw")
    assert_refused(run(*words, "100x100"), "84000")
    wrong = run(*words, "280")
    assert (wrong.exit_code, "'280'" in wrong.stderr) == (2, True)


def test_bytes_of_no_known_format_are_answered_with_the_option(run, prints, bare, tmp_path):
    square = tmp_path / "1_2.dat"
    square.write_bytes(bare.read_bytes()[: 280 * 280])
    out = tmp_path / "out"
    for words in (
        ("verify", square, prints / "1_1.png"),
        ("verify", prints / "1_1.png", square, "--overlay", tmp_path / "o.png"),
        ("extract", square, "-o", out),
        ("convert", square, tmp_path / "t.json"),
        ("inspect", square),
        ("enrol", tmp_path / "prints.db", square, "--workers", 1),
    ):
        assert "; if its 78400 bytes are pixels: --raw WIDTHxHEIGHT" in run(*words).stderr, words
    read = run("convert", square, tmp_path / "t.json", "--raw", "280x280", "--dpi", 500)
    assert (read.exit_code, read.stderr) == (0, "")
    square.write_bytes(b"word" * 78400)
    assert "--raw" not in run("inspect", square).stderr


def test_a_dataset_toml_beside_the_file_counts_unless_an_option_is_given(run, prints, tmp_path):
    folder = copied(prints, tmp_path / "set", "1_1.png", "1_2.png")
    pair = (folder / "1_1.png", folder / "1_2.png")

    def states(*options):
        """Return what commands say of the resolution, and a score that depends on it."""
        verified = json.loads(run("verify", *pair, "--json", *options).stdout)
        (inspected,) = json.loads(run("inspect", pair[0], "--json", *options).stdout)
        dpis = [inspected["image"]["dpi"]]
        for words in (("extract", pair[0], "-o", tmp_path), ("convert", pair[0], "{}/1_1.json")):
            done = run(*(str(word).format(tmp_path) for word in words), *options)
            assert done.exit_code == 0, done.stderr
            dpis.append(load_template(tmp_path / "1_1.json").dpi)
        return dpis, verified["score"]

    plain, given = states(), states("--dpi", 569)
    (folder / "dataset.toml").write_text("dpi = 569\n")
    assert states() == given
    assert given[0] == [569] * 3
    assert states("--dpi", 500) == plain
    assert verify(*pair).score == given[1]
    (folder / "dataset.toml").write_text("dpi = 5\n")
    assert_refused(run("verify", *pair), f"{folder}/dataset.toml: ")


@pytest.fixture
def darks(tmp_path, pressed):
    folder = tmp_path / "darks"
    folder.mkdir()
    for number, pixels in enumerate(pressed[:2], start=1):
        Image.fromarray(pixels).save(folder / f"{number}_1.png", dpi=(500, 500))
    return folder


@pytest.mark.parametrize(
    "words",
    [
        "verify {one} {one}",
        "extract {one} -o {out}",
        "extract {one} -o {out} --format stages",
        "enrol {out} {one} --workers 1",
        "score --references {darks} --probes {darks} -o {out}.csv",
    ],
)
def test_the_polarity_asked_for_is_taken_and_said(run, darks, tmp_path, words):
    given = words.format(one=darks / "1_1.png", darks=darks, out=tmp_path / "out").split()
    asked = run(*given, "--polarity", "white")
    assert asked.exit_code == 0, asked.stderr
    assert INVERTED in asked.stderr
    assert INVERTED not in run(*given).stderr


def test_a_folder_says_its_polarity(run, darks, tmp_path):
    (darks / "dataset.toml").write_text('polarity = "white"\n')
    result = run("enrol", tmp_path / "prints.db", darks, "--workers", 1, "--json")
    assert result.stderr == f"fpmatch: note: {darks}/1_1.png and 1 other: {INVERTED}\n"
    both = [f"{darks}/1_1.png", f"{darks}/2_1.png"]
    assert json.loads(result.stdout)["notes"] == [{"note": INVERTED, "prints": both}]
    (darks / "dataset.toml").write_text('polarity = "pink"\n')
    for words in (("enrol", tmp_path / "prints.db", darks), ("inspect", darks / "1_1.png")):
        assert_refused(run(*words), f"{darks}/dataset.toml: no polarity 'pink'")


@pytest.fixture
def asked(monkeypatch):
    """Return the list of the enhancements by which prints are extracted from now on."""
    ways = []

    def noted(*arguments, enhance="", **others):
        ways.append(enhance)
        return assess(*arguments, enhance=enhance, **others)

    monkeypatch.setattr(extraction_of_one, "assess", noted)
    monkeypatch.setattr(reading, "assess", noted)
    return ways


@pytest.mark.parametrize("options", [[], ["--enhance", "filters"]])
@pytest.mark.parametrize(
    ("words", "extractions"),
    [
        ("verify {one} {other} --overlay {out}", 2),
        ("extract {one} -o {out}", 1),
        ("extract {one} -o {out} --format stages", 1),
        ("evaluate {folder} --workers 1 --bootstrap 0", 3),
    ],
)
def test_every_command_enhances_as_it_is_told(
    run, prints, tmp_path, asked, words, extractions, options
):
    folder = copied(prints, tmp_path / "set", "1_1.png", "1_2.png", "2_1.png")
    named = {"one": folder / "1_1.png", "other": folder / "1_2.png", "out": tmp_path / "out.png"}
    result = run(*words.format(folder=folder, **named).split(), *options)
    assert (result.exit_code, result.stderr) == (0, "")
    assert asked == [options[1] if options else DEFAULT_ENHANCEMENT] * extractions
