"""The examples run unchanged, and print their results."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from fpmatch.matching._local_kernel import COMPILED

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
UTF8 = os.environ | {"PYTHONUTF8": "1"}


def printed(folder, name, *words):
    """Return what an example prints when it is run in a folder."""
    command = [sys.executable, "-W", "error", str(EXAMPLES / f"{name}.py"), *words]
    done = subprocess.run(
        command, cwd=folder, capture_output=True, encoding="utf-8", env=UTF8, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout


def test_one_finger_matches_another_does_not_and_both_are_drawn(tmp_path):
    text = printed(tmp_path, "verify_and_draw", "pictures")
    assert re.search(r"against 101_3: match\n", text)
    assert re.search(r"rotation of the probe: 3\d° counter-clockwise", text)
    assert re.search(r"against 102_1: no match\n", text)
    assert "  reason: " in text
    assert {p.name for p in (tmp_path / "pictures").iterdir()} == {
        "101_1_on_101_3.png",
        "101_1_on_102_1.png",
    }


def test_an_evaluation_of_synthetic_prints_has_both_matchers(tmp_path):
    text = printed(tmp_path, "evaluate_synthetic", "prints", "2", "2")
    assert "2 genuine pairs, 4 impostor pairs" in text
    assert re.findall(r"^matcher (\S+)$", text, re.MULTILINE) == ["unit-circle", "paper"]
    assert len(re.findall(r"equal error rate +\d+\.\d %", text)) == 2
    assert len(list((tmp_path / "prints").glob("*.tif"))) == 4


def test_the_stars_are_found_and_only_where_they_are(tmp_path):
    text = printed(tmp_path, "match_stars")
    assert "found 32 of them" in text
    assert text.count("is not in the catalogue") == 40 - 32
    assert "in a sky of random points: no match" in text
    assert list(tmp_path.iterdir()) == []


NOTEBOOK = EXAMPLES / "quick_tour.ipynb"
SAMPLES = 'Path("../sample_data")'
FEW = ("101_1.tif", "101_3.tif", "102_1.tif", "103_1.tif", "104_1.tif", "dataset.toml")
"""Prints for kernels that are interpreted, where each takes seconds."""


def test_the_notebook_is_stored_without_outputs():
    cells = json.loads(NOTEBOOK.read_text("utf-8"))["cells"]
    written = [cell for cell in cells if cell["cell_type"] == "code"]
    assert len(written) > 10
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in written)


@pytest.fixture
def ran(tmp_path, monkeypatch):
    """Return the outputs of the notebook's cells, run from the top, and their sources."""
    for name in ("nbformat", "nbclient", "ipykernel", "matplotlib"):
        pytest.importorskip(name, reason=f"{name} is not installed: pip install -e '.[plot,test]'")
    for name in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR", "JUPYTER_CONFIG_DIR", "MPLCONFIGDIR"):
        monkeypatch.setenv(name, str(tmp_path / name))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    text = NOTEBOOK.read_text("utf-8")
    assert json.dumps(SAMPLES)[1:-1] in text
    if not COMPILED:
        for name in FEW:
            shutil.copy(EXAMPLES.parent / "sample_data" / name, tmp_path)
        text = text.replace(json.dumps(SAMPLES)[1:-1], json.dumps(f"Path({str(tmp_path)!r})")[1:-1])
    (tmp_path / "tour.ipynb").write_text(text, "utf-8")
    program = (
        "import nbclient, nbformat, sys; notebook = nbformat.read(sys.argv[1], 4);"
        "nbclient.NotebookClient(notebook, timeout=300).execute(cwd=sys.argv[2]);"
        "nbformat.write(notebook, sys.argv[1])"
    )
    command = [sys.executable, "-c", program, str(tmp_path / "tour.ipynb"), str(EXAMPLES)]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", check=False)
    assert done.returncode == 0, done.stderr
    cells = json.loads((tmp_path / "tour.ipynb").read_text("utf-8"))["cells"]
    return [("".join(c["source"]), c["outputs"]) for c in cells if c["cell_type"] == "code"]


def test_the_notebook_runs_and_shows_results(ran):
    warnings = [one for _, shown in ran for one in shown if one.get("name") == "stderr"]
    assert warnings == [] or not COMPILED
    shown = {
        source.splitlines()[-1]: {**dict.fromkeys(("text/plain",)), **outputs[-1].get("data", {})}
        for source, outputs in ran
        if outputs
    }
    result = "".join(shown["result"]["text/html"])
    assert "<b>MATCH</b>" in result
    assert "data:image/webp" in result
    assert "".join(shown["different.match, different.reason"]["text/plain"]).startswith("(False")
    assert "image/png" in shown["result.overlay(side_by_side=True)"]
    assert "<svg" in "".join(shown["template"]["text/html"])
    assert "<table>" in "".join(shown["template.minutiae"]["text/html"])
    assert "unit-circle" in "".join(shown["report"]["text/plain"])
    assert "image/png" in shown["plt.show()"]
    found = [outputs[0]["text"] for source, outputs in ran if "fpmatch.identify" in source]
    assert "".join(found[0]).startswith("101 score ")


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.stem)
def test_an_example_has_its_test(path):
    assert f'"{path.stem}"' in Path(__file__).read_text(encoding="utf-8")
