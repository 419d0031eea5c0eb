# mypy: ignore-errors
"""Kernel: overlay two point sets by a transform, refine it, and compute its significance.

A move is a similarity transform of four values or an affine one of six, as in
`fpmatch.lab.points.triangles._partner_fit_kernel`. Q is a grid; indices of its points are in the
order of its cells.
"""

import cython

if cython.compiled:
    from cython.cimports.fpmatch.lab.points.triangles._partner_fit_kernel import fit_partners
    from cython.cimports.libc.math import expm1, log, log1p, sqrt
else:
    from math import expm1, log, log1p, sqrt

    from fpmatch.lab.points.triangles._partner_fit_kernel import fit_partners

COMPILED = cython.compiled

REACHES = cython.declare(cython.int, 8)  # at which pairs are counted, each half the one before


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
            x, y = _moved(move, p[0, i], p[1, i])
            if x < grid.x0 or y < grid.y0 or x > grid.x1 or y > grid.y1:
                continue
            inside += 1
            pairs += _claim(grid, x, y, reach2, i, owner, partner, distance2)
        if 2 * pairs <= move.shape[0]:
            return -1
        if round_ > 0 and pairs == before:
            break
        before = pairs
        if not fit_partners(p, grid, partner, move):
            return -1
    return inside


def _moved(move, x, y):
    """Return the point (x, y) moved."""
    if move.shape[0] == 6:
        return move[0] * x + move[1] * y + move[2], move[3] * x + move[4] * y + move[5]
    return move[2] + move[0] * x - move[1] * y, move[3] + move[1] * x + move[0] * y


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


def log_chance(partner, distance2, inside, t2, density, determined=2):
    """Return the log of the probability that so many of the points inside have partners by chance.

    Chernoff's bound on the binomial tail, at reaches of t, t/2, t/4 and so on; the least counts,
    corrected for the number of reaches. So near pairs are more significant than far ones, and a
    few exact ones as significant as many rough ones. The transform is `determined` by two pairs,
    or by three where it is affine.
    """
    trials: cython.double = inside - determined
    reach2 = t2
    best = 0.0
    for part in range(REACHES):
        pairs: cython.int = 0
        for i in range(partner.shape[0]):
            if partner[i] >= 0 and distance2[i] <= reach2:
                pairs += 1
        if pairs <= determined:
            break
        share = (pairs - determined) / trials if trials > 0.0 else 0.0
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


def list_pairs(p, grid, partner, move, pairs):
    """Write the pairs, with indices of Q as given; return their rms distance."""
    count = 0
    total = 0.0
    for i in range(p.shape[1]):
        at = partner[i]
        if at >= 0:
            x, y = _moved(move, p[0, i], p[1, i])
            x, y = x - grid.x[at], y - grid.y[at]
            total += x * x + y * y
            pairs[count, 0], pairs[count, 1] = i, grid.order[at]
            count += 1
    return sqrt(total / count) if count > 0 else 0.0
