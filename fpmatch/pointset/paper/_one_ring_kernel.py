# mypy: ignore-errors
"""Kernel: shape-preserving weights, and overlays of whole sets.

Rings are flat: the ring of centre ``centre[i]`` is ``vertex[start[i]:start[i + 1]]``, counter-
clockwise. Points, circles and images are arrays (2, N) of x and y. A move is (s·cos θ, s·sin θ,
tx, ty) of the paper's eq. (1).
"""

import cython
import numpy as np

COMPILED = cython.compiled


@cython.locals(line=cython.Py_ssize_t)
def centre_images(point, centre, start, vertex, circle, weight, image):
    """Write the shape-preserving weights λ_k of eq. (4), and each centre's image Σ λ_k u_k.

    `circle` (2, M) holds u_k for each entry of `vertex`; `weight` (M) and `image` (2, R) are
    written, with x = 2 (outside the circle) where a ring does not go round its centre.
    """
    px: cython.const[cython.double][::1] = point[0]
    py: cython.const[cython.double][::1] = point[1]
    for i in range(centre.shape[0]):
        image[0, i], image[1, i] = 2.0, 0.0
        if shape_preserving_weights(
            px, py, vertex, start[i], start[i + 1], px[centre[i]], py[centre[i]], weight
        ):
            image[0, i] = 0.0
            for line in range(start[i], start[i + 1]):
                image[0, i] += weight[line] * circle[0, line]
                image[1, i] += weight[line] * circle[1, line]


def shape_preserving_weights(px, py, vertex, begin, end, x, y, weight):
    """Write the weights λ_k of eq. (4) of the point (x, y) in the ring ``vertex[begin:end]``.

    ``weight[begin:end]`` are written: they sum to 1, and Σ λ_k p_k is (x, y). Return whether the
    ring, counter-clockwise, goes round the point; the weights mean nothing where it does not.
    """
    degree: cython.double = end - begin
    for line in range(begin, end):
        weight[line] = 0.0
    first = begin
    for line in range(begin, end):
        from_x, from_y = px[vertex[line]] - x, py[vertex[line]] - y
        # the line from this vertex through the centre leaves by the side (far, far + 1), which
        # moves on round the ring as the vertex does
        first = line if first < line else first
        far = first if first < end else first - (end - begin)
        side = from_x * (py[vertex[far]] - y) - from_y * (px[vertex[far]] - x)
        side = 0.0 if first == line else side
        next_side = 0.0
        far = -1
        for r in range(first, line + (end - begin)):
            s = r + 1 if r + 1 < end else r + 1 - (end - begin)
            next_side = from_x * (py[vertex[s]] - y) - from_y * (px[vertex[s]] - x)
            if side >= 0.0 and next_side < 0.0:
                far = r if r < end else r - (end - begin)
                first = r
                break
            side = next_side
        if far < 0:
            return False
        s = far + 1 if far + 1 < end else begin
        own = (px[vertex[far]] - x) * (py[vertex[s]] - y) - (py[vertex[far]] - y) * (
            px[vertex[s]] - x
        )
        whole = own - next_side + side
        if not (own > 0.0 and whole > 0.0):
            return False
        whole = 1.0 / (whole * degree)
        weight[line] += own * whole
        weight[far] -= next_side * whole
        weight[s] += side * whole
    return True


@cython.locals(met_p=cython.int, met_q=cython.int, i=cython.Py_ssize_t, j=cython.Py_ssize_t)
def best_overlay(move, p_point, grid, tolerance, enough, last_met, found):
    """Find the move under which the most points match, the first of them where several tie.

    A move's count is the smaller of: points of P with a point of Q within `tolerance`; points of
    Q met so. The search ends at the first move that reaches `enough`. `grid` holds the points of
    Q, within [0, 1]². `last_met` (N of Q,) starts at -1; ``found`` receives the index of the move
    (-1 where none matches a point) and its count. In a grid whose crowds are split, a point
    meets the nearest point of Q only.
    """
    n: cython.int = p_point.shape[1]
    most: cython.int = 1 if grid.axis.shape[0] > 0 else grid.order.shape[0]
    near: cython.int[::1] = np.empty(most, np.intc)
    distance2: cython.double[::1] = np.empty(most)
    squared = tolerance * tolerance
    found[0], found[1] = -1, 0
    for k in range(move.shape[0]):
        met_p = met_q = 0
        for i in range(n):
            if (met_q if most == 1 else met_p) + n - i <= found[1]:
                break
            x = move[k, 0] * p_point[0, i] - move[k, 1] * p_point[1, i] + move[k, 2]
            y = move[k, 1] * p_point[0, i] + move[k, 0] * p_point[1, i] + move[k, 3]
            if not (
                x + tolerance >= 0.0
                and y + tolerance >= 0.0
                and x - tolerance < 1.0
                and y - tolerance < 1.0
            ):
                continue
            count: cython.int = grid.within(x, y, squared, most, near, distance2, 0)
            met_p += count > 0
            for j in range(count):
                if last_met[near[j]] != k:
                    last_met[near[j]] = k
                    met_q += 1
        met_p = min(met_p, met_q)
        if met_p > found[1]:
            found[0], found[1] = k, met_p
            if met_p >= enough:
                break
