"""How commands read files: bare pixels, standard input, ``--polarity``, one print of several."""

import io
import json
import sys

import click
import numpy as np
import pytest
from PIL import Image

from fpmatch import load_template, verify
from fpmatch.cli.options import PRINT
from fpmatch.formats.files import save_record
from fpmatch.formats.record import TemplateRecord, View
from fpmatch.image.enhancement.enhancers import ENHANCERS
from fpmatch.image.extract import extract
from fpmatch.image.io import grey
from fpmatch.image.quality.polarity import INVERTED
from tests.conftest import assert_refused, copied
from tests.image.made_files import an2, tagged_print, with_fields


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
    probe = tmp_path / "both" / "1_1.json"
    assert first_score(run("identify", gallery, probe, "--workers", 1, "--json")) > 40
    assert "280 x 300 px" in run("inspect", bare, "--raw", "280x300").stdout
    assert_refused(run("verify", bare, prints / "1_1.png", "--raw", "100x100"), "84000")


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


def test_a_dataset_toml_beside_the_file_counts_unless_an_option_is_given(run, prints, tmp_path):
    folder = copied(prints, tmp_path / "set", "1_1.png", "1_2.png")
    pair = (folder / "1_1.png", folder / "1_2.png")

    def states(*options):
        """Return what commands say of the resolution, and a score that depends on it."""
        (inspected,) = json.loads(run("inspect", pair[0], "--json", *options).stdout)
        run("extract", pair[0], "-o", tmp_path, *options)
        run("convert", pair[0], tmp_path / "converted.json", *options)
        templates = [load_template(tmp_path / name) for name in ("1_1.json", "converted.json")]
        dpis = [inspected["image"]["dpi"], *(template.dpi for template in templates)]
        return dpis, json.loads(run("verify", *pair, "--json", *options).stdout)["score"]

    plain, given = states(), states("--dpi", 569)
    (folder / "dataset.toml").write_text("dpi = 569\n")
    assert states() == given
    assert given == ([569] * 3, verify(*pair).score)
    assert states("--dpi", 500) == plain
    (folder / "dataset.toml").write_text('polarity = "pink"\n')
    for words in (("enrol", tmp_path / "x.db", folder), ("inspect", pair[0]), ("verify", *pair)):
        assert_refused(run(*words), f"{folder}/dataset.toml: no polarity 'pink'")


@pytest.mark.parametrize(
    "words",
    [
        "verify {one} {one}",
        "extract {one} -o {out} --format stages",
        "enrol {out} {folder} --workers 1",
        "score --references {folder} --probes {folder} -o {out}.csv",
    ],
)
def test_the_polarity_asked_for_is_taken_and_said(run, pressed, tmp_path, words):
    (tmp_path / "set").mkdir()
    for number, pixels in enumerate(pressed[:2], start=1):
        path = tmp_path / "set" / f"{number}_1.png"
        Image.fromarray(pixels).save(path, dpi=(500, 500))
    given = words.format(one=path, folder=path.parent, out=tmp_path / "out").split()
    assert INVERTED in run(*given, "--polarity", "white").stderr
    if words.startswith("enrol"):
        (path.parent / "dataset.toml").write_text('polarity = "white"\n')
        noted = run("enrol", tmp_path / "new.db", path.parent, "--workers", 1, "--json")
        both = [f"{path.parent}/1_1.png", f"{path.parent}/2_1.png"]
        assert json.loads(noted.stdout)["notes"] == [{"note": INVERTED, "prints": both}]
    else:
        assert INVERTED not in run(*given).stderr


def test_commands_enhance_as_they_are_told(run, prints, tmp_path):
    image = prints / "1_1.png"
    for words, way in (((), "learned"), (("--enhance", "filters"), "filters")):
        assert run("extract", image, "-o", tmp_path / way, *words).exit_code == 0
        assert load_template(tmp_path / way / "1_1.json") == extract(image, enhance=way)
    one, other = (run("verify", image, image, "--json", "--enhance", way) for way in ENHANCERS)
    assert json.loads(one.stdout)["pairs"] != json.loads(other.stdout)["pairs"]


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
    first = run("verify", several, prints / "1_1.png")
    assert (first.exit_code, first.stderr.count(f"{several}: ")) == (0, 1)
    for number, status in ((1, 1), (2, 0)):
        chosen = run("verify", several, prints / "2_1.png", "--record", number)
        assert (chosen.exit_code, "first of its 2" in chosen.stderr) == (status, False)
    second = extract(prints / "2_1.png")
    out, gallery, words = tmp_path / "out.json", tmp_path / "x.db", ("--record", 2)
    assert run("convert", several, out, *words).exit_code == 0
    assert len(load_template(out).minutiae) == len(second.minutiae)
    assert run("enrol", gallery, several, "--pattern", "(?P<subject>.*)", *words).exit_code == 0
    found = run("identify", gallery, prints / "2_1.png", "--workers", 1, "--json")
    assert json.loads(found.stdout)["probes"][0]["candidates"][0]["score"] > 90
    assert_refused(run("verify", several, several, "--record", 3), "not 3")
