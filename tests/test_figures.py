"""The figures of the README: the script draws them, in the colours of the prints, and small."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from fpmatch.drawing.palette import PROBE_MARK, REFERENCE_MARK

ROOT = Path(__file__).resolve().parent.parent
MAX_BYTES = 400_000
FIGURES = {"overlay.png": "portrait", "how_it_works.png": "landscape"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder that the script has drawn into."""
    target = tmp_path_factory.mktemp("docs") / "figures"
    command = [sys.executable, str(ROOT / "scripts" / "make_figures"), "--out", str(target)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return target


def pixels_of(path: Path) -> NDArray[np.uint8]:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def share_near(pixels: NDArray[np.uint8], colour: tuple[int, int, int]) -> float:
    """Return the share of pixels within a few levels of `colour`."""
    apart = np.abs(pixels.astype(int) - np.array(colour)).max(axis=2)
    return float((apart < 25).mean())


def test_the_script_draws_the_figures_and_nothing_else(folder: Path) -> None:
    assert {path.name for path in folder.iterdir()} == set(FIGURES)


@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_is_small_and_as_wide_as_the_one_that_is_shown(folder: Path, name: str) -> None:
    drawn, shown = folder / name, ROOT / "docs" / "figures" / name
    assert max(drawn.stat().st_size, shown.stat().st_size) < MAX_BYTES
    height, width = pixels_of(drawn).shape[:2]
    assert (width > height) == (FIGURES[name] == "landscape")
    assert pixels_of(shown).shape[1] == pytest.approx(width, rel=0.05)


@pytest.mark.parametrize("name", FIGURES)
def test_both_prints_are_drawn_in_their_colours(folder: Path, name: str) -> None:
    pixels = pixels_of(folder / name)
    assert share_near(pixels, PROBE_MARK) > 0.001
    assert share_near(pixels, REFERENCE_MARK) > 0.001
