"""The alignment kernel against slow, obvious numpy twins, and compiled against interpreted."""

import math
from collections import namedtuple
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matching_prints import (
    COMPILED,
    NO_POINTS,
    any_points,
    moved,
    plane,
    seeds,
    similarity_of,
    spread_points,
    two_impressions,
)

from fpmatch.matching.pipeline._kernels import _alignment_kernel
from fpmatch.matching.pipeline._kernels._pair_mesh_kernel import PairMesh
from fpmatch.matching.pipeline._kernels._relaxation_kernel import Relaxation
from fpmatch.matching.pipeline.alignment import (
    AlignmentParameters,
    PairMeshParameters,
    RelaxationParameters,
)

DIRECTION_ARM_PX = 30.0  # directions weigh as positions do at this distance from the middle
SCALE_LIMITS = (0.94, 1.06)
FEWEST_FOR_SCALE = 4
MIN_COSINE = 0.85
FEW = 30 if COMPILED else 8

PARAMETERS = AlignmentParameters(max_turn_deg=math.degrees(math.acos(MIN_COSINE)))

State = namedtuple("State", "partner weight transform")


def pair_twin(predicted, b, reach, min_cosine):
    """Return partners and weights: the largest of its row and of its column, where not 0.

    The first of equals; written in the order of the kernel's own sums, so that equal stays equal.
    """
    n, m = predicted.shape[1], b.shape[1]
    partner, weight = np.full(n, -1, np.int32), np.zeros(n)
    if not n or not m:
        return partner, weight
    x, y, c, s = predicted[:, :, None]
    squared = (b[0] - x) ** 2 + (b[1] - y) ** 2
    cosine = c * b[2] + s * b[3]
    within = reach[:, None] * reach[:, None]
    value = (1 - 0.5 * squared / within) * (cosine - min_cosine) * (1 / (1 - min_cosine))
    value[(squared >= within) | (cosine <= min_cosine)] = 0
    best, rival = value.argmax(axis=1), value.argmax(axis=0)
    for i in range(n):
        if value[i, best[i]] > 0 and rival[best[i]] == i:
            partner[i], weight[i] = best[i], value[i, best[i]]
    return partner, weight


def directions(points):
    """Return the directions of minutiae as complex numbers."""
    return points[2] + 1j * points[3]


def transform_of(linear, shift):
    return np.array([linear.real, linear.imag, shift.real, shift.imag])


def fit_twin(a, b, partner, weight, transform):
    """Return the transform that fits the pairs best by weighted least squares."""
    i = np.flatnonzero(partner >= 0)
    if len(i) < 2:
        return transform
    w = weight[i] / weight[i].sum()
    z, z_b = plane(a)[i], plane(b)[partner[i]]
    middle, middle_b = w @ z, w @ z_b
    positions = np.sum(w * (z - middle).conj() * (z_b - middle_b))
    spread = np.sum(w * abs(z - middle) ** 2)
    scale = abs(positions) / spread if spread > 0 and len(i) >= FEWEST_FOR_SCALE else 1.0
    turns = directions(a)[i].conj() * directions(b)[partner[i]]
    turn = positions + DIRECTION_ARM_PX**2 * np.sum(w * turns)
    linear = np.clip(scale, *SCALE_LIMITS) * turn / abs(turn)
    return transform_of(linear, middle_b - linear * middle)


def predict_twin(a, b, state, *, measured=False):
    """Return the mesh of the pairs, which has tests of its own, after it predicted A."""
    n = a.shape[1]
    mesh = PairMesh(PairMeshParameters(), n)
    transform = state.transform.tolist()
    mesh.build(a, n, b, state.partner, *transform)
    mesh.predict(a, n, b, state.partner, *transform, measured)
    return mesh


def grow_twin(a, b, state, rounds, p=PARAMETERS, *, measured=False):
    """Predict and pair anew, so many times; end where nothing changes and the mesh is measured."""
    for r in range(rounds):
        mesh = predict_twin(a, b, state)
        reach = p.reach_px + p.reach_per_px * np.array(mesh.nearest)
        reach = np.minimum(reach, p.reach_limit_px)
        partner, weight = pair_twin(np.array(mesh.predicted), b, reach, MIN_COSINE)
        if (measured or r > 0) and (partner == state.partner).all():
            return State(partner, weight, state.transform)
        state = State(partner, weight, fit_twin(a, b, partner, weight, state.transform))
        if not (partner >= 0).any():
            break
    return state


def first_fit_twin(a, b, partner, weight):
    """Return the pairs of a hypothesis with their transform; a lone pair's is its own."""
    i = int(np.flatnonzero(partner >= 0)[0])
    linear = directions(b)[partner[i]] * directions(a)[i].conj()
    own = transform_of(linear, plane(b)[partner[i]] - linear * plane(a)[i])
    return State(partner, weight, fit_twin(a, b, partner, weight, own))


