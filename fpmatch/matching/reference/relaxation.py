"""Relax: local matches that agree in distance, direction and rotation support each other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching.constants import COINCIDENT
from fpmatch.matching.parameters import USUAL, MatchParameters

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.reference.pair_mesh import Floats, Numbers


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """The local matches of two prints, each minutia in one of them at most, after relaxation."""

    similarity: NDArray[np.float32]  # (N, M): of all minutiae of A and of B
    first: Numbers  # (K,): minutiae of A
    second: Numbers  # (K,): minutiae of B
    relaxed: Floats  # (K,): similarity after relaxation
    support: Floats  # (K, K): how well two of them agree, 0 to 1
    parameters: MatchParameters

    @property
    def strength(self) -> float:
        """Mean of the four greatest relaxed similarities, missing ones counting as 0."""
        return float(np.sort(self.relaxed)[-4:].sum() / 4)

    def among(self, partner: Numbers) -> NDArray[np.bool_]:
        """Return which of them are among pairs, given as the partners of A's minutiae."""
        return np.asarray(partner[self.first] == self.second)

    @property
    def seeds(self) -> list[int]:
        """Candidates that hypotheses start from, none much weaker than the strongest, in order."""
        order = np.argsort(-self.relaxed, kind="stable")
        least = self.parameters.least_seed_share * self.relaxed.max(initial=0.0)
        relaxed = self.relaxed[order]
        return [int(k) for k in order[(relaxed > 0.0) & (relaxed >= least)]]

    def hypothesis(self, size: int, seed: int) -> tuple[Numbers, Floats]:
        """Return partners and weights of A's minutiae, `size` of them, by a seed's hypothesis.

        All candidates that are strong enough are the pairs of the hypothesis of the first seed; in
        the others each counts as much as it supports the seed.
        """
        p = self.parameters
        first = seed == self.relaxed.argmax()
        share = np.ones(len(self.relaxed)) if first else self.support[seed].copy()
        share[seed] = 1.0
        value = share * self.relaxed / self.relaxed[seed]
        kept = value >= p.least_share
        partner, weight = np.full(size, -1), np.zeros(size)
        partner[self.first[kept]] = self.second[kept]
        weight[self.first[kept]] = value[kept]
        return partner, weight


def relax(
    a: Floats,
    b: Floats,
    similarity: NDArray[np.float32],
    p: MatchParameters = USUAL,
) -> Candidates:
    """Select the most similar pairs of minutiae and relax them: each supports those it fits."""
    first, second = _select(similarity, p.candidates)
    relaxed = similarity[first, second].astype(np.float64)
    support = _compatibility(a[:, first], b[:, second], p)
    share = (1.0 - p.inertia) / max(len(first) - 1, 1)
    for _ in range(p.relaxation_rounds):
        relaxed = p.inertia * relaxed + share * (relaxed @ support)
    return Candidates(similarity, first, second, relaxed, support, p)


def _select(similarity: NDArray[np.float32], most: int) -> tuple[Numbers, Numbers]:
    """Select the pairs of the greatest similarity, each minutia once; the first of equals."""
    left = similarity.copy()
    selected: list[tuple[np.intp, ...]] = []
    while len(selected) < most and left.max(initial=0.0) > 0.0:
        selected.append(np.unravel_index(left.argmax(), left.shape))
        i, j = selected[-1]
        left[i], left[:, j] = 0.0, 0.0
    first, second = np.array(selected, np.intp).reshape(-1, 2).T
    return first, second


def _compatibility(a: Floats, b: Floats, p: MatchParameters) -> Floats:
    """Return how well candidates agree, shape (K, K), 0 to 1: in distance, rotation, direction."""
    z_a, z_b = a[0] + 1j * a[1], b[0] + 1j * b[1]
    rotation = (b[2] + 1j * b[3]) * (a[2] - 1j * a[3])
    span_a, span_b = z_a - z_a[:, None], z_b - z_b[:, None]
    length_a, length_b = abs(span_a), abs(span_b)
    shorter = np.minimum(length_a, length_b)
    distance = 1.0 - ((length_a - length_b) / (p.distance_px + p.distance_per_px * shorter)) ** 2
    turned = (rotation.conj()[:, None] * rotation).real - p.min_rotation_cosine
    mean = rotation[:, None] + rotation
    length = abs(mean) * length_a * length_b
    angle = (mean * span_a * span_b.conj()).real / np.where(length > 0.0, length, 1.0)
    angle -= p.min_angle_cosine
    fits = (shorter >= COINCIDENT) & (distance > 0.0) & (turned > 0.0) & (angle > 0.0)
    turned /= 1.0 - p.min_rotation_cosine
    return np.where(fits, distance * turned * angle / (1.0 - p.min_angle_cosine), 0.0)
