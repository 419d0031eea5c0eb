"""Figures of the documentation are small and as the commands draw them; so is the walk."""

import importlib.util
import sys
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from fpmatch.drawing.scene.palette import PROBE_MARK, REFERENCE_MARK
from fpmatch.matching.pipeline._kernels._alignment_kernel import COMPILED
from research.commands import research

ROOT = Path(__file__).resolve().parent.parent
SHOWN = ROOT / "docs" / "figures"
PRINTS = [ROOT / "sample_data" / f"101_{n}.tif" for n in (1, 3)]
MAX_BYTES = 400_000
SVG = "{http://www.w3.org/2000/svg}"
pytestmark = pytest.mark.docs


def drawn(target, only):
    done = CliRunner().invoke(research, ["figures", "--out", str(target), "--only", only])
    assert done.exit_code == 0, done.output
    return sorted(path for path in target.rglob("*") if path.is_file())


def test_prints_are_drawn_in_their_colours(tmp_path):
    files = drawn(tmp_path, "prints")
    names = ["how_it_works.png", "overlay.png", "ridges.png"]
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
    files = drawn(tmp_path, "points")
    shown = sorted((SHOWN / "points").iterdir())
    assert [path.relative_to(tmp_path) for path in files] == [p.relative_to(SHOWN) for p in shown]
    for path, other in zip(files, shown, strict=True):
        assert texts_of(path) == texts_of(other)
        assert max(path.stat().st_size, other.stat().st_size) < MAX_BYTES


@pytest.fixture(scope="module")
def walk():
    path = ROOT / "docs" / "verify_walk.py"
    spec = importlib.util.spec_from_file_location("verify_walk", path)
    module = sys.modules["verify_walk"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.skipif(not COMPILED, reason="every call of an interpreted kernel would be traced")
def test_the_walk_goes_from_reading_to_the_overlay(walk, tmp_path):
    calls = walk.trace(partial(walk.verify_files, *PRINTS, tmp_path / "overlay.png"))
    first = [call.name for call in calls if call.depth == 0]
    assert first == ["read_image", "extract", "verify", "save_overlay"]
    names = [call.name for call in calls if call.depth == 1]
    assert names.index("normalize") < names.index("binarize") < names.index("thin")
    assert {call.room for call in calls} >= {"image", "matching", "drawing"}
    assert any(call.kernels for call in calls)
    assert sys.getprofile() is None
    picture = ElementTree.fromstring(walk.draw_walk(calls))
    assert len(picture.findall("{*}text")) == 2 * len(calls)


def test_every_room_is_below_what_it_imports(walk):
    imports = walk.room_imports()
    assert set(imports) == {p.parent.name for p in walk.PACKAGE.glob("[!_]*/__init__.py")}
    assert imports["matching"]["pointset"] > 0
    assert set(imports["image"] & imports["matching"]) <= {"base", "templates"}
    picture = ElementTree.fromstring(walk.draw_rooms(imports))
    numbers = [t.text for t in picture.findall("{*}text") if (t.text or "").isdigit()]
    assert len(numbers) == sum(len(row) for row in imports.values())
