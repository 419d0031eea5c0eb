"""The sample points: the script still makes them, and their match is the truth they came from."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from fpmatch.formats.points_csv import load_points
from fpmatch.pointset.match import match_points
from fpmatch.pointset.similarity import Similarity

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "sample_data"
FILES = ("stars.csv", "catalogue.csv", "points_truth.json")


def test_the_command_makes_the_points_that_are_here(tmp_path: Path, run_research) -> None:
    assert run_research("sample-data", tmp_path, "--only", "points").exit_code == 0
    for name in FILES:
        assert (tmp_path / name).read_text() == (FOLDER / name).read_text()


def test_the_match_is_the_truth() -> None:
    p, q = (load_points(FOLDER / name) for name in FILES[:2])
    truth = json.loads((FOLDER / "points_truth.json").read_text())
    match = match_points(p, q)
    assert match.pairs.tolist() == truth["pairs"]
    assert match.transform is not None
    apart = match.transform.apply(p) - Similarity(**truth["transform"]).apply(p)
    assert np.hypot(*apart.T).max() < truth["jitter"]
