# mypy: ignore-errors
"""Kernel: overlay two point sets by a transform, and refine it. Interpreted, it runs as it stands.

A move is (s·cos θ, s·sin θ, tx, ty) of eq. (1). Q is a grid; indices of its points are in the
order of its cells.
"""

import cython
import numpy as np

COMPILED = cython.compiled

_MOST = cython.declare(cython.int, 12)  # points that are considered as partners of one, at most
_LEAST_RISE = cython.declare(cython.double, 0.001)  # of a price, in squared tolerances


@cython.locals(pairs=cython.int)
def refine(p, grid, t2, max_rounds, owner, partner, distance2, visits, move):
    """Pair nearest points and refit, in turn, until the number of pairs is stable.

    The first round has twice the tolerance, in area. ``move`` is refitted in place; ``partner``
    receives the point of Q of each of P or -1, ``distance2`` its squared distance, and
    ``owner`` the inverse of ``partner``; both are all -1 before the first call, and stay together.
    ``visits`` (1,) counts the points overlaid. Return the number of points of P inside the grid, or
    -1 where so few have partners that any would fit, or these do not determine a transform.
    """
    before: cython.int = -1
    inside: cython.int = 0
    for round_ in range(max_rounds):
        reach2 = 2.0 * t2 if round_ == 0 else t2
        inside = pairs = 0
        visits[0] += p.shape[1]
        for i in range(p.shape[1]):
            if partner[i] >= 0:
                owner[partner[i]] = -1
                partner[i] = -1
        for i in range(p.shape[1]):
            x = move[2] + move[0] * p[0, i] - move[1] * p[1, i]
            y = move[3] + move[1] * p[0, i] + move[0] * p[1, i]
            if x < grid.x0 or y < grid.y0 or x > grid.x1 or y > grid.y1:
                continue
            inside += 1
            pairs += _claim(grid, x, y, reach2, i, owner, partner, distance2)
        if pairs <= 2:
            return -1
        if round_ > 0 and pairs == before:
            break
        before = pairs
        if not fit_partners(p, grid, partner, move):
            return -1
    return inside


def _claim(grid, x, y, reach2, i, owner, partner, distance2):
    """Pair point i, moved to (x, y), with the nearest point, unless that has a nearer partner.

    Return by how much the number of pairs grows.
    """
    at = grid.nearest(x, y, reach2)
    if at < 0:
        return 0
    x, y = x - grid.x[at], y - grid.y[at]
    distance2[i] = x * x + y * y
    held = owner[at]
    if held >= 0:
        if distance2[held] <= distance2[i]:
            return 0
        partner[held] = -1
    owner[at] = i
    partner[i] = at
    return 0 if held >= 0 else 1


@cython.locals(i=cython.int, held=cython.int, near=cython.int[::1], near2=cython.double[::1])
def pair_by_auction(p, grid, move, t2, owner, partner):
    """Pair points within t of each other under a move, one to one, so that Σ(t² - d²) is largest.

    ``owner`` and ``partner`` are all -1 before. An auction (Bertsekas): a point takes what is worth
    most to it, less its price, and raises that price to where the next best, or none, is worth as
    much; the former owner then looks for another. The sum is the largest to `_LEAST_RISE` a point.
    """
    near, near2 = np.empty(_MOST, np.intc), np.empty(_MOST)
    price: cython.double[::1] = np.zeros(owner.shape[0])
    rise: cython.double = max(_LEAST_RISE * t2, 1e-300)
    for first in range(p.shape[1]):
        i = first
        while i >= 0:
            x = move[2] + move[0] * p[0, i] - move[1] * p[1, i]
            y = move[3] + move[1] * p[0, i] + move[0] * p[1, i]
            best = second = 0.0
            at: cython.int = -1
            for e in range(grid.within(x, y, t2, _MOST, near, near2, 0)):
                value = t2 - near2[e] - price[near[e]]
                if value > best:
                    second, best, at = best, value, near[e]
                elif value > second:
                    second = value
            held = -1
            if at >= 0:
                price[at] += best - second + rise
                held = owner[at]
                if held >= 0:
                    partner[held] = -1
                owner[at], partner[i] = i, at
            i = held


@cython.locals(i=cython.Py_ssize_t)
def fit_partners(p, grid, partner, move):
    """Fit `move` by least squares to the points that have partners; return whether there is one.

    Two passes: means, then centred sums; without a fit `move` stays as it is.
    """
    pairs: cython.int = 0
    px = py = qx = qy = 0.0
    for i in range(p.shape[1]):
        at = partner[i]
        if at >= 0:
            pairs += 1
            px += p[0, i]
            py += p[1, i]
            qx += grid.x[at]
            qy += grid.y[at]
    if pairs < 2:
        return False
    px, py = px / pairs, py / pairs
    qx, qy = qx / pairs, qy / pairs
    spread = dot = cross = 0.0
    for i in range(p.shape[1]):
        at = partner[i]
        if at >= 0:
            x, y = p[0, i] - px, p[1, i] - py
            u, v = grid.x[at] - qx, grid.y[at] - qy
            spread += x * x + y * y
            dot += x * u + y * v
            cross += x * v - y * u
    if spread <= 0.0 or (dot == 0.0 and cross == 0.0):
        return False
    move[0], move[1] = dot / spread, cross / spread
    move[2] = qx - move[0] * px + move[1] * py
    move[3] = qy - move[1] * px - move[0] * py
    return True
