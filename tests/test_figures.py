"""The figures of the documentation are those that the command draws, and small."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from fpmatch.drawing.scene.palette import PROBE_MARK, REFERENCE_MARK
from research.commands import research

SHOWN = Path(__file__).resolve().parent.parent / "docs" / "figures"
MAX_BYTES = 400_000
SVG = "{http://www.w3.org/2000/svg}"
pytestmark = pytest.mark.docs


def drawn(target, only):
    """Draw figures of one kind into a folder; return the files."""
    done = CliRunner().invoke(research, ["figures", "--out", str(target), "--only", only])
    assert done.exit_code == 0, done.output
    return sorted(path for path in target.rglob("*") if path.is_file())


def test_prints_are_drawn_in_their_colours(tmp_path):
    files = drawn(tmp_path, "prints")
    names = ["how_it_works.png", "overlay.png", "ridges.png", "warped.png"]
    assert [path.name for path in files] == names
    for path in files:
        shown = SHOWN / path.name
        assert max(path.stat().st_size, shown.stat().st_size) < MAX_BYTES
        with Image.open(path) as image, Image.open(shown) as other:
            pixels = np.asarray(image.convert("RGB")).astype(int)
            assert other.width == pytest.approx(image.width, rel=0.05)
        for colour in () if path.stem == "ridges" else (PROBE_MARK, REFERENCE_MARK):
            assert (np.abs(pixels - colour).max(axis=2) < 25).mean() > 0.001


def texts_of(path):
    texts = ElementTree.parse(path).getroot().iter(f"{SVG}text")
    return " ".join("".join(text.itertext()) for text in texts)


def test_the_figures_of_point_sets_have_the_texts_of_those_shown(tmp_path):
    pytest.importorskip("matplotlib")
    files = drawn(tmp_path, "points")
    shown = sorted((SHOWN / "points").iterdir())
    assert [path.relative_to(tmp_path) for path in files] == [p.relative_to(SHOWN) for p in shown]
    for path, other in zip(files, shown, strict=True):
        assert texts_of(path) == texts_of(other)
        assert max(path.stat().st_size, other.stat().st_size) < MAX_BYTES
