# mypy: ignore-errors
"""Kernel: the search of van Wamelen, Li and Iyengar, from local to global matches.

P (2, M) are points in [0, 1)²; Q is a grid of such, and indices of its points are in the order of
its cells. A move is (s·cos θ, s·sin θ, tx, ty) of eq. (1). `steps` (1,) counts the points and cells
visited, the measure of work done. Interpreted, it runs as it stands.
"""

import cython

if cython.compiled:
    from cython.cimports.fpmatch.lab.points.triangles._overlay_kernel import fit_partners
    from cython.cimports.fpmatch.pointset.geometry._grid_kernel import CellGrid
else:
    from fpmatch.lab.points.triangles._overlay_kernel import fit_partners
    from fpmatch.pointset.geometry._grid_kernel import CellGrid


@cython.locals(rank=cython.int)
def search(
    p, grid, pivot, scene, near_p, near_q, bases, window, enough_near, enough, tolerance,
    max_steps, move, partner, pair, taken, near, steps, found,
):  # fmt: skip
    """Map each `pivot` of P to each point of `scene`, a permutation of Q, until one pair matches.

    The farthest of the pivot's k neighbours serve as base neighbours: `bases` of them, each mapped
    to the `window` neighbours of similar rank of the point of Q. `enough_near` neighbours with a
    point of Q within twice the tolerance make a local match, `enough` pairs a global one. The
    search gives up after `max_steps`.

    `near_p` (M, k) and `near_q` (N, k) are the neighbours, nearest first; `pair` (M,), `taken`
    (N,), all 0, and `near` (k,) are work space. ``found`` receives the number of pairs (0: no
    match) and of local matches; ``partner`` (M,) the point of Q of each of P or -1, and `move` the
    transform.
    """
    k: cython.int = near_p.shape[1]
    half: cython.int = window // 2
    found[0] = found[1] = 0
    for i in range(pivot.shape[0]):
        at = pivot[i]
        for j in range(scene.shape[0]):
            q = scene[j]
            for base in range(k - half - bases, k - half):
                for rank in range(base - half, base + half + 1):
                    if steps[0] >= max_steps:
                        return
                    if not map_segment(p, at, near_p[at, base], grid, q, near_q[q, rank], move):
                        continue
                    if not match_locally(
                        p, near_p[at], grid, move, 2.0 * tolerance, enough_near, near, taken, steps
                    ):
                        continue
                    found[1] += 1
                    for n in range(partner.shape[0]):
                        partner[n] = -1
                    for n in range(k):
                        partner[near_p[at, n]] = near[n]
                    partner[at] = q
                    found[0] = match_globally(
                        p, grid, tolerance, enough, max_steps, move, partner, pair, taken, steps
                    )
                    if found[0] > 0:
                        return


def map_segment(p, i, i_base, grid, q, q_base, move):
    """Write the move that maps i to q and i's neighbour to q's; return whether there is one."""
    px, py = p[0, i_base] - p[0, i], p[1, i_base] - p[1, i]
    qx, qy = grid.x[q_base] - grid.x[q], grid.y[q_base] - grid.y[q]
    length2 = px * px + py * py
    if not (length2 > 0.0 and qx * qx + qy * qy > 0.0):
        return False
    move[0] = (px * qx + py * qy) / length2
    move[1] = (px * qy - py * qx) / length2
    move[2] = grid.x[q] - (move[0] * p[0, i] - move[1] * p[1, i])
    move[3] = grid.y[q] - (move[1] * p[0, i] + move[0] * p[1, i])
    return True


@cython.locals(n=cython.Py_ssize_t)
def match_locally(p, near_p, grid, move, reach, enough, near, taken, steps):
    """Return whether `enough` of the neighbours are moved to within `reach` of a point of Q.

    ``near`` receives the point of Q nearest to each image, or -1.
    """
    missing: cython.int = 0
    for n in range(near_p.shape[0]):
        x = move[2] + move[0] * p[0, near_p[n]] - move[1] * p[1, near_p[n]]
        y = move[3] + move[1] * p[0, near_p[n]] + move[0] * p[1, near_p[n]]
        near[n] = nearest_free(grid, x, y, reach, taken, steps)
        if near[n] < 0:
            missing += 1
            if near_p.shape[0] - missing < enough:
                return False
    return True


@cython.locals(i=cython.Py_ssize_t)
def match_globally(p, grid, tolerance, enough, max_steps, move, partner, pair, taken, steps):
    """Fit and pair in turn, starting with `partner`, until the number of pairs stops growing.

    Return it, 0 where they are not `enough`. They are then ``partner``, each within `tolerance`
    under `move`: the pairs of the last round that did not lose any.
    """
    count: cython.int = 0
    a = b = tx = ty = 0.0
    while fit_partners(p, grid, partner, move):
        more = pair_within(p, grid, move, tolerance, count, max_steps, pair, taken, steps)
        if more < count or more == 0:
            break
        for i in range(partner.shape[0]):
            partner[i] = pair[i]
        a, b, tx, ty = move[0], move[1], move[2], move[3]
        if more == count:
            break
        count = more
    move[0], move[1], move[2], move[3] = a, b, tx, ty
    return count if count >= enough else 0


@cython.locals(i=cython.Py_ssize_t)
def pair_within(p, grid, move, tolerance, enough, max_steps, pair, taken, steps):
    """Pair each image of P with the nearest point of Q within `tolerance` that is still free.

    Return the number of pairs, or 0 as soon as they can no longer be `enough` or the work is too
    much; `pair` (M,) receives them. `taken` (N,) is all 0 before and after.
    """
    count: cython.int = 0
    m: cython.int = p.shape[1]
    for i in range(m):
        pair[i] = -1
        if count + m - i < enough or steps[0] >= max_steps:
            continue
        x = move[2] + move[0] * p[0, i] - move[1] * p[1, i]
        y = move[3] + move[1] * p[0, i] + move[0] * p[1, i]
        at = nearest_free(grid, x, y, tolerance, taken, steps)
        if at >= 0:
            taken[at] = 1
            pair[i] = at
            count += 1
    for i in range(m):
        if pair[i] >= 0:
            taken[pair[i]] = 0
    return count if count >= enough and steps[0] < max_steps else 0


@cython.ccall
@cython.inline
@cython.exceptval(check=False)
def nearest_free(
    grid: CellGrid, x: cython.double, y: cython.double, reach: cython.double,
    taken: cython.int[::1], steps: cython.longlong[::1],
) -> cython.int:  # fmt: skip
    """Return the point nearest to (x, y), not `taken`, nearer than `reach`; -1 for none."""
    cython.declare(row=cython.Py_ssize_t, j=cython.Py_ssize_t)
    if x < grid.x0 - reach or y < grid.y0 - reach or x > grid.x1 + reach or y > grid.y1 + reach:
        return -1
    nearest: cython.int = -1
    least: cython.double = reach * reach
    left, top, right, bottom = grid.around(x, y, reach)
    for row in range(top, bottom):
        begin = grid.start[row * grid.columns + left]
        end = grid.start[row * grid.columns + right]
        steps[0] += 1 + end - begin
        for j in range(begin, end):
            dx, dy = grid.x[j] - x, grid.y[j] - y
            distance2 = dx * dx + dy * dy
            if distance2 < least and taken[j] == 0:
                least = distance2
                nearest = j
    return nearest