def aligner_for(a, b, parameters=PARAMETERS, module=_alignment_kernel, room=3):
    """Return an aligner that holds A and B, and room for more minutiae, which must not matter."""
    aligner = module.Aligner(
        a.shape[1] + room,
        b.shape[1] + room,
        parameters,
        RelaxationParameters(),
        PairMeshParameters(),
    )
    put(aligner, a, b)
    return aligner


def put(aligner, a, b):
    aligner.load_a(a, a.shape[1])
    aligner.load_b(b, b.shape[1])


def at_hand(aligner):
    """Return partners, weights, transform and predicted minutiae of the alignment at hand."""
    n = aligner.size_a
    pairing = np.asarray(aligner.partner)[:n], np.asarray(aligner.weight)[:n]
    transform = np.array([aligner.c, aligner.s, aligner.x, aligner.y])
    return *pairing, transform, np.asarray(aligner.predicted)[:, :n]


def kept_in(aligner, row):
    """Return the same of what is kept in a row."""
    n = aligner.size_a
    arrays = np.empty(4), np.empty(n, np.int32), np.empty(n), np.empty((4, n))
    pairs = aligner.copy_kept(row, *arrays)
    return [pairs, *(array.tolist() for array in arrays)]


def shown(aligner):
    """Return all of the alignment at hand, to be compared to the last bit."""
    found = [aligner.pairs, *(array.tolist() for array in at_hand(aligner))]
    if aligner.pairs:
        mesh = aligner.mesh
        found += [mesh.places, mesh.weights, mesh.full, mesh.strain, mesh.turned, mesh.edges]
    return found


def paired(a, b, reach, min_cosine=MIN_COSINE):
    """Return the weight of the pairs of minutiae that lie as they are, partners and weights."""
    widest = max(reach.max(initial=0.0), 1.0)
    turn = math.degrees(math.acos(min_cosine))
    aligner = aligner_for(a, b, replace(PARAMETERS, reach_limit_px=widest, max_turn_deg=turn))
    np.asarray(aligner.predicted)[:, : a.shape[1]] = a
    np.asarray(aligner.reach)[: len(reach)] = reach
    return aligner.pair(), *at_hand(aligner)[:2]


def fitted(a, b, partner, weight, start):
    """Return the number of pairs and the transform fitted to them."""
    aligner = aligner_for(a, b)
    aligner.c, aligner.s, aligner.x, aligner.y = start.tolist()
    for side, given_side in zip(at_hand(aligner), (partner, weight), strict=False):
        side[:] = given_side
    listed = np.flatnonzero(partner >= 0)
    np.asarray(aligner.paired)[: len(listed)] = listed
    aligner.pairs = len(listed)
    return aligner.fit(), at_hand(aligner)[2]


def some_pairs(rng, n, m):
    """Return random partners, one to one, and weights."""
    partner = np.full(n, -1, np.int32)
    paired = int(rng.integers(0, min(n, m) + 1))
    partner[rng.permutation(n)[:paired]] = rng.permutation(m)[:paired]
    return partner, np.where(partner >= 0, rng.uniform(0.01, 1, n), 0.0)


def some_transform(rng):
    scale, turn = rng.uniform(0.9, 1.1), rng.uniform(-4, 4)
    return np.array([scale * np.cos(turn), scale * np.sin(turn), *rng.uniform(-200, 200, 2)])


@given(seeds, st.floats(1, 40), st.floats(-0.5, 0.95))
def test_pairs_agree_with_their_twin(seed, within, min_cosine):
    a, b = any_points(seed), any_points(seed + 1)
    reach = np.random.default_rng(seed).uniform(0.5, 1, a.shape[1]) * within
    total, *found = paired(a, b, reach, min_cosine)
    partner, weight = pair_twin(a, b, reach, math.cos(math.acos(min_cosine)))
    assert found[0].tolist() == partner.tolist()
    assert found[1] == pytest.approx(weight, rel=1e-9)
    assert total == pytest.approx(weight.sum())


@given(seeds)
def test_fit_agrees_with_its_twin(seed):
    rng = np.random.default_rng(seed)
    a, b = two_impressions(seed)
    partner, weight = some_pairs(rng, a.shape[1], b.shape[1])
    start = some_transform(rng)
    count, found = fitted(a, b, partner, weight, start)
    assert count == np.count_nonzero(partner >= 0)
    assert found == pytest.approx(fit_twin(a, b, partner, weight, start), abs=1e-8)


def test_pairs_on_one_spot_turn_by_their_directions():
    a = np.zeros((4, 3))
    a[2] = 1
    b = moved(a, 0.5, 20 + 10j)
    _, found = fitted(a, b, np.arange(3, dtype=np.int32), np.ones(3), np.zeros(4))
    assert found == pytest.approx([np.cos(0.5), np.sin(0.5), 20, 10])


def any_prints(seed):
    """Return two impressions of one finger, or of any two."""
    if seed % 3:
        return two_impressions(seed)
    return any_points(seed), any_points(seed + 1)


