import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pointset_strategies import grid_of, in_columns, seeds, squared_distances

from fpmatch.lab.points.triangles import _proposal_kernel as kernel
from fpmatch.lab.points.triangles._sequential_test_kernel import hit_log_likelihoods
from fpmatch.lab.points.triangles.descriptors import describe_all, describe_large, sort_by_shape
from fpmatch.pointset.delaunay.triangulate import triangulate
from fpmatch.pointset.geometry.similarity import Similarity

ANYTHING_PASSES = {"reject": -1e300, "accept": -1e300, "accept_small": -1e300}
WIDEST = 6.0  # of the kernel, times reach²
GIVEN = {
    **{"reach": 0.05, "shape_tolerance": 0.05, "reject": -1.5, "accept": 6.0, "accept_small": 2.0},
    **{"test_length": 60, "max_proposals": 10**9, "max_visits": 10**12},
}


class Search:
    """The arguments of the kernel, made as the matcher makes them, and the state of the search."""

    def __init__(self, p, q, **given):
        self.mesh, self.p, self.q = triangulate(p), in_columns(p), in_columns(q)
        self.in_p = describe_all(self.p, self.mesh.triangles, 0.5)
        self.in_q = describe_large(self.q, triangulate(q).triangles, 0.8, 0.05)
        self.order = np.argsort(self.in_p.negative_information[: self.in_p.number], kind="stable")
        vars(self).update(GIVEN | {"grown": len(p)} | given)
        self.widest = self.shape_tolerance / 0.05
        self.shapes = sort_by_shape(self.in_q, self.widest)
        self.grid, self.gain = grid_of(self.q, 0.3), np.empty(9)
        self.miss = hit_log_likelihoods(0.05, 0.6, self.gain)
        self.neighbours = np.empty(self.grown, np.int32)
        self.seen = np.full(len(p), -1, np.int32)
        self.fit, self.state = np.zeros(8), np.zeros(3, np.int_)
        self.visits = np.zeros(1, np.int64)
        self.test = kernel.SimilarityTest(
            *(self.p, self.in_p.corner, self.mesh.ring_start, self.mesh.ring, self.q, self.grid),
            *(self.reach**2, self.gain, self.miss, self.reject, self.accept, self.accept_small),
            *(self.test_length, self.seen, self.neighbours, self.fit, self.visits),
        )

    def proceed(self):
        """Search until a proposal passes; return whether one did."""
        return bool(
            kernel.propose(
                *(self.test, self.order, self.in_p.shape, self.in_q.corner, self.in_q.side),
                *(self.shapes, self.shape_tolerance, self.widest, self.max_proposals),
                *(self.max_visits, self.state),
            )
        )

    def similar(self):
        """Yield the triangles of P and of Q that are similar, in the order of the search."""
        for k in self.order.tolist():
            for j in self.shapes.order:
                apart = np.hypot(*(self.in_q.shape[:, j] - self.in_p.shape[:, k]))
                if apart <= self.shape_tolerance / self.in_q.side[j]:
                    yield k, j

    def corners(self, k, j):
        of_p, of_q = self.in_p.corner[k].tolist(), self.in_q.corner[j].tolist()
        return list(zip(of_p, of_q, strict=True))

    def neighbours_of(self, k):
        """Return the other points of P, those fewer steps away in the mesh first."""
        met = self.in_p.corner[k].tolist()
        for i in met:  # which grows as it is walked through
            met += [j for j in self.mesh.one_ring(i).tolist() if j not in met]
        return met[3:]

    def grow(self, pairs, neighbours, reject, accept):
        """Return the ratio and the pairs of one test, the transform refitted after each pair."""
        pairs, ratio, reach2 = list(pairs), 0.0, self.reach**2
        for i in neighbours:
            of_p, of_q = self.p[:, [a for a, _ in pairs]], self.q[:, [b for _, b in pairs]]
            x, y = Similarity.fit(of_p.T, of_q.T).apply(self.p[:, [i]].T)[0]
            if not (self.grid.x0 <= x <= self.grid.x1 and self.grid.y0 <= y <= self.grid.y1):
                continue
            middle = of_p.mean(axis=1, keepdims=True)
            variance = (
                1 / len(pairs)
                + ((self.p[:, [i]] - middle) ** 2).sum() / ((of_p - middle) ** 2).sum()
            )
            variance = min(variance, WIDEST - 1)
            squared = squared_distances(self.grid, x, y)
            at = int(squared.argmin())
            if squared[at] < reach2 * (1 + variance):
                ratio += self.gain[int(variance * (len(self.gain) - 1) / (WIDEST - 1))]
                pairs.append((i, self.grid.order[at]))
                if ratio > accept:
                    break
            else:
                ratio += self.miss
                if ratio < reject:
                    break
        return ratio, pairs

    def passing(self):
        """Yield the triangle of P and the pairs of every proposal that passes its test."""
        length = min(self.test_length, len(self.neighbours))
        for k, j in self.similar():
            corners, neighbours = self.corners(k, j), self.neighbours_of(k)
            ratio, _ = self.grow(corners, neighbours[:length], self.reject, self.accept)
            small = len(neighbours) < length
            if ratio >= self.accept or (small and ratio >= self.accept_small):
                grown = neighbours[: len(self.neighbours)]
                yield k, self.grow(corners, grown, -math.inf, math.inf)[1]


