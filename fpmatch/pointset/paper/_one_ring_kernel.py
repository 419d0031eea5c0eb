# mypy: ignore-errors
"""Kernel: shape-preserving weights, transforms of ring pairs, and overlays of whole sets.

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


@cython.locals(a=cython.Py_ssize_t, b=cython.Py_ssize_t, j=cython.Py_ssize_t, m=cython.Py_ssize_t)
def fit_ring_pairs(
    pair, p_point, p_centre, p_start, p_vertex, p_circle, p_image, q_point, q_centre, q_start,
    q_vertex, q_circle, q_image, move,
):  # fmt: skip
    """Write the move of each pair of rings of equal degree, (K, 2), into `move` (K, 4).

    It is the least-squares fit of eq. (1) to the first ring with its centre and the second, its
    points shifted by `_best_shift`; it is all 0 where there is no such fit. With Σ|p|², Σp·q and
    Σp×q of centred points, s·cos θ = Σp·q / Σ|p|² and s·sin θ = Σp×q / Σ|p|².
    """
    for k in range(pair.shape[0]):
        a, b = pair[k, 0], pair[k, 1]
        degree: cython.Py_ssize_t = p_start[a + 1] - p_start[a]
        m = q_start[b] + _best_shift(
            p_circle, p_image, p_start[a], a, q_circle, q_image, q_start[b], b, degree
        )
        x0, y0 = p_point[0, p_centre[a]], p_point[1, p_centre[a]]
        u0, v0 = q_point[0, q_centre[b]], q_point[1, q_centre[b]]
        sum_x = sum_y = sum_u = sum_v = spread = dot = cross = 0.0
        for j in range(p_start[a], p_start[a + 1]):
            x, y = p_point[0, p_vertex[j]] - x0, p_point[1, p_vertex[j]] - y0
            u, v = q_point[0, q_vertex[m]] - u0, q_point[1, q_vertex[m]] - v0
            sum_x, sum_y, sum_u, sum_v = sum_x + x, sum_y + y, sum_u + u, sum_v + v
            spread += x * x + y * y
            dot += x * u + y * v
            cross += x * v - y * u
            m = m + 1 if m + 1 < q_start[b + 1] else q_start[b]
        n: cython.double = degree + 1
        spread -= (sum_x * sum_x + sum_y * sum_y) / n
        dot -= (sum_x * sum_u + sum_y * sum_v) / n
        cross -= (sum_x * sum_v - sum_y * sum_u) / n
        move[k, 0] = move[k, 1] = move[k, 2] = move[k, 3] = 0.0
        if spread > 0.0 and dot * dot + cross * cross > 0.0:
            dot, cross = dot / spread, cross / spread
            x, y = x0 + sum_x / n, y0 + sum_y / n
            move[k, 0], move[k, 1] = dot, cross
            move[k, 2] = u0 + sum_u / n - (dot * x - cross * y)
            move[k, 3] = v0 + sum_v / n - (cross * x + dot * y)


@cython.locals(j=cython.Py_ssize_t, m=cython.Py_ssize_t)
def _best_shift(p_circle, p_image, p_begin, a, q_circle, q_image, q_begin, b, degree):
    """Return the cyclic shift under which two unit circles correlate most after a rotation.

    The centre's image counts as much as the whole boundary.
    """
    image_dot = degree * (p_image[0, a] * q_image[0, b] + p_image[1, a] * q_image[1, b])
    image_cross = degree * (p_image[0, a] * q_image[1, b] - p_image[1, a] * q_image[0, b])
    most = -1.0
    best = 0
    for shift in range(degree):
        dot, cross = image_dot, image_cross
        m = q_begin + shift
        for j in range(p_begin, p_begin + degree):
            dot += p_circle[0, j] * q_circle[0, m] + p_circle[1, j] * q_circle[1, m]
            cross += p_circle[0, j] * q_circle[1, m] - p_circle[1, j] * q_circle[0, m]
            m = m + 1 if m + 1 < q_begin + degree else q_begin
        if dot * dot + cross * cross > most:
            most, best = dot * dot + cross * cross, shift
    return best


@cython.locals(
    met_p=cython.int, met_q=cython.int, met=cython.int, i=cython.Py_ssize_t,
    row=cython.Py_ssize_t, j=cython.Py_ssize_t,
)  # fmt: skip
def best_overlay(move, p_point, grid, tolerance, enough, last_met, found):
    """Find the move under which the most points match, the first of them where several tie.

    A move's count is the smaller of: points of P with a point of Q within `tolerance`; points of
    Q met so. The search ends at the first move that reaches `enough`. `grid` holds the points of
    Q, within [0, 1]². `last_met` (N of Q,) starts at -1; ``found`` receives the index of the move
    (-1 where none matches a point) and its count. In a grid whose crowds are split, a point
    meets the nearest point of Q only.
    """
    n: cython.int = p_point.shape[1]
    crowded: cython.bint = grid.axis.shape[0] > 0
    near: cython.int[::1] = np.empty(1, np.intc)
    distance2: cython.double[::1] = np.empty(1)
    squared = tolerance * tolerance
    found[0], found[1] = -1, 0
    for k in range(move.shape[0]):
        met_p = met_q = 0
        for i in range(n):
            if (met_q if crowded else met_p) + n - i <= found[1]:
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
            if crowded:
                met = grid.within(x, y, squared, 1, near, distance2, 0)
                met_p += met
                if met and last_met[near[0]] != k:
                    last_met[near[0]] = k
                    met_q += 1
                continue
            left, top, right, bottom = grid.around(x, y, tolerance)
            met = 0
            for row in range(top, bottom):
                for j in range(
                    grid.start[row * grid.columns + left], grid.start[row * grid.columns + right]
                ):
                    dx, dy = grid.x[j] - x, grid.y[j] - y
                    if dx * dx + dy * dy <= squared:
                        met = 1
                        if last_met[j] != k:
                            last_met[j] = k
                            met_q += 1
            met_p += met
        met_p = min(met_p, met_q)
        if met_p > found[1]:
            found[0], found[1] = k, met_p
            if met_p >= enough:
                break
