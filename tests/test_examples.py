"""The examples run unchanged, and print their results."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

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


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.stem)
def test_an_example_has_its_test(path):
    assert f'"{path.stem}"' in Path(__file__).read_text(encoding="utf-8")
