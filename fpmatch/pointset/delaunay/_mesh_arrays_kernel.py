# mypy: ignore-errors
"""Kernel: one-rings, edges, triangles and hull of a linked triangulation as flat arrays.

The links are those of `_delaunay_kernel`, so the rings need no sorting by angle.
"""

import cython
import numpy as np

COMPILED = cython.compiled


def collect_arrays(
    in_order: cython.double[:, ::1], distinct: cython.Py_ssize_t, index: cython.int[:, ::1],
    link: cython.int[:, ::1],
) -> tuple:  # fmt: skip
    """Return triangles, edges, hull, ring_start, ring and interior of `Triangulation`.

    The arguments are what `sort_points` and `link_points` returned.
    """
    cython.declare(
        n=cython.Py_ssize_t, i=cython.Py_ssize_t, h=cython.int, hull_edge=cython.int,
        hull_size=cython.Py_ssize_t, repeats=cython.Py_ssize_t, triangles=cython.Py_ssize_t,
        edges=cython.Py_ssize_t, edges_at=cython.Py_ssize_t, hull_at=cython.Py_ssize_t,
        start_at=cython.Py_ssize_t, ring_at=cython.Py_ssize_t,
    )  # fmt: skip
    order: cython.int[::1] = index[0]
    place: cython.int[::1] = index[1]
    origin: cython.int[::1] = link[0]
    after: cython.int[::1] = link[1]
    n = place.shape[0]
    scratch: cython.int[:, ::1] = np.empty((2, n), np.intc)
    spoke: cython.int[::1] = scratch[0]
    degree: cython.int[::1] = scratch[1]
    flags = np.empty(n, np.uint8)
    interior: cython.uchar[::1] = flags
    for i in range(n):
        interior[i] = place[i] >= 0
        degree[i] = 0
    hull_edge = after[1]
    for h in range(2, link[2, 0]):
        if origin[h] >= 0:
            spoke[origin[h]] = h
            degree[origin[h]] += 1
    # of a point on the hull, the spoke is the first after the gap
    hull_size = 0
    h = hull_edge
    while hull_size == 0 or h != hull_edge:
        spoke[origin[h]] = h
        interior[order[origin[h]]] = 0
        hull_size += 1
        h = after[h ^ 1]
    repeats = n - distinct
    triangles = 2 * distinct - 2 - hull_size
    edges = 3 * distinct - 3 - hull_size
    # the spare entries take what `_write_rings` writes before it knows whether it counts
    edges_at = 3 * triangles + 3
    hull_at = edges_at + 2 * (edges + repeats) + 2
    start_at = hull_at + hull_size
    ring_at = start_at + n + 1
    found = np.empty(ring_at + 2 * edges + repeats, np.intc)
    flat: cython.int[::1] = found
    for i in range(hull_at, start_at):
        flat[i] = order[origin[h]]
        h = after[h ^ 1]
    start: cython.int[::1] = flat[start_at:ring_at]
    ring: cython.int[::1] = flat[ring_at:]
    _start_rings(place, degree, start, ring)
    _write_rings(
        in_order[1], origin, after, order, spoke, interior, distinct,
        flat[:edges_at], flat[edges_at:hull_at], start, ring,
    )  # fmt: skip
    edges = edges_at + 2 * edges
    for i in range(n):
        if place[i] < 0:
            flat[edges], flat[edges + 1] = -1 - place[i], i
            edges += 2
    found.setflags(write=False)
    flags.setflags(write=False)
    return (
        found[: 3 * triangles].reshape(-1, 3),
        found[edges_at:edges].reshape(-1, 2),
        found[hull_at:start_at],
        found[start_at:ring_at],
        found[ring_at:],
        flags.view(np.bool_),
    )


@cython.cfunc
@cython.exceptval(check=False)
def _start_rings(
    place: cython.int[::1], degree: cython.int[::1], start: cython.int[::1], ring: cython.int[::1],
) -> cython.void:  # fmt: skip
    """Write where each point's ring starts, and the rings of points that coincide with others."""
    cython.declare(i=cython.Py_ssize_t, entry=cython.int)
    entry = 0
    for i in range(place.shape[0]):
        start[i] = entry
        if place[i] >= 0:
            entry += degree[place[i]]
        else:
            ring[entry] = -1 - place[i]
            entry += 1
    start[place.shape[0]] = entry


@cython.cfunc
@cython.exceptval(check=False)
def _write_rings(
    y: cython.double[::1], origin: cython.int[::1], after: cython.int[::1], order: cython.int[::1],
    spoke: cython.int[::1], interior: cython.uchar[::1], distinct: cython.Py_ssize_t,
    triangle: cython.int[::1], edge: cython.int[::1], start: cython.int[::1], ring: cython.int[::1],
) -> cython.void:  # fmt: skip
    """Write one-rings, and edges and triangles, each at its first point."""
    cython.declare(
        i=cython.int, j=cython.int, k=cython.int, h=cython.int, g=cython.int, gap=cython.int,
        point=cython.int, other=cython.int, entry=cython.int, t=cython.Py_ssize_t,
        e=cython.Py_ssize_t,
    )  # fmt: skip
    t = e = 0
    for i in range(distinct):
        point = order[i]
        entry = start[point]
        h = spoke[i]
        gap = -1 if interior[point] else h
        # direction -π lies before the first spoke that points down after one that does not
        g = h
        while True:
            k = g
            g = after[g]
            if y[origin[g ^ 1]] < y[i] and y[origin[k ^ 1]] >= y[i]:
                h = g
                break
            if g == h:
                break
        k = origin[g ^ 1]
        while True:
            j = k
            g = after[g]
            k = origin[g ^ 1]
            other = order[j]
            ring[entry] = other
            entry += 1
            edge[e], edge[e + 1] = min(point, other), max(point, other)
            e += 2 * (i < j)
            triangle[t], triangle[t + 1], triangle[t + 2] = point, other, order[k]
            t += 3 * ((i < j) & (i < k) & (g != gap))
            if g == h:
                break
