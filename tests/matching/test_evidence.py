"""Evidence of an alignment: the kernel against the reference, and known alignments."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from matching_prints import (
    COMPILED,
    alignments,
    even_field,
    seeds,
    spread_points,
    template_of,
    templates,
)
from matching_weights import all_with, scored_by, some_weights
from score_cases import ENTRIES, SHOWN, entries_of, overlay, some_case, with_itself

from fpmatch.matching.pipeline.match import evidence_scorer
from fpmatch.matching.prints.prepare import prepare
from fpmatch.matching.reference.alignment import Pairing
from fpmatch.matching.reference.evidence import weigh
from fpmatch.matching.reference.neighbourhood import local_similarity
from fpmatch.matching.reference.relaxation import relax

FEW = 20 if COMPILED else 6
FRAME = 8  # frame points of the mesh


@given(seeds, st.floats(-20, 20), st.floats(-4, 4))
def test_evidence_and_score_agree_with_the_reference(seed, bias, level):
    a, b, partner, transform = some_case(seed)
    assume(len(a))
    weights = some_weights(bias=bias, apart=5.0)
    quantiles = weights.models[0].quantiles + np.array([[level], [1.5 * level]])
    weights = all_with(weights, quantiles=quantiles)
    found = overlay(a, b, partner, transform, weights)
    move = complex(*transform[:2]), complex(*transform[2:])
    pairing = Pairing(a.points, b.points, partner, (partner >= 0).astype(float), move)
    candidates = relax(a.points, b.points, local_similarity(a.neighbourhoods, b.neighbourhoods))
    with scored_by(weights):
        _, expected = weigh(a, b, candidates, pairing)
    for name in (*ENTRIES, "total", "minus_log_fmr"):
        value = pytest.approx(getattr(expected, name), rel=1e-6, abs=1e-5)
        assert getattr(found, name) == value, name
    assert found.features == pytest.approx(expected.features, abs=1e-5)
    assert found.similarity == pytest.approx(np.logaddexp(0.0, found.minus_log_fmr), rel=1e-9)


def test_the_cases_that_are_drawn_are_of_every_kind():
    """Otherwise the agreement with the reference would show little."""
    found = [overlay(*some_case(seed)) for seed in range(40)]
    kinds = [
        (
            *(one.cells > 0, one.cells == 0, one.unpaired > 0),
            *(0 < one.overlap < 1, one.relaxed > 0),
            *(one.common > 2 * one.pairs, 0 < one.places < one.pairs - 0.1),
        )
        for one in found
    ]
    assert np.sum(kinds, axis=0).min() > 5
    assert any(one.pairs == 0 for one in found)


@given(seeds)
def test_expected_pairs_are_those_of_minutiae_that_lie_anywhere(seed):
    """Of M minutiae each has so many of N others within 12 px and 30 degrees in the mean."""
    a, b, partner, transform = some_case(seed)
    found = overlay(a, b, partner, transform)
    if not found.area:
        assert found.chance == 0
        return
    most = found.common**2 / 4 * 75.0 / found.area
    assert 0 <= found.chance <= most * (1 + 1e-12)
    one_for_one = with_itself(a)
    assert one_for_one.chance == pytest.approx(len(a) ** 2 * 75.0 / one_for_one.area)


@given(seeds)
@settings(max_examples=FEW)
def test_a_scorer_used_before_gives_the_same_and_leaves_what_it_gave(seed):
    """Whatever it scored before: a print of more minutiae, with or without ridges."""
    scorer = evidence_scorer(14, some_weights(apart=3.0))
    kept = []
    for case in map(some_case, (seed, seed + 1, seed + 2, seed)):
        again = overlay(*case, scorer=scorer)
        fresh = overlay(*case, some_weights(apart=3.0))
        assert (entries_of(again), again.total) == (entries_of(fresh), fresh.total)
        kept.append((again.features, again.features.tolist()))
    assert all(features.tolist() == before for features, before in kept)


def test_a_print_aligned_with_itself_and_with_one_beside_it():
    points = spread_points(np.random.default_rng(6), 25, spacing=20.0)
    print_ = prepare(template_of(points, field=SHOWN))
    found = with_itself(print_)
    assert (found.pairs, found.common, found.unpaired, found.cells) == (25, 50, 0, 625)
    assert (found.agreement, found.overlap, found.ridges) == (1.0, 1.0, 1.0)
    assert found.local >= 25 - 1e-3
    assert found.relaxed > 0
    beside = np.array([1.0, 0.0, 900.0, 0.0])
    found = overlay(print_, print_, np.full(25, -1, np.int32), beside)
    assert entries_of(replace(found, fewest=0)) == [0] * len(ENTRIES)
    assert found.agreement == 0.0


@pytest.mark.parametrize(
    ("quality", "unpaired"),
    [
        ([100, 50, 0, 30] + [80] * 8, 1 + 0.25 + 0.09),
        # a template made to match must not gain by stating that its minutiae are worth nothing
        ([1] * 12, 4 * 0.25),
        ([20] * 12, 4 * 0.25),
        ([50] * 12, 4 * 0.25),
    ],
)
def test_unpaired_minutiae_count_by_the_square_of_their_quality(quality, unpaired):
    points = spread_points(np.random.default_rng(6), 12)
    points[:2] += [[50], [-50]]
    print_ = prepare(template_of(points, quality=np.array(quality), field=even_field()))
    found = with_itself(print_, unpaired=4)
    assert found.unpaired == pytest.approx(2 * unpaired)
    assert (found.pairs, found.common) == (8, 24)


@given(templates(), templates())
def test_evidence_is_within_its_bounds(probe, reference):
    a, b = prepare(probe), prepare(reference)
    similarity = local_similarity(a.neighbourhoods, b.neighbourhoods)
    scorer = evidence_scorer(max(len(a), len(b)), some_weights())
    # none where the local matches lead to no pair, as with minutiae that coincide
    found = alignments(a.points, b.points, similarity) if len(a) and len(b) else []
    for pairing in found:
        linear, shift = pairing.move
        transform = linear.real, linear.imag, shift.real, shift.imag
        one = overlay(a, b, pairing.partner, transform, scorer=scorer)
        assert 0 < one.pairs <= min(len(a), len(b))
        assert 2 * one.pairs <= one.common <= len(a) + len(b)
        # where all minutiae of a print are poor, the best of them count for more than one
        assert 0 <= one.unpaired <= len(a) + len(b)
        assert 0 < one.agreement <= 1
        assert 0 <= one.overlap <= 1
        assert -1 <= one.ridges <= 1
        assert 0 <= one.cells <= a.region.inside
        assert min(one.local, one.relaxed, one.places, one.weights, one.fullness) >= 0
        assert max(one.places, one.weights, one.fullness) <= one.pairs + 1e-9
        assert np.isfinite(one.features).all()
        assert 0 <= one.similarity < math.inf
