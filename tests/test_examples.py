"""The examples run unchanged, and print their results."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from fpmatch.matching.constants import COMPILED
from research.notebook import shown

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
UTF8 = os.environ | {"PYTHONUTF8": "1"}
pytestmark = pytest.mark.docs


def printed(folder, name, *words):
    command = [sys.executable, "-W", "error", str(EXAMPLES / f"{name}.py"), *words]
    done = subprocess.run(
        command, cwd=folder, capture_output=True, encoding="utf-8", env=UTF8, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout


def test_one_finger_matches_another_does_not_and_both_are_drawn(tmp_path):
    text = printed(tmp_path, "verify_and_draw", "pictures")
    assert re.findall(r"against (\w+): (no )?match\n", text) == [("101_3", ""), ("102_1", "no ")]
    assert re.search(r"rotation of the probe: 3\d°", text)
    pictures = {path.name for path in (tmp_path / "pictures").iterdir()}
    assert pictures == {"101_1_on_101_3.png", "101_1_on_102_1.png"}


def test_an_evaluation_of_synthetic_prints_has_both_matchers(tmp_path):
    text = printed(tmp_path, "evaluate_synthetic", "prints", "2", "2")
    assert "2 genuine pairs, 4 impostor pairs" in text
    assert re.findall(r"^matcher (\S+)$", text, re.MULTILINE) == ["unit-circle", "paper"]
    assert len(re.findall(r"rate +\d+\.\d %", text)) == 2
    assert len(list((tmp_path / "prints").glob("*.tif"))) == 4


def test_the_stars_are_found_and_only_where_they_are(tmp_path):
    text = printed(tmp_path, "match_stars")
    assert "found 32 of them" in text
    assert "random points: no match" in text


NOTEBOOK = EXAMPLES / "quick_tour.ipynb"


@pytest.fixture
def ran(tmp_path, monkeypatch):
    for name in ("nbformat", "nbclient", "ipykernel", "matplotlib"):
        pytest.importorskip(name, reason=f"{name} is not installed: pip install -e '.[plot,test]'")
    for name in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR", "JUPYTER_CONFIG_DIR", "MPLCONFIGDIR"):
        monkeypatch.setenv(name, str(tmp_path / name))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    if not COMPILED:
        pytest.skip("the notebook compares many prints: minutes with interpreted kernels")
    program = (
        "import sys; sys.path.append(sys.argv[1]); from research.notebook import executed;"
        "sys.stdout.write(executed(sys.stdin.read()))"
    )
    command = [sys.executable, "-c", program, str(EXAMPLES.parent)]
    done = subprocess.run(
        command,
        input=NOTEBOOK.read_text("utf-8"),
        capture_output=True,
        encoding="utf-8",
        env=UTF8,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_notebook_runs_and_shows_what_is_stored(ran):
    """If not, `python -m research notebook` stores it."""
    now, stored = shown(ran), shown(NOTEBOOK.read_text("utf-8"))
    by_last_line = {source.splitlines()[-1]: dict(outputs) for source, outputs in now}
    assert "<b>MATCH</b>" in by_last_line["result"]["text/html"]
    assert "image/png" in by_last_line["plt.show()"]
    assert now == stored
