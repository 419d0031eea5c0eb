"""`fpmatch.evaluation.comparison`: 1:N comparison of all pairs gives what 1:1 gives."""

from __future__ import annotations

import itertools

import numpy as np

from fpmatch.evaluation.comparison import compare_all_pairs
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.minutiae import Minutiae, Template


def made(seed, n):
    rng = np.random.default_rng(seed)
    x, y, angle = rng.uniform(20, 280, n), rng.uniform(20, 280, n), rng.uniform(0, 6, n)
    return Template(Minutiae(x, y, angle), 300, 300)


def test_all_pairs_are_those_of_one_to_one_in_the_protocols_order():
    templates = [made(1, 30), made(2, 25), made(1, 30), made(3, 2), made(4, 40)]
    prints = [MATCHER.prepare(template) for template in templates]
    expected = [MATCHER.compare(p, q).similarity for p, q in itertools.combinations(prints, 2)]
    for workers in (1, 3):
        found = compare_all_pairs(templates, workers=workers)
        assert found.tolist() == expected


def test_fewer_than_two_templates_have_no_pair():
    assert compare_all_pairs([]).size == 0
    assert compare_all_pairs([made(1, 10)]).size == 0
