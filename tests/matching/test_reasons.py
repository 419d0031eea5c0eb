"""`pipeline.reasons`: the reasons of a non-match, each on prints made to have it."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from matching_prints import (
    COMPILED,
    alignments,
    assert_mirrored,
    jittered,
    moved,
    plane,
    seeds,
    spread_points,
    template_of,
)
from matching_weights import NEVER, scored_by, some_weights

from fpmatch import verify
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.pipeline.parameters import USUAL
from fpmatch.matching.reference import competing_pairs
from fpmatch.matching.reference.neighbourhood import local_similarity


def reason(probe, reference):
    """Return the reason where the threshold is one that few pairs reach."""
    return verify(probe, reference, threshold=100.0).evidence.reason


def doubled(rng):
    """Return a print, and one that holds it twice, turned and a little wrong."""
    points = spread_points(rng, 12, size=130.0)
    there = jittered(rng, moved(points, 1.0, 260 + 10j), 0.5, 0.02)
    both = np.ascontiguousarray(np.hstack([jittered(rng, points, 0.5, 0.02), there]))
    return template_of(points), template_of(both, size=500)


def test_a_competing_transform_is_named(rng):
    probe, reference = doubled(rng)
    found = reason(probe, reference)
    assert "; another, very different transform pairs 1" in found
    assert found.endswith(": the alignment is ambiguous")
    assert "another, very different transform" in reason(reference, probe)
    points = spread_points(rng, 12, size=200.0)
    worn = template_of(jittered(rng, moved(points, 0.4, 5 + 3j), 2.0, 0.05))
    assert "very different" not in reason(template_of(points), worn)


def competing_twin(a, alignment, others, apart_px):
    """Return the pairs of the best transform that maps the minutiae elsewhere, one by one."""
    most, z = 0, plane(a.points)
    for other in others:
        here, there = (one.move[0] * z + one.move[1] for one in (alignment, other))
        if np.mean(abs(here - there)) > apart_px:
            most = max(most, np.count_nonzero(other.partner >= 0))
    return most


@given(seeds)
@settings(max_examples=6)
def test_competing_pairs_agree_with_their_twin(seed):
    """Of the hypotheses of all local matches, and of those that are not among the pairs."""
    a, b = map(MATCHER.prepare, doubled(np.random.default_rng(seed)))
    similarity = local_similarity(a.neighbourhoods, b.neighbourhoods)
    found = alignments(a.points, b.points, similarity)
    for alignment in found:
        masked = similarity.copy()
        i = np.flatnonzero(alignment.partner >= 0)
        masked[i, alignment.partner[i]] = 0.0
        others = found + alignments(a.points, b.points, masked)
        for apart_px in (0.5, 30.0, 1e4):
            expected = competing_twin(a, alignment, others, apart_px)
            assert competing_pairs(a, b, alignment, USUAL, apart_px) == expected
        assert expected == 0
    # of a doubled print both places compete, although every minutia is in one local match alone
    best = max(found, key=lambda one: np.count_nonzero(one.partner >= 0))
    assert 9 <= competing_pairs(a, b, best) <= np.count_nonzero(best.partner >= 0)


@pytest.mark.parametrize("seed", range(10 if COMPILED else 4))
def test_prints_whose_local_matches_are_weak_are_explained(seed):
    """Even where the one hypothesis that a comparison then tries pairs nothing."""
    rng = np.random.default_rng(seed)
    pair = [MATCHER.prepare(template_of(spread_points(rng, 20))) for _ in range(2)]
    with scored_by(some_weights(relaxation=math.inf)):
        found = MATCHER.compare(*pair)
        explained = MATCHER.explain(*pair, found)
    assert explained.similarity == found.similarity
    assert explained.transform is not None
    assert "pairs among" in explained.reason
    if found.transform is None:
        assert found.reason == "no minutiae of the two prints can be paired"
        assert found.similarity == 0.0
    else:
        assert explained.pairs.tolist() == found.pairs.tolist()


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


def test_a_comparison_has_the_main_reason_alone(rng):
    probe, reference = map(MATCHER.prepare, doubled(rng))
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