@given(seeds)
@settings(max_examples=FEW)
def test_hypotheses_and_their_growth_agree_with_their_twins(seed):
    """In general position: on a lattice, rounding decides which of two pairs fits better."""
    rng = np.random.default_rng(seed)
    a, b = two_impressions(seed)
    if seed % 3 == 0:
        a, b = (spread_points(rng, int(n), 8.0) for n in rng.integers(0, 25, 2))
    n, m = a.shape[1], b.shape[1]
    similarity = similarity_of(a, b)
    aligner = aligner_for(a, b)
    relaxation = Relaxation(RelaxationParameters(), n, m)
    assert aligner.relax(similarity) == relaxation.load(a, n, b, m, similarity)
    coarse = []
    for k in range(PARAMETERS.hypotheses):
        partner, weight = np.empty(n, np.int32), np.empty(n)
        pairs = aligner.start_hypothesis(k)
        if relaxation.hypothesis(n, k == 0, partner, weight) == 0:
            coarse.append(None)
            assert pairs == 0
            continue
        state = first_fit_twin(a, b, partner, weight)
        state = grow_twin(a, b, state, PARAMETERS.coarse_rounds)
        relaxation.explain(state.partner)
        check_state(aligner, a, b, state)
        coarse.append(state)
    for k in np.random.default_rng(seed).permutation(PARAMETERS.hypotheses).tolist():
        state = coarse[k]
        pairs = aligner.refine(k)
        if state is None or not (state.partner >= 0).any():
            assert pairs == 0
            continue
        rounds = PARAMETERS.rounds - PARAMETERS.coarse_rounds
        check_state(aligner, a, b, grow_twin(a, b, state, rounds, measured=True))


def check_state(aligner, a, b, expected):
    partner, weight, transform, predicted = at_hand(aligner)
    assert partner.tolist() == expected.partner.tolist()
    assert weight == pytest.approx(expected.weight, abs=1e-8)
    assert transform == pytest.approx(expected.transform, abs=1e-6)
    listed = np.asarray(aligner.paired)[: aligner.pairs]
    assert listed.tolist() == np.flatnonzero(partner >= 0).tolist()
    if not aligner.pairs:
        return
    mesh = predict_twin(a, b, expected, measured=True)
    assert predicted == pytest.approx(np.array(mesh.predicted), abs=1e-6)
    for name in ("places", "weights", "full", "turned", "edges"):
        assert getattr(aligner.mesh, name) == pytest.approx(getattr(mesh, name), abs=1e-6)


@given(seeds)
@settings(max_examples=FEW)
def test_imposed_pairs_are_measured_and_not_changed(seed):
    rng = np.random.default_rng(seed)
    a, b = two_impressions(seed)
    if seed % 5 == 0:  # no minutiae on one side or both
        a, b = NO_POINTS, b if seed % 2 else NO_POINTS
    partner, _ = some_pairs(rng, a.shape[1], b.shape[1])
    transform = some_transform(rng)
    aligner = aligner_for(a, b, room=int(rng.integers(0, 3)))
    assert aligner.impose(partner, *transform.tolist()) == np.count_nonzero(partner >= 0)
    check_state(aligner, a, b, State(partner, (partner >= 0).astype(float), transform))


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
@settings(max_examples=20 if COMPILED else 5)
def test_used_fresh_and_interpreted_aligners_agree_to_the_last_bit(plain, seed):
    """What an aligner found of earlier prints, even larger ones, leaves no trace."""
    larger = [spread_points(np.random.default_rng(k), 40, 5.0) for k in range(2)]
    used = aligner_for(*larger)
    run_all(used, similarity_of(*larger))
    a, b = any_prints(seed)
    similarity = similarity_of(a, b)
    put(used, a, b)
    interpreted = aligner_for(a, b, module=plain.alignment)
    expected = run_all(aligner_for(a, b, room=0), similarity)
    assert run_all(used, similarity) == expected == run_all(interpreted, similarity)


def test_a_hypothesis_stays_as_it_was_kept():
    a, b = two_impressions(8)
    aligner = aligner_for(a, b)
    aligner.relax(similarity_of(a, b))
    assert aligner.start_hypothesis(0) > 0
    kept = kept_in(aligner, 0)
    partner, weight, transform, predicted = (side.tolist() for side in at_hand(aligner))
    assert kept == [aligner.pairs, transform, partner, weight, predicted]
    aligner.start_from(0, 0, aligner.hypotheses)
    aligner.impose(np.full(14, -1, np.int32), 1.0, 0.0, 0.0, 0.0)
    aligner.relax(similarity_of(a, b))
    assert kept_in(aligner, 0) == kept


@pytest.mark.parametrize("size", [3.0, 300.0, 1e7])
def test_minutiae_are_found_near_any_place_however_far_they_lie(size):
    rng = np.random.default_rng(7)
    a, b = (spread_points(rng, 30, 0.0, size) for _ in range(2))
    b[:, :5] = a[:, :5]
    b[0, :5] += 2.0
    _, partner, weight = paired(a, b, np.full(30, 5.0), -1.0)
    expected = pair_twin(a, b, np.full(30, 5.0), -1.0)
    assert partner.tolist() == expected[0].tolist()
    assert weight == pytest.approx(expected[1])
    assert np.count_nonzero(partner >= 0) >= 5
