"""The alignment kernel against the reference."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matching_prints import (
    any_points,
    seeds,
    similarity_of,
    spread_points,
    two_impressions,
)

from fpmatch.matching.parameters import USUAL
from fpmatch.matching.pipeline._kernels import _alignment_kernel
from fpmatch.matching.reference.alignment import Pairing, _pair, grow, seeded
from fpmatch.matching.reference.pair_mesh import measure
from fpmatch.matching.reference.relaxation import relax

PARAMETERS = USUAL


def pairing_of(a, b, partner, weight, transform):
    """Return pairs as the reference has them."""
    c, s, x, y = transform
    return Pairing(a, b, partner, weight, (complex(c, s), complex(x, y)))


def paired_by_reference(a, b, reach):
    nobody = np.full(a.shape[1], -1)
    pairing = Pairing(a, b, nobody, np.zeros(len(nobody)))
    return _pair(pairing, pairing.places[0], pairing.directions[0], reach)


def aligner_for(a, b, parameters=PARAMETERS, room=3):
    """Return an aligner that holds A and B, and room for more minutiae, which must not matter."""
    aligner = _alignment_kernel.Aligner(a.shape[1] + room, b.shape[1] + room, parameters)
    put(aligner, a, b)
    return aligner


def put(aligner, a, b):
    aligner.load(a, a.shape[1], b, b.shape[1])


def at_hand(aligner):
    """Return partners, weights, transform and predicted minutiae of the current alignment."""
    n = aligner.size_a
    pairing = np.asarray(aligner.partner)[:n], np.asarray(aligner.weight)[:n]
    transform = np.array([aligner.c, aligner.s, aligner.x, aligner.y])
    return *pairing, transform, np.asarray(aligner.predicted)[:, :n]


def kept_in(aligner, row):
    """Return the same of what is kept in a row."""
    n = aligner.size_a
    arrays = np.empty(4), np.empty(n, np.int32), np.empty(n)
    pairs = aligner.copy_kept(row, *arrays)
    return [pairs, *(array.tolist() for array in arrays)]


def shown(aligner):
    """Return all of the current alignment, to be compared to the last bit."""
    found = [aligner.pairs, *(array.tolist() for array in at_hand(aligner))]
    if aligner.pairs:
        mesh = aligner.mesh
        found += [mesh.places, mesh.weights, mesh.full]
    return found


def paired(a, b, reach):
    """Return the weight of the pairs of minutiae that lie as they are, partners and weights."""
    widest = max(reach.max(initial=0.0), 1.0)
    aligner = aligner_for(a, b, replace(PARAMETERS, reach_limit_px=widest))
    np.asarray(aligner.predicted)[:, : a.shape[1]] = a
    np.asarray(aligner.reach)[: len(reach)] = reach
    return aligner.pair(), *at_hand(aligner)[:2]


@given(seeds, st.sampled_from([None, 3.0, 300.0, 1e7]))
def test_pairs_agree_with_the_reference_however_far_minutiae_lie(seed, size):
    a, b = any_points(seed), any_points(seed + 1)
    rng = np.random.default_rng(seed)
    if size:
        a, b = (spread_points(rng, 30, 0.0, size) for _ in range(2))
        b[:, :5] = a[:, :5] + [[0.4], [0.0], [0.0], [0.0]]
    reach = rng.uniform(0.5, 1, a.shape[1]) * rng.uniform(1, 40)
    total, partner, weight = paired(a, b, reach)
    expected, of_each = paired_by_reference(a, b, reach) if a.size and b.size else ([-1], [0.0])
    assert partner.tolist() == np.broadcast_to(expected, partner.shape).tolist()
    assert weight == pytest.approx(np.broadcast_to(of_each, weight.shape), rel=1e-9)
    assert total == pytest.approx(np.sum(of_each))
    assert not size or np.count_nonzero(partner >= 0) >= 5


def any_prints(seed):
    """Return two impressions of one finger, or of any two."""
    if seed % 3:
        return two_impressions(seed)
    return any_points(seed), any_points(seed + 1)


@given(seeds)
def test_hypotheses_and_their_growth_agree_with_the_reference(seed):
    """In general position: on a lattice, rounding decides which of two pairs fits better."""
    rng = np.random.default_rng(seed)
    a, b = two_impressions(seed)
    if seed % 3 == 0:
        a, b = (spread_points(rng, int(n), 8.0) for n in rng.integers(0, 25, 2))
    similarity = similarity_of(a, b)
    aligner, candidates = aligner_for(a, b), relax(a, b, similarity)
    assert aligner.relax(similarity) == len(candidates.first)
    coarse = [None] * PARAMETERS.hypotheses
    seeds = candidates.seeds
    for k in range(len(coarse)):
        if not seeds:
            break
        aligner.start_hypothesis(k)
        hypothesis = candidates.hypothesis(a.shape[1], seeds[0])
        coarse[k] = grow(seeded(a, b, *hypothesis), PARAMETERS.coarse_rounds)
        among = candidates.among(coarse[k].partner)
        seeds = [seed for seed in seeds[1:] if not among[seed]]
        check_state(aligner, coarse[k])
    for k in rng.permutation(PARAMETERS.hypotheses).tolist():
        if coarse[k] is None:
            assert aligner.start_hypothesis(k) == 0
        if coarse[k] is None or not coarse[k].pairs:
            assert aligner.refine(k) == 0
            continue
        aligner.refine(k)
        rounds = PARAMETERS.rounds - PARAMETERS.coarse_rounds
        check_state(aligner, grow(coarse[k], rounds, settled=True))


def check_state(aligner, expected):
    partner, weight, transform, predicted = at_hand(aligner)
    assert partner.tolist() == expected.partner.tolist()
    assert weight == pytest.approx(expected.weight, abs=1e-8)
    linear, shift = expected.move
    move = [linear.real, linear.imag, shift.real, shift.imag]
    assert transform == pytest.approx(move, abs=1e-6)
    listed = np.asarray(aligner.paired)[: aligner.pairs]
    assert listed.tolist() == np.flatnonzero(partner >= 0).tolist()
    if not aligner.pairs:
        return
    mesh, place, direction, _ = expected.mesh
    rows = place.real, place.imag, direction.real, direction.imag
    assert predicted == pytest.approx(np.array(rows), abs=1e-6)
    sums = measure(mesh, expected.places[1], expected.partner, place)
    shown = aligner.mesh.places, aligner.mesh.weights, aligner.mesh.full
    expected_sums = [sums[name] for name in ("places", "weights", "fullness")]
    assert shown == pytest.approx(expected_sums, abs=1e-6)


def run_all(aligner, similarity):
    """Align by all hypotheses; return all that the aligner shows after each of them."""
    results = [aligner.relax(similarity)]
    for step in (aligner.start_hypothesis, aligner.refine):
        for k in range(aligner.hypotheses):
            pairs = step(k)
            kept = kept_in(aligner, k) if pairs else None
            results.append([pairs, kept, shown(aligner) if pairs else None])
    return results


@given(seeds)
@settings(max_examples=20)
def test_used_and_fresh_aligners_agree_to_the_last_bit(seed):
    """What an aligner found of earlier prints, even larger ones, leaves no trace."""
    larger = [spread_points(np.random.default_rng(k), 40, 5.0) for k in range(2)]
    used = aligner_for(*larger)
    run_all(used, similarity_of(*larger))
    a, b = any_prints(seed)
    similarity = similarity_of(a, b)
    put(used, a, b)
    expected = run_all(aligner_for(a, b, room=0), similarity)
    assert run_all(used, similarity) == expected
