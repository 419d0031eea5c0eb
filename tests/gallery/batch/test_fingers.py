"""Scores of fingers from scores of pairs."""

import csv
import tempfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.gallery.batch.fingers import (
    FINGER_COLUMNS,
    finger_of_name,
    write_fingers,
)
from fpmatch.gallery.fingers.finger import fused_score

REFERENCES = ["7_1.png", "7_2.png", "8_1.png"]


def written(scores, probes=("p1.png", "p2.png"), references=REFERENCES, fingers="778", **more):
    """Return the rows of fingers of some pairs with their scores."""
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "scores.csv"), Path(folder, "fingers.csv")
        lines = [f"{probe},{reference},1.5,{score},\n" for probe, reference, score in scores]
        source.write_text("probe,reference,similarity,score,reason\n" + "".join(lines))
        count = write_fingers(source, target, probes, references, fingers, **more)
        head, *rows = csv.reader(target.read_text().splitlines())
    assert tuple(head) == FINGER_COLUMNS
    assert count == len(rows)
    return rows


def test_a_finger_has_the_fused_score_of_its_impressions_that_have_one():
    scores = [("p1.png", "7_1.png", "40.0"), ("p1.png", "7_2.png", "10.0")]
    rows = written([*scores, ("p2.png", "8_1.png", "12.5"), ("p2.png", "7_1.png", "")])
    assert [row[:4] for row in rows] == [["p1.png", "7", "2", "40.0"], ["p2.png", "8", "1", "12.5"]]
    assert float(rows[0][4]) == pytest.approx(fused_score([40.0, 10.0]))
    assert float(rows[1][4]) == pytest.approx(12.5)


def test_a_print_is_not_compared_with_itself():
    names = REFERENCES[:2]
    pairs = [(p, r, 100 if p == r else 35) for p in names for r in names]
    assert written(pairs, names, names, "77", same=True) == [
        [name, "7", "1", "35.0", "35.0"] for name in names
    ]


@given(st.lists(st.floats(0, 100), min_size=1, max_size=70))
def test_the_score_is_that_of_the_harmonic_mean(scores):
    names = [f"{k}_1" for k in range(len(scores))]
    pairs = [("p", name, repr(score)) for name, score in zip(names, scores, strict=True)]
    ((*_, found),) = written(pairs, ["p"], names, ["one"] * len(names))
    assert float(found) == pytest.approx(fused_score(scores), abs=1e-6)
    assert float(found) <= max(scores) + 1e-6


@pytest.mark.parametrize(
    ("name", "finger"), [("101_3.tif", "101"), ("a_1.png", "a_1"), ("left thumb.png", "left thumb")]
)
def test_the_name_of_a_file_tells_the_finger(name, finger):
    assert finger_of_name(name) == finger
