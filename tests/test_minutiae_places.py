"""The benchmark of minutiae by place: what it prints, and what becomes of bad input."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

from research.experiments.minutiae_places import PLACES

ROOT = Path(__file__).parents[1]


def run(*words: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, ROOT / "benchmarks" / "minutiae_places.py", *words, "--workers", 1]
    return subprocess.run([*map(str, command)], capture_output=True, text=True, check=False)


def test_own_minutiae_are_all_found_and_a_missing_file_is_an_error(tmp_path: Path) -> None:
    images, minutiae = tmp_path / "images", tmp_path / "minutiae"
    images.mkdir()
    for name in ("101_1", "101_2"):
        shutil.copy(ROOT / "sample_data" / f"{name}.tif", images)
    extract = ("extract", *images.iterdir(), "-o", minutiae, "--format", "minutiae-csv")
    subprocess.run(
        [sys.executable, "-m", "fpmatch", *map(str, extract)], capture_output=True, check=True
    )
    figures = tmp_path / "places.json"
    completed = run("--against", images, minutiae, "itself", "--json", figures)
    assert completed.returncode == 0, completed.stderr
    (row,) = json.loads(figures.read_text())["rows"].values()
    assert list(row) == list(PLACES)
    for counts in row.values():
        assert counts["known"] == counts["found"] == counts["extracted"] == counts["right"]
    (minutiae / "101_2.csv").unlink()
    refused = run("--against", images, minutiae, "itself")
    assert (refused.returncode, refused.stdout) == (2, "")
    assert "101_2.csv" in refused.stderr
    assert refused.stderr.count("\n") == 1
