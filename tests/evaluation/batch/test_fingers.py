"""Scores of fingers from scores of pairs."""

from __future__ import annotations

import csv
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import ScoringError
from fpmatch.evaluation.batch.fingers import (
    FINGER_COLUMNS,
    MAX_CELLS,
    check_fingers,
    finger_of_name,
    write_fingers,
)
from fpmatch.matching.finger import fused_score

PROBES = ["p1.png", "p2.png"]
REFERENCES = ["7_1.png", "7_2.png", "8_1.png"]
FINGERS = ["7", "7", "8"]


def written(folder: Path, scores: list[tuple[str, str, str]], **more: bool) -> list[list[str]]:
    source, target = folder / "scores.csv", folder / "fingers.csv"
    lines = [f"{probe},{reference},1.5,{score},\n" for probe, reference, score in scores]
    source.write_text("probe,reference,similarity,score,reason\n" + "".join(lines))
    count = write_fingers(source, target, PROBES, REFERENCES, FINGERS, **more)
    with target.open(newline="") as stream:
        head, *rows = csv.reader(stream)
    assert tuple(head) == FINGER_COLUMNS
    assert count == len(rows)
    return rows


def test_a_finger_has_the_fused_score_of_its_impressions(tmp_path: Path) -> None:
    rows = written(
        tmp_path,
        [
            ("p1.png", "7_1.png", "40.0"),
            ("p1.png", "7_2.png", "10.0"),
            ("p2.png", "8_1.png", "12.5"),
        ],
    )
    assert [row[:4] for row in rows] == [["p1.png", "7", "2", "40.0"], ["p2.png", "8", "1", "12.5"]]
    assert float(rows[0][4]) == pytest.approx(fused_score([40.0, 10.0]))
    assert float(rows[1][4]) == pytest.approx(12.5)


def test_pairs_without_a_score_do_not_count(tmp_path: Path) -> None:
    rows = written(tmp_path, [("p1.png", "7_1.png", ""), ("p1.png", "7_2.png", "30.0")])
    assert rows[0][:4] == ["p1.png", "7", "1", "30.0"]
    assert written(tmp_path, [("p1.png", "7_1.png", "")]) == []


def test_a_print_is_not_compared_with_itself(tmp_path: Path) -> None:
    source, target = tmp_path / "scores.csv", tmp_path / "fingers.csv"
    names = ["7_1.png", "7_2.png"]
    lines = [f"{p},{r},1,{100 if p == r else 35},\n" for p in names for r in names]
    source.write_text("probe,reference,similarity,score,reason\n" + "".join(lines))
    assert write_fingers(source, target, names, names, ["7", "7"], same=True) == 2
    assert target.read_text().splitlines()[1:] == ["7_1.png,7,1,35.0,35.0", "7_2.png,7,1,35.0,35.0"]


@given(st.lists(st.floats(0, 100), min_size=1, max_size=70))
def test_the_score_is_that_of_the_harmonic_mean(scores: list[float]) -> None:
    names = [f"{k}_1" for k in range(len(scores))]
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "scores.csv"), Path(folder, "fingers.csv")
        lines = [f"p,{name},1,{score!r},\n" for name, score in zip(names, scores, strict=True)]
        source.write_text("probe,reference,similarity,score,reason\n" + "".join(lines))
        write_fingers(source, target, ["p"], names, ["one"] * len(names))
        found = float(target.read_text().splitlines()[1].split(",")[4])
    assert found == pytest.approx(fused_score(scores), abs=1e-6)
    assert found <= np.max(scores) + 1e-6


@pytest.mark.parametrize(
    ("name", "finger"), [("101_3.tif", "101"), ("a_1.png", "a_1"), ("thumb.png", "thumb")]
)
def test_the_name_of_a_file_tells_the_finger(name: str, finger: str) -> None:
    assert finger_of_name(name) == finger


def test_more_than_fits_into_memory_is_refused() -> None:
    check_fingers(1000, ["1", "1", "2"])
    with pytest.raises(ScoringError, match=f"more than {MAX_CELLS:,}"):
        check_fingers(MAX_CELLS, ["1", "2"])
