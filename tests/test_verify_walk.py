"""docs/verify_walk.py: the walk of a verification and the rooms, as drawn from the code."""

import importlib.util
import sys
from functools import partial
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from fpmatch.matching.pipeline._kernels._alignment_kernel import COMPILED

ROOT = Path(__file__).resolve().parent.parent
PRINTS = [ROOT / "sample_data" / f"101_{n}.tif" for n in (1, 3)]
pytestmark = pytest.mark.docs


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
    picture = ET.fromstring(walk.draw_walk(calls))
    assert len(picture.findall("{*}text")) == 2 * len(calls)


def test_every_room_is_below_what_it_imports(walk):
    imports = walk.room_imports()
    assert set(imports) == {p.parent.name for p in walk.PACKAGE.glob("[!_]*/__init__.py")}
    assert imports["matching"]["pointset"] > 0
    assert not imports["image"] & imports["matching"]
    picture = ET.fromstring(walk.draw_rooms(imports))
    numbers = [t.text for t in picture.findall("{*}text") if (t.text or "").isdigit()]
    assert len(numbers) == sum(len(row) for row in imports.values())
