# mypy: ignore-errors
"""Kernel: the search of van Wamelen, Li and Iyengar, from local to global matches.

Each set is a grid whose points lie in [0, 1)²; indices of points are indices into the order of its
cells. A move is (s·cos θ, s·sin θ, tx, ty) of eq. (1). `steps` (1,) counts the points and cells
visited, the measure of work done.
"""

import cython

if cython.compiled:
    from cython.cimports.fpmatch.pointset.geometry._grid_kernel import CellGrid
else:
    from fpmatch.pointset.geometry._grid_kernel import CellGrid

COMPILED = cython.compiled


@cython.locals(rank=cython.int)
def search(
    p_grid, q_grid, pivot, scene, near_p, near_q, bases, window, enough_near, enough,
    tolerance, max_steps, move, pair, taken, steps, found,
):  # fmt: skip
    """Map each `pivot` of P to each point of `scene`, a permutation of Q, until one pair matches.

    The farthest of the pivot's k neighbours serve as base neighbours: `bases` of them, each mapped
    to the `window` neighbours of similar rank of the point of Q. `enough_near` neighbours with a
    point of Q within twice the tolerance make a local match, `enough` pairs a global one. The
    search gives up after `max_steps`.

    `near_p` (M, k) and `near_q` (N, k) are the neighbours, nearest first; `pair` (2, 2, M + 1) and
    `taken` (N,), all 0, are work space. ``found`` receives the number of pairs (0: no match), which
    are ``pair[0, :, :found[0]]``, and the number of local matches; `move` receives the transform.
    """
    k: cython.int = near_p.shape[1]
    half: cython.int = window // 2
    found[0] = found[1] = 0
    for i in range(pivot.shape[0]):
        p = pivot[i]
        for j in range(scene.shape[0]):
            q = scene[j]
            for base in range(k - half - bases, k - half):
                p_base = near_p[p, base]
                for rank in range(base - half, base + half + 1):
                    if steps[0] >= max_steps:
                        return
                    if not map_segment(p_grid, p, p_base, q_grid, q, near_q[q, rank], move):
                        continue
                    near = match_locally(
                        p_grid, near_p[p], q_grid, move, 2.0 * tolerance, enough_near,
                        pair[0], taken, steps,
                    )  # fmt: skip
                    if near == 0:
                        continue
                    found[1] += 1
                    pair[0, 0, near], pair[0, 1, near] = p, q
                    found[0] = match_globally(
                        p_grid, q_grid, tolerance, near + 1, enough, max_steps, move, pair,
                        taken, steps,
                    )  # fmt: skip
                    if found[0] > 0:
                        return


def map_segment(p_grid, p, p_base, q_grid, q, q_base, move):
    """Write the move that maps p to q and p's neighbour to q's; return whether there is one."""
    px, py = p_grid.x[p_base] - p_grid.x[p], p_grid.y[p_base] - p_grid.y[p]
    qx, qy = q_grid.x[q_base] - q_grid.x[q], q_grid.y[q_base] - q_grid.y[q]
    length2 = px * px + py * py
    if not (length2 > 0.0 and qx * qx + qy * qy > 0.0):
        return False
    move[0] = (px * qx + py * qy) / length2
    move[1] = (px * qy - py * qx) / length2
    move[2] = q_grid.x[q] - (move[0] * p_grid.x[p] - move[1] * p_grid.y[p])
    move[3] = q_grid.y[q] - (move[1] * p_grid.x[p] + move[0] * p_grid.y[p])
    return True


@cython.locals(i=cython.Py_ssize_t)
def match_locally(p_grid, near_p, q_grid, move, reach, enough, pair, taken, steps):
    """Count the neighbours whose image has a point of Q within `reach`; 0 where not `enough`.

    ``pair[:, :count]`` receives these neighbours and the points of Q nearest to their images.
    """
    count: cython.int = 0
    k: cython.int = near_p.shape[0]
    for i in range(k):
        if count + k - i < enough:
            return 0
        x = move[0] * p_grid.x[near_p[i]] - move[1] * p_grid.y[near_p[i]] + move[2]
        y = move[1] * p_grid.x[near_p[i]] + move[0] * p_grid.y[near_p[i]] + move[3]
        q = nearest_within(q_grid, x, y, reach, taken, steps)
        if q >= 0:
            pair[0, count], pair[1, count] = near_p[i], q
            count += 1
    return count if count >= enough else 0


