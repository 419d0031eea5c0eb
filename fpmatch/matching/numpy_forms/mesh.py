"""Form of `_pair_mesh_kernel` for Python: the prediction of all minutiae.

The circumcircles are tested by numpy, all at once; the rings are lists, in the order in which the
kernel has them.
"""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

FRAME: Final = 8
FAR_AWAY: Final = 1e6
NEAR2: Final = 1e-3
LAST: Final = 0xFFFFFF  # bits of the last vertex of a side


@np.errstate(over="ignore", invalid="ignore")  # of transforms that lead nowhere
def predict(
    mesh: Any,
    a: Any,
    size_a: int,
    b: Any,
    partner: Any,
    c: float,
    s: float,
    x: float,
    y: float,
    measured: bool,
) -> int:
    """Predict the places of all minutiae of A in B; return how many the mesh predicts."""
    scale = sqrt(c * c + s * s)
    scale = 1.0 / scale if scale > 0.0 else 0.0
    if measured:
        mesh.places = mesh.weights = mesh.full = mesh.strain = 0.0
        mesh.turned = mesh.edges = 0
        for values in (mesh.place_agreement, mesh.weight_agreement, mesh.fullness):
            np.asarray(values)[:size_a] = 0.0
    minutiae = np.asarray(a)[:, :size_a]
    vertices = [side[: mesh.vertices].tolist() for side in (mesh.ax, mesh.ay, mesh.bx, mesh.by)]
    predicted, nearest = mesh.predicted, mesh.nearest
    by_mesh = 0
    rings = _rings(mesh, minutiae[:2])
    for i, (px, py, pc, ps) in enumerate(minutiae.T.tolist()):
        image = _image(rings[i], vertices, px, py)
        if image is None:
            predicted[0, i] = x + c * px - s * py
            predicted[1, i] = y + s * px + c * py
            predicted[2, i] = scale * (c * pc - s * ps)
            predicted[3, i] = scale * (s * pc + c * ps)
            nearest[i] = FAR_AWAY
            continue
        by_mesh += 1
        image_x, image_y, turn_c, turn_s, nearest[i], weight = image
        predicted[0, i], predicted[1, i] = image_x, image_y
        predicted[2, i] = turn_c * pc - turn_s * ps
        predicted[3, i] = turn_s * pc + turn_c * ps
        if measured and mesh.vertex_of[i] >= 0:
            mesh.ring_size = len(weight)
            for k, v in enumerate(rings[i]):
                mesh.ring[k], mesh.weight[k] = v, weight[k]
            mesh._measure_one(a, i, b, partner[i])
    return by_mesh


def _rings(mesh: Any, places: Any) -> list[list[int]]:
    """Return the ring of each minutia, a vertex of the mesh or not; empty where there is none."""
    corner = np.asarray(mesh.corner)[: mesh.triangles].astype(np.int64)
    circle = np.asarray(mesh.circle)[: mesh.triangles]
    following = corner[:, [1, 2, 0]]
    sides = ((corner << 24) | following).tolist()
    backs = ((following << 24) | corner).tolist()
    start, count = mesh.fan_start.tolist(), mesh.vertices
    fans = list(zip(mesh.fan_from.tolist(), mesh.fan_to.tolist(), strict=True))
    vertex_of = mesh.vertex_of.tolist()
    dx = circle[:, 0] - places[0, :, None]
    dy = circle[:, 1] - places[1, :, None]
    inside = dx * dx + dy * dy < circle[:, 2]
    rings = []
    of_cavity: dict[bytes, list[int]] = {}  # several minutiae may lie in the same circles
    for i, within in enumerate(inside):
        v = vertex_of[i]
        if v >= 0:
            rings.append(chain(fans[start[v] : start[v + 1]], count))
            continue
        ring = of_cavity.get(key := within.tobytes())
        if ring is None:
            kept: list[int] = []
            for t in within.nonzero()[0].tolist():
                remove_pairs(sides[t], backs[t], kept)
            ring = of_cavity[key] = chain([(side >> 24, side & LAST) for side in kept], count)
        rings.append(ring)
    return rings


def remove_pairs(sides: Sequence[int], backs: Sequence[int], kept: list[int]) -> None:
    """Add the sides of a triangle; one that occurs in both directions is removed."""
    for side, back in zip(sides, backs, strict=True):
        if back in kept:
            place = kept.index(back)
            last = kept.pop()
            if place < len(kept):
                kept[place] = last
        else:
            kept.append(side)


def chain(sides: Sequence[tuple[int, int]], vertices: int) -> list[int]:
    """Return the ring that sides make up, empty where they are not one closed polygon."""
    count = len(sides)
    if not 3 <= count <= vertices:
        return []
    following = dict(sides)
    first = v = sides[0][0]
    ring = [v]
    for _ in range(count - 1):
        v = following.get(v, -1)
        if v < 0 or v == first:
            return []
        ring.append(v)
    return ring if following.get(v, -1) == first else []


def _image(
    ring: list[int], vertices: list[list[float]], px: float, py: float
) -> tuple[float, float, float, float, float, list[float]] | None:
    """Return a place in B, the rotation there, the distance to the nearest pair, and the weights.

    None where the ring does not enclose the place.
    """
    all_ax, all_ay, all_bx, all_by = vertices
    if not ring:
        return None
    dx = [all_ax[v] - px for v in ring]
    dy = [all_ay[v] - py for v in ring]
    weights = _ring_weights(dx, dy)
    if weights is None:
        return None
    x = y = c = s = 0.0
    nearest2 = FAR_AWAY * FAR_AWAY
    for w, v in zip(weights, ring, strict=True):
        x += w * all_bx[v]
        y += w * all_by[v]
    for w, v, ax, ay in zip(weights, ring, dx, dy, strict=True):
        bx = all_bx[v] - x
        by = all_by[v] - y
        length2 = ax * ax + ay * ay
        if v >= FRAME and length2 < nearest2:
            nearest2 = length2
        w /= length2 + NEAR2  # noqa: PLW2901 (as the kernel weighs the spokes)
        c += w * (ax * bx + ay * by)
        s += w * (ax * by - ay * bx)
    length = sqrt(c * c + s * s)
    if not length > 0.0:
        return None
    return x, y, c / length, s / length, sqrt(nearest2), weights


def _ring_weights(dx: list[float], dy: list[float]) -> list[float] | None:
    """Return the weights of eq. (4) of the origin in a ring; None where it does not go round it."""
    degree = len(dx)
    weight = [0.0] * degree
    dx, dy = dx + dx, dy + dy
    first = 0
    for line in range(degree):
        from_x, from_y = dx[line], dy[line]
        first = line if line > first else first
        side = 0.0 if first == line else from_x * dy[first] - from_y * dx[first]
        for r in range(first, line + degree):
            next_side = from_x * dy[r + 1] - from_y * dx[r + 1]
            if side >= 0.0 > next_side:
                break
            side = next_side
        else:
            return None
        first = r
        own = dx[r] * dy[r + 1] - dy[r] * dx[r + 1]
        whole = own - next_side + side
        if not (own > 0.0 and whole > 0.0):
            return None
        whole = 1.0 / (whole * degree)
        weight[line] += own * whole
        weight[r - degree if r >= degree else r] -= next_side * whole
        r += 1
        weight[r - degree if r >= degree else r] += side * whole
    return weight
