"""What commands say of the images that they are given: bare pixels, negatives, odd resolutions."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from fpmatch import load_template
from fpmatch.image.quality.polarity import INVERTED

Pixels = NDArray[np.uint8]


@pytest.fixture
def bare(tmp_path, fingers):
    """Return a file that is the pixels of a print, 280 x 300."""
    path = tmp_path / "1_1.dat"
    path.write_bytes(fingers[0].tobytes())
    return path


def test_bare_pixels_are_the_print_that_they_are(run, prints, bare):
    words = ("--raw", "100x100", "--raw", "280x300", "--dpi", 500)
    result = run("verify", bare, prints / "1_1.png", *words, "--json")
    assert result.exit_code == 0
    assert result.stderr == ""
    itself = run("verify", prints / "1_1.png", prints / "1_1.png", "--json")
    assert json.loads(result.stdout)["score"] == json.loads(itself.stdout)["score"] >= 40


@pytest.mark.parametrize("command", ["extract", "stages"])
def test_every_command_takes_bare_pixels(run, bare, tmp_path, command):
    result = run(command, bare, "-o", tmp_path / "out", "--raw", "280x300", "--dpi", 500)
    assert (result.exit_code, result.stderr) == (0, "")
    if command == "extract":
        assert load_template(tmp_path / "out" / "1_1.json").width == 280


def test_galleries_take_bare_pixels(run, bare, tmp_path):
    gallery = tmp_path / "prints.db"
    words = ("--raw", "280x300", "--dpi", 500, "--workers", 1)
    assert run("enrol", gallery, bare, *words).exit_code == 0
    found = run("identify", gallery, bare, *words, "--json")
    assert found.exit_code == 0
    assert '"subject": "1"' in found.stdout


def test_a_size_that_does_not_fit_is_one_line(run, prints, bare):
    result = run("verify", bare, prints / "1_1.png", "--raw", "100x100")
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr == (
        f"fpmatch: error: {bare}: not an image of a known format; "
        "its 84000 bytes are no raw 100x100 (10000)\n"
    )
    wrong = run("verify", bare, bare, "--raw", "280")
    assert wrong.exit_code == 2
    assert "WIDTHxHEIGHT, as in 388x374, not '280'" in wrong.stderr


def test_what_was_noticed_on_reading_is_said_once(run, tmp_path, pressed):
    for name in ("a.png", "b.png"):
        Image.fromarray(255 - pressed[0]).save(tmp_path / name, dpi=(500, 500))
    (tmp_path / "plain").mkdir()
    Image.fromarray(pressed[0]).save(tmp_path / "plain" / "c.png", dpi=(500, 500))
    result = run("extract", tmp_path / "a.png", tmp_path / "b.png", "-o", tmp_path / "out")
    assert result.exit_code == 0
    assert result.stderr == f"fpmatch: note: {tmp_path / 'a.png'} and 1 other: {INVERTED}\n"
    run("extract", tmp_path / "plain" / "c.png", "-o", tmp_path / "out")
    turned, plain = (load_template(tmp_path / "out" / f"{name}.json") for name in ("a", "c"))
    assert turned.minutiae == plain.minutiae


def test_a_wrong_resolution_is_told_match_or_not(run, prints, tmp_path):
    pair = prints / "1_2.png", prints / "1_1.png"
    right = run("verify", *pair)
    assert "Scale " not in right.stdout
    wrong = run("verify", *pair, "--probe-dpi", 569)
    assert wrong.stdout.startswith("MATCH\n")
    told = re.search(
        r"Scale .* about (\d+) dpi, not 569, or .* about (\d+), not 500$",
        wrong.stdout,
        re.MULTILINE,
    )
    assert told is not None
    assert [int(dpi) for dpi in told.groups()] == [
        pytest.approx(500, abs=15),
        pytest.approx(569, abs=15),
    ]
    run("extract", prints / "1_2.png", "-o", tmp_path)
    template = json.loads((tmp_path / "1_2.json").read_text())
    (tmp_path / "1_2.json").write_text(json.dumps(template | {"dpi": 1000}))
    twice = run("verify", tmp_path / "1_2.json", prints / "1_1.png")
    assert twice.stdout.startswith("NO MATCH\n")
    assert twice.stdout.endswith("not 500; at that scale they match\n")
    scale = json.loads(run("verify", tmp_path / "1_2.json", prints / "1_1.png", "--json").stdout)[
        "scale"
    ]
    assert scale["ratio"] == pytest.approx(2, rel=0.03)
    assert scale["differs"] is True
