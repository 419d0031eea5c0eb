"""The benchmark of minutiae by place: what it prints, and what becomes of bad input."""

import json
import shutil
from pathlib import Path

import minutiae_places
from click.testing import CliRunner

from fpmatch.cli.group import fpmatch
from research.experiments.minutiae_places import PLACES

ROOT = Path(__file__).parents[1]


def run(*words):
    return CliRunner().invoke(minutiae_places.main, [*map(str, words), "--workers", "1"])


def test_own_minutiae_are_all_found_and_a_missing_file_is_an_error(tmp_path):
    images, minutiae = tmp_path / "images", tmp_path / "minutiae"
    images.mkdir()
    for name in ("101_1", "101_2"):
        shutil.copy(ROOT / "sample_data" / f"{name}.tif", images)
    extract = ("extract", *images.iterdir(), "-o", minutiae, "--format", "minutiae-csv")
    assert CliRunner().invoke(fpmatch, [*map(str, extract)]).exit_code == 0
    figures = tmp_path / "places.json"
    completed = run("--against", images, minutiae, "itself", "--json", figures)
    assert completed.exit_code == 0, completed.stderr
    (row,) = json.loads(figures.read_text())["rows"].values()
    assert list(row) == list(PLACES)
    for counts in row.values():
        assert counts["known"] == counts["found"] == counts["extracted"] == counts["right"]
    (minutiae / "101_2.csv").unlink()
    refused = run("--against", images, minutiae, "itself")
    assert (refused.exit_code, refused.stdout) == (2, "")
    assert "101_2.csv" in refused.stderr
    assert refused.stderr.count("\n") == 1
