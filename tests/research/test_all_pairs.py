import itertools

import numpy as np
import pytest

from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.templates.minutiae import Minutiae, Template
from research.all_pairs import compare_all_pairs, impostors_among
from tests.research.made_sets import extracted_set


def made(seed, n):
    rng = np.random.default_rng(seed)
    x, y, angle = rng.uniform(20, 280, n), rng.uniform(20, 280, n), rng.uniform(0, 6, n)
    return Template(Minutiae(x, y, angle), 300, 300)


def test_all_pairs_are_those_of_one_to_one_in_the_protocols_order():
    templates = [made(1, 30), made(2, 25), made(1, 30), made(3, 2), made(4, 40)]
    prints = [MATCHER.prepare(template) for template in templates]
    expected = [MATCHER.compare(p, q).similarity for p, q in itertools.combinations(prints, 2)]
    for workers in (1, 3):
        assert compare_all_pairs(templates, workers=workers).tolist() == expected
    assert compare_all_pairs([]).size == compare_all_pairs([made(1, 10)]).size == 0


def a_set(name, seed):
    """Return impressions of two fingers, the last without a template."""
    rng, templates = np.random.default_rng(seed), {}
    for finger in (1, 2):
        x, y, angle = rng.uniform(20, 180, (3, 12))
        for number in (1, 2, 3):
            templates[finger, number] = Template(Minutiae(x + number, y, angle), 200, 200)
    return extracted_set({**templates, (2, 3): None}, name)


@pytest.mark.parametrize("workers", [1, 2])
def test_among_all_impressions_are_those_of_other_fingers(workers):
    sets = [a_set("one", 1), a_set("two", 2)]
    shown = [
        (number, impression.finger, template)
        for number, one in enumerate(sets)
        for impression, template in zip(one.impressions, one.templates, strict=True)
        if template is not None
    ]
    similarities = [
        MATCHER.compare(MATCHER.prepare(a), MATCHER.prepare(b)).similarity
        for (*finger, a), (*other, b) in itertools.combinations(shown, 2)
        if finger != other
    ]
    found = impostors_among(sets, "both", workers)
    assert (found.name, found.fingers) == ("both", 4)
    assert found.similarity.tolist() == similarities
    assert not found.genuine.any()
