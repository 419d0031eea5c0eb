"""Numpy form of `_relaxation_kernel`: the support of candidates, relaxation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

NEAR: Final = 1e-6


def load(relaxation: Any, a: Any, size_a: int, b: Any, size_b: int, similarity: Any) -> int:
    """Select the candidates of two prints and relax them; return their number."""
    r = relaxation
    n: int = r._select(size_a, size_b, similarity)
    i, j = np.asarray(r.first)[:n], np.asarray(r.second)[:n]
    of_a, of_b = np.asarray(a)[:, i], np.asarray(b)[:, j]
    rotation = np.asarray(r.rotation)[:, :n]
    rotation[0] = of_a[2] * of_b[2] + of_a[3] * of_b[3]
    rotation[1] = of_a[2] * of_b[3] - of_a[3] * of_b[2]
    np.asarray(r.place)[:, :n] = *of_a[:2], *of_b[:2]
    np.asarray(r.relaxed)[:n] = np.asarray(similarity)[i, j]
    np.asarray(r.explained)[:n] = 0
    lower = np.tril(_compatibility(r, of_a[:2], of_b[:2], rotation), -1)
    np.asarray(r.support)[:n, :n] = lower + lower.T
    r._relax()
    r.strength = r._strongest()
    return n


def _compatibility(r: Any, a: Floats, b: Floats, rotation: Floats) -> Floats:
    """Return how well candidate k, by rows, and candidate m agree, 0 to 1."""
    (c_k, s_k), (c_m, s_m) = rotation[:, :, None], rotation[:, None]
    turned = c_k * c_m
    turned += s_k * s_m
    turned -= r.min_rotation_cosine
    ax, ay = a[:, None] - a[:, :, None]
    bx, by = b[:, None] - b[:, :, None]
    length_a, length_b = np.sqrt(ax * ax + ay * ay), np.sqrt(bx * bx + by * by)
    shorter = np.minimum(length_a, length_b)
    apart = (length_a - length_b) / (r.distance_px + r.distance_per_px * shorter)
    near = 1.0 - apart * apart
    valid = (turned > 0.0) & (shorter >= NEAR) & (near > 0.0)
    c, s = c_k + c_m, s_k + s_m
    angle = (c * ax - s * ay) * bx + (s * ax + c * ay) * by
    length = np.sqrt(c * c + s * s) * length_a * length_b
    angle = angle / np.where(valid, length, 1.0) - r.min_angle_cosine
    valid &= angle > 0.0
    turned = turned / (1.0 - r.min_rotation_cosine)
    agreement: Floats = np.where(valid, near * turned * angle / (1.0 - r.min_angle_cosine), 0.0)
    return agreement


def relax(relaxation: Any) -> int:
    """Relax: every candidate keeps a share of its value and takes the rest from the others."""
    r, n = relaxation, int(relaxation.count)
    if n == 0:
        return 0
    share = (1.0 - r.inertia) / (n - 1 if n > 1 else 1)
    support, relaxed = np.asarray(r.support)[:n, :n], np.asarray(r.relaxed)[:n]
    for _ in range(r.rounds):
        # sums in the order of the rows
        gathered = np.cumsum(relaxed[:, None] * support, axis=0)[-1]
        relaxed[:] = r.inertia * relaxed + share * gathered
    return n
