import math

import numpy as np
import pytest

from fpmatch.lab.plots.words import (
    degrees,
    match_facts,
    number,
    positive_degrees,
    significant,
)
from fpmatch.pointset.geometry.affine_transform import AffineTransform
from fpmatch.pointset.geometry.point_match import PointMatch
from fpmatch.pointset.geometry.similarity import Similarity


def test_numbers_and_angles():
    assert (number(-0.25, 2), number(-0.0001)) == ("−0.25", "0.000")
    assert [significant(x) for x in (0.57, 123.4, 1e9)] == ["0.570", "123", "1.00e+09"]
    assert (degrees(-math.pi / 3), degrees(-1e-4)) == ("−60.0°", "0.0°")
    assert (positive_degrees(-math.pi / 3), positive_degrees(-1e-4)) == ("300.0°", "0.0°")


def a_match(transform, chance=None):
    pairs = np.column_stack([np.arange(1234)] * 2).astype(np.int32)
    return PointMatch(transform, pairs, 0.9996, 0.01234567, 3, chance)


def test_the_facts_of_a_match():
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
        (Similarity(1, -1e-9, -1e-15, 1e-15), "scale 1, rotation 0.000°, shift +0, +0"),
        (Similarity(2, math.pi), "scale 2, rotation 180.000° from x to y, shift +0, +0"),
        (Similarity(1e-9, 0, 1e12), "scale 1e-09, rotation 0.000°, shift +1e+12, +0"),
    ],
)
def test_a_transform_in_words(transform, words):
    assert dict(match_facts(a_match(transform)))["Transform"] == words


def test_an_affine_map_in_words():
    move = AffineTransform.of_parts(2.0, 1.5, -0.25, math.pi / 6, 3.0, -4.0, mirrored=True)
    facts = dict(match_facts(a_match(move)))
    assert list(facts) == ["Pairs", "Stretch", "Transform", "Residual"]
    assert facts["Stretch"] == "mirrored (y to -y), scale 2 along x and 1.5 along y, shear -0.25"
    assert facts["Transform"] == "rotation 30.000° from x to y, shift +3, -4"
    alike = AffineTransform.of_parts(2.0, 2.0, mirrored=True)
    words = "mirrored (y to -y), scale 2, rotation 0.000°, shift +0, +0"
    assert dict(match_facts(a_match(alike)))["Transform"] == words


def test_facts_that_are_not_known_are_left_out():
    assert match_facts(PointMatch.none()) == []
    assert "Chance" not in dict(match_facts(a_match(Similarity())))
    vanishing = dict(match_facts(a_match(Similarity(), chance=0.0)))["Chance"]
    assert vanishing.startswith("less than 1e-300 matches")
