"""The option ``--polarity`` and the polarity of folders, in the commands that read images."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from fpmatch import load_template
from fpmatch.cli.options import POLARITIES
from fpmatch.image.quality import polarity
from fpmatch.image.quality.polarity import INVERTED

Pixels = NDArray[np.uint8]


@pytest.fixture
def darks(tmp_path: Path, pressed: list[Pixels]) -> Path:
    """Return a folder of two prints with dark ridges."""
    folder = tmp_path / "darks"
    folder.mkdir()
    for number, pixels in enumerate(pressed[:2], start=1):
        Image.fromarray(pixels).save(folder / f"{number}_1.png", dpi=(500, 500))
    return folder


def test_the_words_are_those_of_the_package() -> None:
    assert POLARITIES == polarity.POLARITIES


@pytest.mark.parametrize("command", ["verify", "extract", "stages", "enrol", "score"])
def test_what_is_asked_for_is_done_and_said(
    run: Any, darks: Path, tmp_path: Path, command: str
) -> None:
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
        assert run(command, *words, "--polarity", "grey").exit_code == 2


def test_a_gallery_is_searched_with_what_is_asked_for(
    run: Any, darks: Path, tmp_path: Path
) -> None:
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


def test_a_folder_says_what_it_holds(run: Any, darks: Path, tmp_path: Path) -> None:
    (darks / "dataset.toml").write_text('polarity = "white"\n')
    result = run("enrol", tmp_path / "prints.db", darks, "--workers", 1)
    assert f"{darks}/1_1.png and 1 other: {INVERTED}" in result.stderr
    (darks / "dataset.toml").write_text('polarity = "pink"\n')
    bad = run("enrol", tmp_path / "prints.db", darks, "--workers", 1)
    assert (bad.exit_code, bad.stdout) == (2, "")
    assert bad.stderr == (
        f"fpmatch: error: {darks}/dataset.toml: no polarity 'pink': there are auto, dark, white\n"
    )


def test_images_that_are_extracted_at_once_decide_together(
    run: Any, tmp_path: Path, pressed: list[Pixels], stripes: Pixels
) -> None:
    folder = tmp_path / "white"
    folder.mkdir()
    for number, pixels in enumerate((*pressed, stripes)):
        Image.fromarray(255 - pixels).save(folder / f"{number}.png", dpi=(500, 500))
    plain = tmp_path / "4.png"
    Image.fromarray(stripes).save(plain, dpi=(500, 500))
    run("extract", *sorted(folder.iterdir()), "-o", tmp_path / "turned")
    run("extract", plain, "-o", tmp_path / "plain")
    turned, as_it_is = (
        load_template(tmp_path / name / "4.json").minutiae for name in ("turned", "plain")
    )
    assert turned == as_it_is


def test_images_that_are_inspected_at_once_decide_together(
    run: Any, tmp_path: Path, pressed: list[Pixels], stripes: Pixels
) -> None:
    folder = tmp_path / "white"
    folder.mkdir()
    for number, pixels in enumerate((*pressed, stripes)):
        Image.fromarray(255 - pixels).save(folder / f"{number}.png", dpi=(500, 500))
    alone = run("inspect", folder / "4.png", "--json")
    together = run("inspect", *sorted(folder.iterdir()), "--json")
    assert INVERTED not in alone.stdout
    assert together.stdout.count(INVERTED) == len(pressed) + 1


def test_what_inspect_finds_beside_a_malformed_description_is_an_error(
    run: Any, darks: Path
) -> None:
    (darks / "dataset.toml").write_text('polarity = "pink"\n')
    result = run("inspect", darks / "1_1.png")
    assert (result.exit_code, result.stdout) == (2, "")
    assert "no polarity 'pink'" in result.stderr
