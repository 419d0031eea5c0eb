"""One-to-one comparison: local match, which hypothesis is the result, whatever came before."""

import math
from concurrent.futures import ThreadPoolExecutor
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from kernel_cases import match, pipeline_for
from matching_prints import (
    doubled_prints,
    jittered,
    seeds,
    spread_points,
    template_of,
)
from matching_weights import ALWAYS, NEVER, REJECTING, scored_by, some_weights

from fpmatch.matching import reference
from fpmatch.matching.matchers import unit_circle as own
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.parameters import MatchParameters
from fpmatch.matching.pipeline._kernels import _local_kernel as kernel
from fpmatch.matching.prints.prepare import prefilter_of, score_descriptors
from fpmatch.matching.prints.prepared import Neighbourhoods
from fpmatch.matching.reference.neighbourhood import local_similarity


def impressions(seed, size):
    """Return two impressions of one finger, in the order of their content."""
    rng = np.random.default_rng(seed)
    points = spread_points(rng, size)
    sides = (template_of(points), template_of(jittered(rng, points, 1.5, 0.05)))
    a, b = sorted((MATCHER.prepare(side) for side in sides), key=lambda side: side.key)
    return a, b


@given(
    seeds,
    st.sampled_from([ALWAYS, NEVER, -20.0, -8.0, -2.0, 3.0]),
    st.sampled_from([-math.inf, -5.0, 0.0, 5.0, math.inf]),
    st.sampled_from([-1.0, 0.01, 0.05, 0.2, math.inf]),
)
def test_match_agrees_with_the_reference(seed, refine, confident, relaxation):
    """Which hypotheses are tried and refined, which is the result, and which competes with it."""
    a, b = doubled_prints(seed)
    weights = some_weights(refine, confident=confident, relaxation=relaxation, apart=2.0)
    pipeline = pipeline_for(a, b, weights=weights)
    estimate = match(a, b, pipeline)
    with scored_by(weights):
        expected = reference.match(a, b)
    assert (estimate is None) == (expected is None)
    if estimate is not None:
        pairing, evidence = expected
        partner, _, move, entries = (of[pipeline.best] for of in pipeline.kept)
        assert partner[: len(a)].tolist() == pairing.partner.tolist()
        assert complex(*move[:2]) == pytest.approx(pairing.move[0], rel=1e-9)
        assert [*entries, pipeline.scorer.total] == pytest.approx(evidence[:-1], rel=1e-9)
        assert estimate == pytest.approx(evidence.minus_log_fmr, rel=1e-9)


@pytest.mark.parametrize("refine", [-1.0, 4.0])
def test_a_pipeline_used_before_gives_the_same(refine):
    """Whatever was compared in it before; the model is that of each two prints."""
    prints = [side for seed, size in enumerate((12, 30, 5)) for side in impressions(seed, size)]
    weights, rejected = some_weights(refine, prefilter=REJECTING), 0
    used = pipeline_for(*prints, weights=weights)
    pairs = [pair for pair in product([*prints, prints[0]], prints) if pair[0] is not pair[1]]
    for a, b in (sorted(pair, key=lambda side: side.key) for pair in pairs):
        fresh = pipeline_for(*prints, weights=weights)
        estimate = match(a, b, fresh)
        assert match(a, b, used) == estimate
        if estimate is not None:
            assert (
                np.array(used.scorer.evidence).tolist() == np.array(fresh.scorer.evidence).tolist()
            )
        score = score_descriptors(prefilter_of(a.bit_descriptors), b.bit_descriptors)
        shortfall = min(9.0 + min(len(a), len(b)), 33.0) - score
        estimate = used.rejected(own.view_of(b), False)
        assert estimate == (-5.0 - 0.25 * shortfall if shortfall > 0 else 0.0)
        rejected += estimate < 0.0
    assert 0 < rejected < len(pairs)


def test_a_thread_has_one_pipeline_until_other_weights_come():
    probe, _ = impressions(1, 10)
    first = own.pipeline_for(probe)
    assert own.pipeline_for(probe) is first
    with scored_by(some_weights()):
        assert own.pipeline_for(probe) is not first


def test_threads_compare_as_one_does():
    pairs = [impressions(seed, 15) for seed in range(8)] * 4
    pairs += [(pairs[0][0], reference) for _, reference in pairs]  # all have one print in common
    expected = [MATCHER.compare(a, b).similarity for a, b in pairs]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda pair: MATCHER.compare(*pair).similarity, pairs))
    assert found == expected


NARROWEST_PX, WIDEST_PX = 7.5, 15.0


def some_frames(rng, n, size, reach):
    """Return counts and frames of n minutiae whose neighbours lie within `reach` of them."""
    angle = rng.uniform(0, 2 * np.pi, (n, size))
    u, v = rng.uniform(-reach, reach, (2, n, size))
    tolerance = rng.uniform(NARROWEST_PX, WIDEST_PX, (n, size))
    columns = (u, v, np.cos(angle), np.sin(angle), tolerance**-2, rng.uniform(0, 2, (n, size)))
    frame = np.ascontiguousarray(np.stack(columns, axis=1), np.float32)
    return rng.integers(0, size + 1, n).astype(np.int32), frame


def indexed_similarity(a, b, p, *, by_a):
    """Return what the kernel finds by an index of A's neighbours, or of B's."""
    similarity = np.full((len(a[0]), len(b[0])), np.nan, np.float32)
    index = kernel.NeighbourIndex(*(a if by_a else b), p)
    other = b if by_a else a
    index.to_prints(*other, len(other[0]), similarity, not by_a)
    return similarity


@given(seeds, st.sampled_from([5.0, 20.0, 200.0]), st.floats(1, 90), st.integers(1, 9))
def test_local_match_agrees_with_the_reference(seed, reach, degrees, fewest):
    """Whichever print is indexed, to the last bit; of which neighbours lie beyond the cells."""
    rng = np.random.default_rng(seed)
    # with the slack of this growth the widest tolerance suffices where the narrowest is indexed
    least = math.cos(math.radians(degrees))
    p = MatchParameters(tolerance_per_px=0.5, neighbour_cosine=least, fewest_neighbours=fewest)
    a, b = (some_frames(rng, int(rng.integers(0, 8)), 9, reach) for _ in range(2))
    sides = (Neighbourhoods(count, frame) for count, frame in (a, b))
    expected = local_similarity(*sides, p)
    found = indexed_similarity(a, b, p, by_a=True)
    assert found == pytest.approx(expected, abs=1e-5)
    assert indexed_similarity(a, b, p, by_a=False).tolist() == found.tolist()
