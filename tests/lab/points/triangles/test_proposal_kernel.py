import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pointset_strategies import as_move, grid_of, in_columns, seeds, squared_distances

from fpmatch.lab.points.triangles._proposal_kernel import Proposals
from fpmatch.lab.points.triangles.given_set import describe, sort_by_shape
from fpmatch.pointset.delaunay.triangulate import triangulate
from fpmatch.pointset.geometry.similarity import Similarity

WIDEST = 6.0  # times reach²
REJECT, ACCEPT, ACCEPT_SMALL, LENGTH = -2.5, 14.0, 4.0, 60  # of the kernel
NO_BOUND = 10**9


class Search:
    """The arguments of the kernel, made as the matcher makes them."""

    def __init__(self, p, q, reach=0.05, shape_tolerance=0.05, miss=-0.9, hit=1.5, tried=0):
        self.mesh, self.p, self.q = triangulate(p), in_columns(p), in_columns(q)
        self.in_p = describe(self.p, self.mesh.triangles, outliers=0.5)
        self.in_q = describe(self.q, triangulate(q).triangles, near_tie=0.8, shortest=0.05)
        self.order = np.argsort(self.in_p.negative_information[: self.in_p.number], kind="stable")
        self.reach, self.shape_tolerance, self.miss = reach, shape_tolerance, miss
        widest = self.shape_tolerance / 0.05
        self.shapes = sort_by_shape(self.in_q, widest)
        self.grid, self.gain = grid_of(self.q, 0.3), np.linspace(hit, hit / 2, 9)
        self.accept_small = min(ACCEPT_SMALL, 0.5 * (len(p) - 3) * hit)
        self.visits = np.zeros(1, np.int64)
        self.proposals = Proposals(
            *(self.p, self.in_p.corner, self.in_p.shape, self.order, self.mesh.ring_start),
            *(self.mesh.ring, self.q, self.grid, self.in_q.corner, self.in_q.side, self.shapes),
            *(shape_tolerance, widest, reach**2, WIDEST, self.gain, miss, tried, self.visits),
        )

    def proceed(self, most=NO_BOUND):
        """Search until a proposal passes; return whether one did."""
        return bool(self.proposals.proceed(most, NO_BOUND))

    def similar(self):
        """Yield the pairs of corners of triangles that are similar, in the order of the search."""
        for k in self.order.tolist():
            for j in self.shapes.order:
                apart = np.hypot(*(self.in_q.shape[:, j] - self.in_p.shape[:, k]))
                if apart <= self.shape_tolerance / self.in_q.side[j]:
                    of_p, of_q = self.in_p.corner[k].tolist(), self.in_q.corner[j].tolist()
                    yield list(zip(of_p, of_q, strict=True))

    def neighbours_of(self, corners):
        """Return the other points of P, those fewer steps away in the mesh first."""
        met = [i for i, _ in corners]
        for i in met:  # which grows as it is walked through
            met += [j for j in self.mesh.one_ring(i).tolist() if j not in met]
        return met[3:]

    def fit(self, pairs):
        of_p, of_q = np.transpose(pairs)
        return Similarity.fit(self.p.T[of_p], self.q.T[of_q])

    def grow(self, pairs, neighbours, reject, accept):
        """Return the ratio and the pairs of one test, the transform refitted after each pair."""
        pairs, ratio = list(pairs), 0.0
        for i in neighbours:
            of_p = self.p[:, [a for a, _ in pairs]]
            x, y = self.fit(pairs).apply(self.p[:, [i]].T)[0]
            if not (self.grid.x0 <= x <= self.grid.x1 and self.grid.y0 <= y <= self.grid.y1):
                continue
            middle = of_p.mean(axis=1, keepdims=True)
            spread = ((of_p - middle) ** 2).sum()
            variance = 1 / len(pairs) + ((self.p[:, [i]] - middle) ** 2).sum() / spread
            variance = min(variance, WIDEST - 1)
            squared = squared_distances(self.grid, x, y)
            at = int(squared.argmin())
            if squared[at] < self.reach**2 * (1 + variance):
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
        """Yield the pairs of every proposal that passes its test."""
        for corners in self.similar():
            neighbours = self.neighbours_of(corners)
            ratio, _ = self.grow(corners, neighbours[:LENGTH], REJECT, ACCEPT)
            if ratio >= ACCEPT or (len(neighbours) < LENGTH and ratio >= self.accept_small):
                yield self.grow(corners, neighbours, -math.inf, math.inf)[1]


def two_views(seed, n=9):
    """Return a set, and a moved and jittered copy of most of it among outliers."""
    rng = np.random.default_rng(seed)
    p = rng.uniform(0, 1, (n, 2))
    move = Similarity(rng.uniform(0.7, 1.5), rng.uniform(-3, 3), *rng.uniform(-9, 9, 2))
    q = move.apply(p[: n - 2] + rng.normal(0, 0.01, (n - 2, 2)))
    return p, np.vstack([q, rng.uniform(q.min(axis=0), q.max(axis=0), (3, 2))])


@given(seeds, st.sampled_from([9, 16, 70]))
@settings(max_examples=25)
def test_what_passes_and_its_fit_agree_with_a_twin_that_refits(seed, n):
    search = Search(*two_views(seed, n), shape_tolerance=0.05 if n < 20 else 0.01)
    for pairs in search.passing():
        assert search.proceed()
        move = np.asarray(search.proposals.move)
        assert move == pytest.approx(as_move(search.fit(pairs)), abs=1e-9)
    assert not search.proceed()


@given(seeds, st.integers(0, 12), st.integers(0, 5))
@settings(max_examples=20)
def test_every_pair_of_similar_triangles_is_tested_once_up_to_the_limit(seed, most, before):
    # every neighbour counts, within no reach none is added to the corners
    search = Search(*two_views(seed), 0.0, 0.1, miss=1e9, hit=0.0, tried=before)
    for count, corners in enumerate(search.similar(), start=1):
        assert search.proceed(before + most) == (count <= most)
        assert search.proposals.tried == before + min(count, most)
        if count <= most:
            move = np.asarray(search.proposals.move)
            assert move == pytest.approx(as_move(search.fit(corners)), abs=1e-9)
    assert not search.proceed(before + most)
    assert not search.proposals.proceed(NO_BOUND, int(search.visits[0]))
