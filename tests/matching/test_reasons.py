"""`all_reasons`: the reasons of a non-match, each on prints made to have it."""

import numpy as np
import pytest
from hypothesis import given, settings
from matching_prints import (
    COMPILED,
    assert_mirrored,
    jittered,
    moved,
    seeds,
    spread_points,
    template_of,
)
from matching_weights import NEVER, scored_by, some_weights

from fpmatch.matching.matchers.unit_circle import MATCHER


def reason(probe, reference):
    """Return the reason where the threshold is one that few pairs reach."""
    sides = MATCHER.prepare(probe), MATCHER.prepare(reference)
    with scored_by(some_weights()):
        return MATCHER.explain(*sides, MATCHER.compare(*sides)).reason


def parted(rng):
    """Return a print, and one whose halves moved apart, as where a finger rolls."""
    a = spread_points(rng, 24, 25.0, size=360.0)
    left = a[0] < np.median(a[0])
    b = np.where(left, moved(a, 0.3, 40j), moved(a, -0.6, 150 + 90j)).copy()
    return template_of(a), template_of(b, size=500)


def test_a_competing_transform_is_named():
    probe, reference = parted(np.random.default_rng(14))
    found = reason(probe, reference)
    assert "; another, very different transform pairs 1" in found
    assert found.endswith(": the alignment is ambiguous")
    assert "another, very different transform" in reason(reference, probe)
    rng = np.random.default_rng(1)
    points = spread_points(rng, 12, size=200.0)
    worn = template_of(jittered(rng, moved(points, 0.4, 5 + 3j), 2.0, 0.05))
    assert "very different" not in reason(template_of(points), worn)


@pytest.mark.parametrize("side", ["probe", "reference"])
def test_poor_minutiae_are_named_with_their_side(rng, side):
    one, other = spread_points(rng, 20), spread_points(rng, 20)
    pair = [template_of(one, quality=np.full(20, 20)), template_of(other, quality=np.full(20, 80))]
    found = reason(*(pair if side == "probe" else pair[::-1]))
    assert found.endswith(f"; the minutiae of the {side} are poor (mean quality 20)")
    assert found.count("poor") == 1
    of_unknown_quality = reason(template_of(one), template_of(other))
    assert of_unknown_quality
    assert "poor" not in of_unknown_quality


def test_a_comparison_has_the_main_reason_alone():
    probe, reference = map(MATCHER.prepare, parted(np.random.default_rng(14)))
    with scored_by(some_weights()):
        found = MATCHER.compare(probe, reference)
        explained = MATCHER.explain(probe, reference, found)
    assert explained.reason.startswith(found.reason)
    assert explained.reason != found.reason
    assert explained.similarity == found.similarity
    assert explained.transform == found.transform
    assert explained.pairs.tolist() == found.pairs.tolist()


@given(seeds)
@settings(max_examples=15 if COMPILED else 3)
def test_prints_that_the_prefilter_rejects_are_aligned_to_explain_it(seed):
    """Whichever of the two is the probe; the similarity is that of `compare` all the same."""
    rng = np.random.default_rng(seed)
    one, other = (MATCHER.prepare(template_of(spread_points(rng, 30))) for _ in range(2))
    with scored_by(some_weights(NEVER, prefilter=(1e9, 0.0, 1e9))):
        found, back = MATCHER.compare(one, other), MATCHER.compare(other, one)
        explained = MATCHER.explain(one, other, found)
        turned = MATCHER.explain(other, one, back)
    with scored_by(some_weights(NEVER)):
        aligned = MATCHER.compare(one, other)
    assert found.transform is None
    assert "too little in common" in found.reason
    assert (back.similarity, back.reason) == (found.similarity, found.reason)
    if aligned.transform is None:
        assert explained.reason == found.reason
        return
    assert explained.pairs.tolist() == aligned.pairs.tolist()
    assert explained.transform.matrix == pytest.approx(aligned.transform.matrix, abs=1e-9)
    assert explained.similarity == found.similarity
    assert "pairs among" in explained.reason
    assert turned.reason == explained.reason
    assert_mirrored(explained, turned)
