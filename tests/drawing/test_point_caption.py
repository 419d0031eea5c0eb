from __future__ import annotations

import math

import numpy as np
import pytest

from fpmatch.drawing.plots.point_caption import match_facts
from fpmatch.pointset.point_match import PointMatch
from fpmatch.pointset.similarity import Similarity


def a_match(transform: Similarity | None, chance: float | None = None) -> PointMatch:
    pairs = np.column_stack([np.arange(1234)] * 2).astype(np.int32)
    return PointMatch(transform, pairs, 0.9996, 0.01234567, 3, chance)


def test_the_facts_of_a_match() -> None:
    match = a_match(Similarity(1.2345678, math.radians(-30), 12.3456789, -4.5), chance=3.21e-41)
    assert match_facts(match) == [
        ("Pairs", "1,234, 100.0% of the smaller set"),
        ("Transform", "scale 1.23457, rotation 30.000° from y to x, shift +12.3457, -4.5"),
        ("Residual", "0.01235 rms"),
        ("Chance", "3.2e-41 matches as good expected between independent sets"),
    ]


@pytest.mark.parametrize(
    ("transform", "words"),
    [
        (Similarity(), "scale 1, rotation 0.000°, shift +0, +0"),
        (Similarity(1, -1e-9, -1e-15, 1e-15), "scale 1, rotation 0.000°, shift +0, +0"),
        (Similarity(2, math.pi), "scale 2, rotation 180.000° from x to y, shift +0, +0"),
        (Similarity(1e-9, 0, 1e12), "scale 1e-09, rotation 0.000°, shift +1e+12, +0"),
    ],
)
def test_a_transform_in_words(transform: Similarity, words: str) -> None:
    assert dict(match_facts(a_match(transform)))["Transform"] == words


def test_facts_that_are_not_known_are_left_out() -> None:
    assert match_facts(PointMatch.none()) == []
    assert "Chance" not in dict(match_facts(a_match(Similarity())))
    vanishing = dict(match_facts(a_match(Similarity(), chance=0.0)))["Chance"]
    assert vanishing.startswith("less than 1e-300 matches")
