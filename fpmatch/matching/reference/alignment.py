"""Pair and grow: the mesh of pairs predicts the minutiae of A in B, where they are paired again."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching import constants as fixed
from fpmatch.matching.parameters import USUAL, MatchParameters
from fpmatch.matching.reference.pair_mesh import PairMesh, mesh_of_pairs, predict

if TYPE_CHECKING:
    from fpmatch.matching.reference.pair_mesh import Floats, Move, Numbers, Plane


@dataclass(frozen=True, eq=False)
class Pairing:
    """Pairs of print A with print B, and the transform q = shift + linear·p of eq. (1) they fit."""

    a: Floats  # (4, N): the minutiae of A
    b: Floats  # (4, M)
    partner: Numbers  # (N,): the partner in B, or -1
    weight: Floats  # (N,)
    move: Move = (1 + 0j, 0j)  # linear, shift
    parameters: MatchParameters = USUAL

    @cached_property
    def places(self) -> tuple[Plane, Plane]:
        """Places of the minutiae of A and of B, as complex numbers."""
        return self.a[0] + 1j * self.a[1], self.b[0] + 1j * self.b[1]

    @cached_property
    def directions(self) -> tuple[Plane, Plane]:
        """Their directions, likewise."""
        return self.a[2] + 1j * self.a[3], self.b[2] + 1j * self.b[3]

    @property
    def pairs(self) -> int:
        """Number of pairs."""
        return int(np.count_nonzero(self.partner >= 0))

    @cached_property
    def mesh(self) -> tuple[PairMesh, Plane, Plane, Floats]:
        """The mesh of the pairs, and what it predicts; see `predict`."""
        mesh = mesh_of_pairs(*self.places, self.partner, self.move, self.parameters)
        return mesh, *predict(mesh, self.directions[0], self.move)


def seeded(
    a: Floats, b: Floats, partner: Numbers, weight: Floats, parameters: MatchParameters = USUAL
) -> Pairing:
    """Return given pairs with their transform; a single pair fixes it by place and direction."""
    pairing = Pairing(a, b, partner, weight, parameters=parameters)
    (z_a, z_b), (d_a, d_b) = pairing.places, pairing.directions
    i = int(np.flatnonzero(partner >= 0)[0])
    linear = complex(d_b[partner[i]] * d_a[i].conj())
    return _fitted(replace(pairing, move=(linear, complex(z_b[partner[i]] - linear * z_a[i]))))


def one_pair(size: int, i: int, j: int) -> tuple[Numbers, Floats]:
    """Return partners and weights (size,) of A's minutiae where i and j of B are the only pair."""
    alone = np.arange(size) == i
    return np.where(alone, j, -1), alone.astype(np.float64)


def grow(pairing: Pairing, rounds: int, *, settled: bool = False) -> Pairing:
    """Predict by the mesh of the pairs and pair again, in turn, until no pair changes.

    Pairs that have just been made are not `settled`: their transform is fitted anew in any case.
    """
    p = pairing.parameters
    for k in range(rounds):
        if not pairing.pairs:
            break
        _, place, direction, nearest = pairing.mesh
        reach = np.minimum(p.reach_px + p.reach_per_px * nearest, p.reach_limit_px)
        partner, weight = _pair(pairing, place, direction, reach)
        same = bool((partner == pairing.partner).all())
        pairing = replace(pairing, partner=partner, weight=weight)
        if same and (settled or k > 0):
            break
        pairing = _fitted(pairing)
    return pairing


def _pair(
    pairing: Pairing, place: Plane, direction: Plane, reach: Floats
) -> tuple[Numbers, Floats]:
    """Pair minutiae of A, predicted in B, and of B that are each other's best; the first of equals.

    Return partners and weights.
    """
    least = pairing.parameters.min_cosine
    away = pairing.places[1] - place[:, None]
    squared = away.real * away.real + away.imag * away.imag
    cosine = (direction[:, None] * pairing.directions[1].conj()).real
    within = (reach * reach)[:, None]
    value = (1.0 - 0.5 * squared / within) * (cosine - least) * (1.0 / (1.0 - least))
    value[(squared >= within) | (cosine <= least)] = 0.0
    own = np.arange(len(place))
    best = value.argmax(axis=1)
    paired = (value[own, best] > 0.0) & (value.argmax(axis=0)[best] == own)
    return np.where(paired, best, -1), np.where(paired, value[own, best], 0.0)


def _fitted(pairing: Pairing) -> Pairing:
    """Fit the transform to two pairs or more by weighted least squares (eq. 1)."""
    i = np.flatnonzero(pairing.partner >= 0)
    if len(i) < 2:
        return pairing
    j, w = pairing.partner[i], pairing.weight[i] / pairing.weight[i].sum()
    (z_a, z_b), (d_a, d_b) = pairing.places, pairing.directions
    middle_a, middle_b = w @ z_a[i], w @ z_b[j]
    span = z_a[i] - middle_a
    positions = w @ (span.conj() * (z_b[j] - middle_b))
    spread = w @ abs(span) ** 2
    scale = abs(positions) / spread if spread > 0.0 and len(i) >= fixed.FEWEST_FOR_SCALE else 1.0
    linear = positions + fixed.DIRECTION_ARM2 * (w @ (d_a[i].conj() * d_b[j]))
    if not abs(linear) > 0.0:
        return pairing
    linear *= min(max(scale, fixed.LEAST_SCALE), fixed.MOST_SCALE) / abs(linear)
    return replace(pairing, move=(complex(linear), complex(middle_b - linear * middle_a)))
