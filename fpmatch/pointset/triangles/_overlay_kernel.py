"""Kernel: overlay two point sets by a transform, refit and re-pair, and judge what matches.

A move is (s·cos θ, s·sin θ, tx, ty). Q lies in a grid of cells, and its points are named in the
order of the cells. Interpreted, the functions run as they stand.
"""

import cython

if cython.compiled:
    from cython.cimports.fpmatch.pointset._grid_kernel import CellGrid
    from cython.cimports.libc.math import expm1, log, log1p, sqrt
else:
    from math import expm1, log, log1p, sqrt

    from fpmatch.pointset._grid_kernel import CellGrid

COMPILED = cython.compiled

REACHES = cython.declare(cython.int, 8)  # at which the pairs are judged, each half the one before


@cython.ccall
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
def refine(
    p: cython.double[:, ::1],
    grid: CellGrid,
    t2: cython.double,
    most_rounds: cython.int,
    owner: cython.int[::1],
    partner: cython.int[::1],
    distance2: cython.double[::1],
    move: cython.double[::1],
) -> cython.int:
    """Pair each point with the nearest and refit, by turns, until the number of pairs stays.

    The first round reaches twice as far, in area. ``move`` is refitted in place; ``partner``
    receives the point of Q of each of P or -1, ``distance2`` its squared distance, and
    ``owner`` the way back. Returned are the points of P that fall on the grid, or -1 where
    fewer than three have partners or these do not fix a transform.
    """
    i: cython.Py_ssize_t
    at: cython.int
    held: cython.int
    round_: cython.int
    pairs: cython.int
    before: cython.int = -1
    inside: cython.int = 0
    x: cython.double
    y: cython.double
    reach2: cython.double
    for round_ in range(most_rounds):
        reach2 = 2.0 * t2 if round_ == 0 else t2
        inside = 0
        pairs = 0
        for i in range(owner.shape[0]):
            owner[i] = -1
        for i in range(p.shape[1]):
            partner[i] = -1
            x = move[2] + move[0] * p[0, i] - move[1] * p[1, i]
            y = move[3] + move[1] * p[0, i] + move[0] * p[1, i]
            if x < grid.x0 or y < grid.y0 or x > grid.x1 or y > grid.y1:
                continue
            inside += 1
            at = grid.nearest(x, y, reach2)
            if at < 0:
                continue
            x -= grid.x[at]
            y -= grid.y[at]
            distance2[i] = x * x + y * y
            held = owner[at]
            if held >= 0:
                if distance2[held] <= distance2[i]:
                    continue
                partner[held] = -1
                pairs -= 1
            owner[at] = cython.cast(cython.int, i)
            partner[i] = at
            pairs += 1
        if pairs < 3:
            return -1
        if round_ > 0 and pairs == before:
            break
        before = pairs
        if not fit(p, grid, partner, move):
            return -1
    return inside


@cython.ccall
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
def fit(
    p: cython.double[:, ::1],
    grid: CellGrid,
    partner: cython.int[::1],
    move: cython.double[::1],
) -> cython.bint:
    """Fit the move to the pairs by least squares; return whether they fix one."""
    i: cython.Py_ssize_t
    at: cython.int
    pairs: cython.int = 0
    px: cython.double = 0.0
    py: cython.double = 0.0
    qx: cython.double = 0.0
    qy: cython.double = 0.0
    spread: cython.double = 0.0
    cosine: cython.double = 0.0
    sine: cython.double = 0.0
    dx: cython.double
    dy: cython.double
    ex: cython.double
    ey: cython.double
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
    px /= pairs
    py /= pairs
    qx /= pairs
    qy /= pairs
    for i in range(p.shape[1]):
        at = partner[i]
        if at >= 0:
            dx = p[0, i] - px
            dy = p[1, i] - py
            ex = grid.x[at] - qx
            ey = grid.y[at] - qy
            spread += dx * dx + dy * dy
            cosine += dx * ex + dy * ey
            sine += dx * ey - dy * ex
    if spread <= 0.0 or (cosine == 0.0 and sine == 0.0):
        return False
    move[0] = cosine / spread
    move[1] = sine / spread
    move[2] = qx - move[0] * px + move[1] * py
    move[3] = qy - move[1] * px - move[0] * py
    return True


@cython.ccall
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
def log_chance(
    partner: cython.int[::1],
    distance2: cython.double[::1],
    inside: cython.int,
    t2: cython.double,
    density: cython.double,
) -> cython.double:
    """Return the log of the probability that so many of the points inside have partners by chance.

    By Chernoff's bound on the binomial tail, at reaches of t, t/2, t/4 and so on, of which the
    most telling counts, at its share of the significance: near pairs tell more than far ones, and
    few exact ones as much as many rough ones.
    """
    i: cython.Py_ssize_t
    part: cython.int
    pairs: cython.int
    trials: cython.double = inside - 2.0
    reach2: cython.double = t2
    share: cython.double
    chance: cython.double
    value: cython.double
    best: cython.double = 0.0
    for part in range(REACHES):
        pairs = 0
        for i in range(partner.shape[0]):
            if partner[i] >= 0 and distance2[i] <= reach2:
                pairs += 1
        if pairs < 3:
            break
        # two pairs are used up by the transform
        share = (pairs - 2.0) / trials if trials > 0.0 else 0.0
        chance = -expm1(-3.141592653589793 * density * reach2)
        if share > chance > 0.0:
            value = share * log(share / chance)
            if share < 1.0:
                value += (1.0 - share) * (log1p(-share) - log1p(-chance))
            value = log(REACHES) - trials * value
            if value < best:
                best = value
        reach2 *= 0.25
    return best


@cython.ccall
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
def list_pairs(
    p: cython.double[:, ::1],
    grid: CellGrid,
    partner: cython.int[::1],
    move: cython.double[::1],
    pairs: cython.int[:, ::1],
) -> cython.double:
    """List the pairs, with points of Q as they were given; return their rms distance."""
    i: cython.Py_ssize_t
    at: cython.int
    count: cython.Py_ssize_t = 0
    x: cython.double
    y: cython.double
    total: cython.double = 0.0
    for i in range(p.shape[1]):
        at = partner[i]
        if at >= 0:
            x = move[2] + move[0] * p[0, i] - move[1] * p[1, i] - grid.x[at]
            y = move[3] + move[1] * p[0, i] + move[0] * p[1, i] - grid.y[at]
            total += x * x + y * y
            pairs[count, 0] = cython.cast(cython.int, i)
            pairs[count, 1] = grid.order[at]
            count += 1
    return sqrt(total / count) if count > 0 else 0.0


@cython.ccall
@cython.boundscheck(False)
@cython.wraparound(False)
def count_pairs(partner: cython.int[::1]) -> cython.int:
    """Return how many points have a partner."""
    i: cython.Py_ssize_t
    count: cython.int = 0
    for i in range(partner.shape[0]):
        count += partner[i] >= 0
    return count
