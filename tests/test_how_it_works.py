"""The tables of how_it_works: boxes of the paper's Fig. 7, and steps of the default matcher."""

import importlib
import re
from pathlib import Path

import pytest

from fpmatch.matching import reference

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "fpmatch"
PAGE = (ROOT / "docs" / "explanation" / "how_it_works.md").read_text(encoding="utf-8")
BOXES = re.findall(r"^\| (.+) \| (.+) \| (`\w+/\w+\.py`.*) \|$", PAGE, re.MULTILINE)
STEP = r"^\| ([^|]+) \|[^|]*\| ?([^|]*?) ?\| `(\w+)\.py`: `(\w+)` \| `(\S+)` \|$"
STEPS = re.findall(STEP, PAGE, re.MULTILINE)


@pytest.mark.parametrize(("box", "functions", "files"), BOXES)
def test_each_box_of_the_flow_chart_names_its_functions(box, functions, files):
    names, paths = (re.findall(r"`([^`]+)`", cell) for cell in (functions, files))
    modules = [
        importlib.import_module(f"fpmatch.pointset.{path.removesuffix('.py').replace('/', '.')}")
        for path in paths
    ]
    assert names, box
    assert all(any(callable(getattr(one, name, None)) for one in modules) for name in names)


def test_all_boxes_of_the_flow_chart_are_there():
    """As section 3.3 of the paper has them, but for the two results."""
    words = ("triangulation", "unit circle", "next combination", "interior points", "as many edges")
    words += ("areas", "transformation factor", "global matching", "above ρ")
    boxes = " ".join(box for box, _, _ in BOXES)
    assert [word for word in words if word not in boxes] == []


@pytest.mark.parametrize(("step", "box", "file", "function", "kernel"), STEPS)
def test_each_step_names_its_box_its_function_and_its_kernel(step, box, file, function, kernel):
    assert any(box.split(",")[0] in one for one, _, _ in BOXES), step
    module = importlib.import_module(f"{reference.__name__}.{file}".removesuffix(".__init__"))
    assert callable(getattr(module, function)), step
    assert (PACKAGE / kernel).is_file()


def test_no_module_of_the_reference_and_no_kernel_of_the_pipeline_is_left_out():
    modules = {path.stem for path in (PACKAGE / "matching" / "reference").glob("*.py")}
    assert {file for _, _, file, _, _ in STEPS} == modules
    kernels = {path.name for path in PACKAGE.glob("matching/pipeline/**/_*_kernel.py*")}
    kernels = {name for name in kernels if name.endswith((".py", ".pyx"))}
    assert {Path(kernel).name for *_, kernel in STEPS} >= kernels
