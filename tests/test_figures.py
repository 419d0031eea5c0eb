"""The figures of the documentation: the script draws them, in their colours, and small."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray
from PIL import Image

from fpmatch.drawing.palette import PROBE_MARK, REFERENCE_MARK, hexadecimal
from research.commands import research

ROOT = Path(__file__).resolve().parent.parent
MAX_BYTES = 400_000
FIGURES = {"overlay.png": "portrait", "how_it_works.png": "landscape"}
POINT_FIGURES = [
    "figure_2_triangulations.svg",
    "figure_3_one_rings.svg",
    "figure_4_unit_circle.svg",
    "figure_5_weights.svg",
    "figure_6a_two_circles.svg",
    "figure_6b_rotation.svg",
    "figure_7_flow_chart.svg",
]
SHOWN = ROOT / "docs" / "figures"
SVG = "{http://www.w3.org/2000/svg}"


def draw(target: Path, only: str) -> Path:
    """Draw figures of one kind into a folder."""
    words = ["figures", "--out", str(target), "--only", only]
    done = CliRunner().invoke(research, words)
    assert done.exit_code == 0, done.output
    return target


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder that the script has drawn prints into."""
    return draw(tmp_path_factory.mktemp("docs") / "figures", "prints")


@pytest.fixture(scope="module")
def point_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder that the script has drawn point sets into."""
    pytest.importorskip("matplotlib")
    return draw(tmp_path_factory.mktemp("docs") / "figures", "points") / "points"


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
    drawn, shown = folder / name, SHOWN / name
    assert max(drawn.stat().st_size, shown.stat().st_size) < MAX_BYTES
    height, width = pixels_of(drawn).shape[:2]
    assert (width > height) == (FIGURES[name] == "landscape")
    assert pixels_of(shown).shape[1] == pytest.approx(width, rel=0.05)


@pytest.mark.parametrize("name", FIGURES)
def test_both_prints_are_drawn_in_their_colours(folder: Path, name: str) -> None:
    pixels = pixels_of(folder / name)
    assert share_near(pixels, PROBE_MARK) > 0.001
    assert share_near(pixels, REFERENCE_MARK) > 0.001


def texts_of(path: Path) -> str:
    """Return all words and numbers in an SVG file, wherever its lines are broken."""
    texts = ElementTree.parse(path).getroot().iter(f"{SVG}text")
    return " ".join("".join(text.itertext()) for text in texts if "aria-hidden" not in text.attrib)


def test_the_script_draws_the_figures_of_point_sets_and_nothing_else(point_folder: Path) -> None:
    assert sorted(path.name for path in point_folder.iterdir()) == POINT_FIGURES
    assert [path.name for path in point_folder.parent.iterdir()] == ["points"]
    assert sorted(path.name for path in (SHOWN / "points").iterdir()) == POINT_FIGURES


@pytest.mark.parametrize("name", POINT_FIGURES)
def test_a_figure_of_point_sets_says_what_the_one_that_is_shown_says(
    point_folder: Path, name: str
) -> None:
    drawn, shown = point_folder / name, SHOWN / "points" / name
    assert texts_of(drawn) == texts_of(shown)
    assert ElementTree.parse(drawn).getroot().attrib["width"] == "800"
    assert max(drawn.stat().st_size, shown.stat().st_size) < MAX_BYTES
    if name != "figure_7_flow_chart.svg":  # which shows no set
        assert hexadecimal(PROBE_MARK) in drawn.read_text(encoding="utf-8")