def two_views(seed, n=9):
    """Return a set, and a moved and jittered copy of most of it among outliers."""
    rng = np.random.default_rng(seed)
    p = rng.uniform(0, 1, (n, 2))
    move = Similarity(rng.uniform(0.7, 1.5), rng.uniform(-3, 3), *rng.uniform(-9, 9, 2))
    q = move.apply(p[: n - 2] + rng.normal(0, 0.01, (n - 2, 2)))
    return p, np.vstack([q, rng.uniform(q.min(axis=0), q.max(axis=0), (3, 2))])


def sums(fit):
    """Return number, means and scaled rotation of a fit."""
    number, *means, spread, cosine, sine = fit.tolist()
    return [number, *means, cosine / spread, sine / spread]


def expected_sums(search, pairs):
    of_p, of_q = (search.p.T[[a for a, _ in pairs]], search.q.T[[b for _, b in pairs]])
    turn = Similarity.fit(of_p, of_q).matrix[:, 0]
    return [len(pairs), *of_p.mean(axis=0), *of_q.mean(axis=0), *turn]


@given(seeds, st.sampled_from([3, 60]), st.sampled_from([5, 9]))
@settings(max_examples=25)
def test_what_passes_and_its_fit_agree_with_a_twin_that_refits(seed, test_length, grown):
    search = Search(*two_views(seed), test_length=test_length, grown=grown)
    for k, pairs in search.passing():
        assert search.proceed()
        assert search.order[search.state[0]] == k
        assert sums(search.fit) == pytest.approx(expected_sums(search, pairs), abs=1e-9)
    assert not search.proceed()


@given(seeds)
@settings(max_examples=20)
def test_every_pair_of_similar_triangles_is_tested_once(seed):
    search = Search(*two_views(seed), reach=0.0, shape_tolerance=0.1, **ANYTHING_PASSES)
    for count, (k, j) in enumerate(search.similar(), start=1):
        assert search.proceed()
        assert search.state[2] == count
        assert search.order[search.state[0]] == k
        # within no reach, no neighbour is added to the corners
        expected = expected_sums(search, search.corners(k, j))
        assert sums(search.fit) == pytest.approx(expected, abs=1e-9)
    assert not search.proceed()


@given(seeds, st.integers(0, 12), st.integers(0, 5))
@settings(max_examples=20)
def test_no_more_pairs_are_tested_than_allowed(seed, most, before):
    everything = dict(ANYTHING_PASSES, shape_tolerance=0.1, max_proposals=before + most)
    search = Search(*two_views(seed), **everything)
    search.state[2] = before  # pairs that an earlier search tested count
    allowed = min(most, len(list(search.similar())))
    passed = 0
    while search.proceed():
        passed += 1
    assert (passed, search.state[2]) == (allowed, before + allowed)
    nothing = Search(*two_views(seed), **dict(everything, accept=1e9, accept_small=1e9))
    nothing.state[2] = before
    assert not nothing.proceed()
    assert nothing.state[2] == before + allowed


@given(seeds)
@settings(max_examples=20)
def test_the_transform_of_a_copy_is_proposed(seed):
    rng = np.random.default_rng(seed)
    p = rng.uniform(0, 1, (14, 2))
    move = Similarity(rng.uniform(0.7, 1.5), rng.uniform(-3, 3), *rng.uniform(-9, 9, 2))
    search = Search(p, move.apply(p), reach=0.01, shape_tolerance=0.01)
    assert search.proceed()
    inner = search.fit[0] - 3  # a point on the border may fall outside the grid by rounding
    assert 14 - 3 - 4 <= inner <= 14 - 3
    assert sums(search.fit)[5:] == pytest.approx(move.matrix[:, 0], abs=1e-9)
    centre = move.apply([search.fit[1:3]])[0]
    assert search.fit[3:5] == pytest.approx(centre, abs=1e-9)


def test_nothing_is_proposed_without_triangles():
    line = np.column_stack([np.arange(5.0), np.zeros(5)])
    p, q = two_views(2)
    for one, other in ((line, q), (p, line)):
        search = Search(one, other, **ANYTHING_PASSES)
        assert not search.proceed()
        assert search.state[2] == 0


@given(st.floats(1e-6, 2.0), st.floats(0.05, 0.95), st.integers(2, 40))
def test_hits_have_their_log_likelihood_ratio(expected, share, steps):
    gain = np.empty(steps)
    miss = hit_log_likelihoods(expected, share, gain)
    chance = -np.expm1(-expected * np.linspace(1.0, WIDEST, steps))
    assert gain == pytest.approx(np.log((share + (1 - share) * chance) / chance), abs=1e-9)
    assert miss == pytest.approx(math.log(1 - share))
    assert (np.diff(gain) <= 0).all()
