"""One-to-one comparison: which hypothesis is the result, whatever was in the workspace before."""

import math
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from kernel_cases import match
from matching_prints import doubled_prints, jittered, seeds, spread_points, template_of
from matching_weights import (
    ALWAYS,
    NEVER,
    REJECTING,
    scored_by,
    some_weights,
)

from fpmatch.matching import reference
from fpmatch.matching.constants.comparison import MAX_STRETCH, MIN_PAIRS_FOR_SCALE
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.pipeline._kernels import _pipeline_kernel
from fpmatch.matching.pipeline.match import (
    LEAST_CAPACITY,
    Workspace,
    evidence_scorer,
    workspace_for,
)
from fpmatch.matching.prints.prepare import prefilter_of, score_descriptors
from fpmatch.matching.reference import transform_of
from fpmatch.matching.reference.alignment import Pairing
from fpmatch.pointset.geometry.similarity import Similarity


def impressions(seed, size):
    """Return two impressions of one finger, in the order of their content."""
    rng = np.random.default_rng(seed)
    points = spread_points(rng, size)
    sides = (template_of(points), template_of(jittered(rng, points, 1.5, 0.05)))
    a, b = sorted((MATCHER.prepare(side) for side in sides), key=lambda side: side.key)
    return a, b


def outcome(workspace, probe, reference):
    """Return what the prefilter decides, and partners, features and estimate of the alignment."""
    first = reference.key < probe.key
    workspace.load(probe)
    rejected = workspace.rejected(reference, reference_first=first)
    aligned = workspace.match(reference, reference_first=first)
    if aligned is None:
        return rejected, None
    alignment, evidence = aligned
    values = alignment.partner, evidence.features, evidence.minus_log_fmr
    return rejected, [np.asarray(value).tolist() for value in values]


@pytest.mark.parametrize("refine", [-1.0, 4.0])
def test_a_workspace_used_before_gives_the_same(refine):
    """Whatever was compared in it before; the model is that of each two prints."""
    prints = [side for seed, size in enumerate((12, 30, 5)) for side in impressions(seed, size)]
    weights = some_weights(refine, prefilter=REJECTING)
    used = Workspace(64, evidence_scorer(64, weights))
    pairs = [pair for pair in product([*prints, prints[0]], prints) if pair[0] is not pair[1]]
    rejected = 0
    for probe, other in pairs:
        found = outcome(used, probe, other)
        assert found == outcome(Workspace(64, evidence_scorer(64, weights)), probe, other)
        a, b = probe.bit_descriptors, other.bit_descriptors
        threshold = min(9.0 + min(len(probe), len(other)), 33.0)
        shortfall = threshold - score_descriptors(prefilter_of(a), b)
        assert found[0] == (-5.0 - 0.25 * shortfall if shortfall > 0 else None)
        rejected += found[0] is not None
    assert 0 < rejected < len(pairs)


def test_a_thread_has_one_workspace_until_a_larger_print_comes_or_other_weights():
    first = workspace_for(10)
    assert first.capacity >= LEAST_CAPACITY
    assert workspace_for(20) is first
    larger = workspace_for(first.capacity + 1)
    assert larger.capacity > first.capacity
    assert workspace_for(10) is larger
    with scored_by(some_weights()):
        assert workspace_for(10) is not larger


def test_threads_compare_as_one_does():
    pairs = [impressions(seed, 15) for seed in range(8)] * 4
    pairs += [(pairs[0][0], reference) for _, reference in pairs]  # all have one print in common
    expected = [MATCHER.compare(a, b).similarity for a, b in pairs]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda pair: MATCHER.compare(*pair).similarity, pairs))
    assert found == expected


def fit_of(given_, *, swapped):
    n = int((given_["partner"] >= 0).sum())
    pairs, fitted = np.empty((n, 2), np.int32), np.empty(5)
    assert _pipeline_kernel.fit_pairs(*given_.values(), swapped, pairs, fitted) == n
    *transform, rms = fitted.tolist()
    return Similarity(*transform), pairs.tolist(), rms


def pairs_to_fit(seed, paired):
    """Return pairs under a transform of some scale, among minutiae of which not all are paired."""
    rng = np.random.default_rng(seed)
    a = rng.uniform(20, 300, (4, 14))
    stretch, angle = rng.choice([0.97, 1.1, 1.4]), rng.uniform(-3, 3)
    order = rng.permutation(14)
    b = np.empty((4, 14))
    moved = stretch * np.exp(1j * angle) * (a[0] + 1j * a[1]) + rng.normal(0, 2, 14)
    b[:, order] = np.stack([moved.real, moved.imag, a[2], a[3]])
    partner = np.full(14, -1, np.int32)
    chosen = rng.choice(14, paired, replace=False)
    partner[chosen] = order[chosen]
    return {
        "a": a,
        "b": b,
        "zoom_a": 1.0,
        "zoom_b": rng.choice([1.0, 500 / 569]),
        "index_a": np.sort(rng.choice(50, 14, replace=False)).astype(np.int32),
        "index_b": np.sort(rng.choice(50, 14, replace=False)).astype(np.int32),
        "partner": partner,
        "weight": rng.uniform(0.1, 1, 14),
        "turn": -angle,
        "fewest": MIN_PAIRS_FOR_SCALE,
        "stretch": MAX_STRETCH,
    }


@given(seeds, st.integers(1, 14), st.booleans())
def test_the_fit_agrees_with_the_reference(seed, paired, swapped):
    given_ = pairs_to_fit(seed, paired)
    transform, pairs, rms = fit_of(given_, swapped=swapped)
    a, b = (SimpleNamespace(points=given_[s], to_500dpi=given_[f"zoom_{s}"]) for s in "ab")
    partner, move = given_["partner"], (np.exp(-1j * given_["turn"]), 0j)
    pairing = Pairing(a.points, b.points, partner, given_["weight"], move)
    expected, expected_rms = transform_of(a, b, pairing)
    i = np.flatnonzero(partner >= 0)
    listed = np.column_stack([given_["index_a"][i], given_["index_b"][partner[i]]]).tolist()
    if swapped:
        expected = expected.inverse()
        expected_rms *= expected.scale
        listed = sorted([j, i] for i, j in listed)
    assert pairs == listed
    assert rms == pytest.approx(expected_rms, abs=1e-9)
    assert transform.matrix == pytest.approx(expected.matrix, rel=1e-9, abs=1e-8)


@given(
    seeds,
    st.sampled_from([ALWAYS, NEVER, -20.0, -8.0, -2.0, 3.0]),
    st.sampled_from([-math.inf, -5.0, 0.0, 5.0, math.inf]),
    st.sampled_from([-1.0, 0.01, 0.05, 0.2, math.inf]),
)
def test_match_agrees_with_the_reference(seed, refine, confident, relaxation):
    """Which hypotheses are tried, which are refined, and which of them is the result."""
    a, b = doubled_prints(seed)
    weights = some_weights(refine, confident=confident, relaxation=relaxation, apart=2.0)
    found = match(a, b, evidence_scorer(max(len(a), len(b)), weights))
    with scored_by(weights):
        expected = reference.match(a, b)
    assert (found is None) == (expected is None)
    if found is not None:
        assert found[0].partner.tolist() == expected[0].partner.tolist()
        assert complex(*found[0].transform[:2]) == pytest.approx(expected[0].move[0], rel=1e-9)
        assert found[1].total == pytest.approx(expected[1].total, rel=1e-9)