@cython.locals(i=cython.Py_ssize_t)
def match_globally(p_grid, q_grid, tolerance, pairs, enough, max_steps, move, pair, taken, steps):
    """Fit and pair in turn, starting with ``pair[0, :, :pairs]``, until the count stops growing.

    Return the number of pairs, 0 where they are not `enough`. They are then ``pair[0]``, each
    within `tolerance` under `move`: those of the last round that did not lose any.
    """
    count: cython.int = 0
    a = b = tx = ty = 0.0
    while fit_pairs(p_grid, q_grid, pair[0], pairs, move):
        more = pair_within(p_grid, q_grid, move, tolerance, count, max_steps, pair[1], taken, steps)
        if more < count or more == 0:
            break
        for i in range(more):
            pair[0, 0, i], pair[0, 1, i] = pair[1, 0, i], pair[1, 1, i]
        a, b, tx, ty = move[0], move[1], move[2], move[3]
        if more == count:
            break
        count = pairs = more
    move[0], move[1], move[2], move[3] = a, b, tx, ty
    return count if count >= enough else 0


@cython.locals(j=cython.Py_ssize_t)
def fit_pairs(p_grid, q_grid, pair, count, move):
    """Write the least-squares move of the pairs (2, count); return whether there is one.

    With Σ|p|², Σp·q and Σp×q of centred points, s·cos θ = Σp·q / Σ|p|² and s·sin θ = Σp×q / Σ|p|².
    One pass over offsets from the first pair; without a fit `move` stays as it is.
    """
    x0, y0 = p_grid.x[pair[0, 0]], p_grid.y[pair[0, 0]]
    u0, v0 = q_grid.x[pair[1, 0]], q_grid.y[pair[1, 0]]
    sum_x = sum_y = sum_u = sum_v = 0.0
    spread = dot = cross = 0.0
    for j in range(1, count):
        x, y = p_grid.x[pair[0, j]] - x0, p_grid.y[pair[0, j]] - y0
        u, v = q_grid.x[pair[1, j]] - u0, q_grid.y[pair[1, j]] - v0
        sum_x += x
        sum_y += y
        sum_u += u
        sum_v += v
        spread += x * x + y * y
        dot += x * u + y * v
        cross += x * v - y * u
    n: cython.double = count
    spread -= (sum_x * sum_x + sum_y * sum_y) / n
    dot -= (sum_x * sum_u + sum_y * sum_v) / n
    cross -= (sum_x * sum_v - sum_y * sum_u) / n
    if not (spread > 0.0 and dot * dot + cross * cross > 0.0):
        return False
    a, b = dot / spread, cross / spread
    x, y = x0 + sum_x / n, y0 + sum_y / n
    move[0], move[1] = a, b
    move[2] = u0 + sum_u / n - (a * x - b * y)
    move[3] = v0 + sum_v / n - (b * x + a * y)
    return True


@cython.locals(i=cython.Py_ssize_t)
def pair_within(p_grid, q_grid, move, tolerance, enough, max_steps, pair, taken, steps):
    """Pair each image of P with the nearest point of Q within `tolerance` that is still free.

    Return the number of pairs, or 0 as soon as they can no longer be `enough` or the work is too
    much; `pair` receives them. `taken` (N of Q,) is all 0 before and after.
    """
    count: cython.int = 0
    m: cython.int = p_grid.order.shape[0]
    for i in range(m):
        if count + m - i < enough or steps[0] >= max_steps:
            break
        x = move[0] * p_grid.x[i] - move[1] * p_grid.y[i] + move[2]
        y = move[1] * p_grid.x[i] + move[0] * p_grid.y[i] + move[3]
        q = nearest_within(q_grid, x, y, tolerance, taken, steps)
        if q >= 0:
            taken[q] = 1
            pair[0, count], pair[1, count] = i, q
            count += 1
    for i in range(count):
        taken[pair[1, i]] = 0
    return count if count >= enough and steps[0] < max_steps else 0


@cython.ccall
@cython.inline
@cython.exceptval(check=False)
def nearest_within(
    grid: CellGrid, x: cython.double, y: cython.double, reach: cython.double,
    taken: cython.int[::1], steps: cython.longlong[::1],
) -> cython.int:  # fmt: skip
    """Return the point nearest to (x, y), not `taken`, within `reach`; -1 for none.

    Of equals it is the first; `taken` (N,) is 0 for a point that is free.
    """
    cython.declare(
        j=cython.Py_ssize_t, row=cython.Py_ssize_t, begin=cython.int, end=cython.int,
        left=cython.int, top=cython.int, right=cython.int, bottom=cython.int, nearest=cython.int,
    )  # fmt: skip
    if not (
        x + reach >= 0.0
        and y + reach >= 0.0
        and (x - reach) * grid.per_unit < grid.columns
        and (y - reach) * grid.per_unit < grid.rows
    ):
        return -1
    nearest = -1
    least = reach * reach
    left, top, right, bottom = grid.around(x, y, reach)
    for row in range(top, bottom):
        begin = grid.start[row * grid.columns + left]
        end = grid.start[row * grid.columns + right]
        steps[0] += 1 + end - begin
        for j in range(begin, end):
            dx, dy = grid.x[j] - x, grid.y[j] - y
            distance = dx * dx + dy * dy
            if taken[j] == 0 and (distance < least or (distance == least and nearest < 0)):
                least = distance
                nearest = j
    return nearest
