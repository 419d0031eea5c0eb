"""The option ``--polarity`` and the polarity of folders, in the commands that read images."""

from __future__ import annotations

import json

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from fpmatch import load_template
from fpmatch.image.quality.polarity import INVERTED

from .conftest import assert_refused

Pixels = NDArray[np.uint8]


@pytest.fixture
def darks(tmp_path, pressed):
    """Return a folder of two prints with dark ridges."""
    folder = tmp_path / "darks"
    folder.mkdir()
    for number, pixels in enumerate(pressed[:2], start=1):
        Image.fromarray(pixels).save(folder / f"{number}_1.png", dpi=(500, 500))
    return folder


@pytest.mark.parametrize("command", ["verify", "extract", "stages", "enrol", "score"])
def test_what_is_asked_for_is_done_and_said(run, darks, tmp_path, command):
    image, output = darks / "1_1.png", tmp_path / "out"
    words = {
        "verify": (image, image),
        "extract": (image, "-o", output),
        "stages": (image, "-o", output),
        "enrol": (output, image, "--workers", 1),
        "score": ("--references", darks, "--probes", darks, "-o", tmp_path / "scores.csv"),
    }[command]
    asked = run(command, *words, "--polarity", "white")
    assert asked.exit_code == 0, asked.stderr
    assert INVERTED in asked.stderr
    if command in {"verify", "extract"}:
        assert INVERTED not in run(command, *words).stderr


def test_a_gallery_is_searched_with_what_is_asked_for(run, darks, tmp_path):
    gallery, image = tmp_path / "prints.db", darks / "1_1.png"
    run("enrol", gallery, image, "--workers", 1)
    scores = [
        json.loads(run("identify", gallery, image, "--polarity", asked, "--json").stdout)["probes"][
            0
        ]["candidates"][0]["score"]
        for asked in ("auto", "white")
    ]
    assert scores[0] > 60
    assert scores[1] < scores[0]


def test_a_folder_says_what_it_holds(run, darks, tmp_path):
    (darks / "dataset.toml").write_text('polarity = "white"\n')
    result = run("enrol", tmp_path / "prints.db", darks, "--workers", 1)
    assert f"{darks}/1_1.png and 1 other: {INVERTED}" in result.stderr
    (darks / "dataset.toml").write_text('polarity = "pink"\n')
    for words in (("enrol", tmp_path / "prints.db", darks), ("inspect", darks / "1_1.png")):
        reason = f"{darks}/dataset.toml: no polarity 'pink': there are auto, dark, white"
        assert_refused(run(*words), reason)


def test_images_that_are_read_at_once_decide_together(run, tmp_path, pressed, stripes):
    folder, plain = tmp_path / "white", tmp_path / "4.png"
    folder.mkdir()
    for number, pixels in enumerate((*pressed, stripes)):
        Image.fromarray(255 - pixels).save(folder / f"{number}.png", dpi=(500, 500))
    Image.fromarray(stripes).save(plain, dpi=(500, 500))
    run("extract", *sorted(folder.iterdir()), "-o", tmp_path / "turned")
    run("extract", plain, "-o", tmp_path / "plain")
    turned, as_it_is = (load_template(tmp_path / name / "4.json") for name in ("turned", "plain"))
    assert turned.minutiae == as_it_is.minutiae
    assert INVERTED not in run("inspect", folder / "4.png", "--json").stdout
    together = run("inspect", *sorted(folder.iterdir()), "--json")
    assert together.stdout.count(INVERTED) == len(pressed) + 1
