"""Prints that hardly are any: each comparison of them has an answer or a reason."""

import math
from dataclasses import replace

import numpy as np
import pytest
from matching_prints import (
    COMPILED,
    assert_mirrored,
    even_field,
    spread_points,
    striped_field,
    template_of,
)
from matching_weights import scored_by, some_weights

from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.prints.prepared_prints import PreparedPrints

FIELDS = (None, even_field(side=20), striped_field(side=20 if COMPILED else 8))
USUAL = template_of(spread_points(np.random.default_rng(4), 15, 20.0))


def degenerate_prints():
    """Return prints that hardly are any, each with a name."""
    rng = np.random.default_rng(8)
    many = 2000 if COMPILED else 30
    usual = spread_points(rng, 12)

    def flat(points):
        """Return the same minutiae, of which all directions are 0."""
        return np.vstack([points[:2], np.ones(points.shape[1]), np.zeros(points.shape[1])])

    made = {f"{n} minutiae": usual[:, :n] for n in range(5)}
    made["directions 0"] = flat(usual)
    made["4 of directions 0"] = flat(usual[:, :4])
    for n in (3, 4, 12):
        along, across, directions = 20.0 * np.arange(1, n + 1), np.full(n, -100.0), usual[2:, :n]
        made[f"{n} on a row"] = np.vstack([along, across, directions])
        made[f"{n} on a slanted line"] = np.vstack([along, -along, directions])
        made[f"{n} on a row, directions 0"] = flat(made[f"{n} on a row"])
        made[f"{n} on a column"] = np.vstack([-across, -along, directions])
        made[f"{n} on one spot"] = np.vstack([np.full(n, 90.0), np.full(n, -70.0), directions])
        made[f"{n} times the same"] = np.repeat(usual[:, :1], n, axis=1)
    made["pairs that coincide"] = np.repeat(usual[:, :6], 2, axis=1)
    angle = np.arange(12) * np.pi / 6
    circle = 150 + 90 * np.cos(angle), -150 + 90 * np.sin(angle)
    made["on a circle"] = np.vstack([*circle, np.cos(angle), np.sin(angle)])
    row, column = np.divmod(np.arange(25), 5)
    made["on a grid, directions 0"] = flat(np.array([60.0 + 40 * column, -60.0 - 40 * row]))
    made[f"{many} minutiae"] = spread_points(rng, many, 0.0, 1500.0)
    made[f"{many} minutiae, directions 0"] = flat(made[f"{many} minutiae"])
    made[f"{many} on one spot"] = np.repeat(usual[:, :1], many, axis=1)
    made["far outside the image"] = usual + np.array([[1e6], [1e6], [0], [0]])
    return {name: template_of(np.ascontiguousarray(points)) for name, points in made.items()}


DEGENERATE = degenerate_prints()


@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize("name", DEGENERATE)
def test_any_degenerate_print_has_an_answer_or_a_reason(name, field):
    """Against each other one and itself, one by one and of many, both ways."""
    one = MATCHER.prepare(replace(DEGENERATE[name], field=field))
    every = 1 if COMPILED else 11
    others = [MATCHER.prepare(other) for other in [*DEGENERATE.values()][::every]]
    others += [one, MATCHER.prepare(replace(USUAL, field=field))]
    found = []
    with scored_by(some_weights()):
        for other in others:
            forth, back = MATCHER.compare(one, other), MATCHER.compare(other, one)
            assert_mirrored(forth, back)
            explained = MATCHER.explain(one, other, MATCHER.compare(one, other))
            assert explained.similarity == forth.similarity
            for result in (forth, explained):
                assert 0 <= result.similarity < math.inf
                assert (result.transform is None) == (len(result.pairs) == 0)
                assert result.transform is None or np.isfinite(result.transform.matrix).all()
                assert math.isfinite(result.rms_px)
                assert 0 <= result.agreement <= 1
                assert 0 <= result.overlap <= 1
                assert result.reason
            found.append(forth.similarity)
        assert MATCHER.similarities(one, PreparedPrints.pack(others)).tolist() == found
    if len(one) == 0:
        assert not any(found)
    elif len(one) >= 3:
        assert found[-2] > 0
