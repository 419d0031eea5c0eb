# mypy: ignore-errors
"""Kernel: overlay two point sets by a transform, refine it, and compute its significance.

A move is (s·cos θ, s·sin θ, tx, ty) of eq. (1). Q is a grid; indices of its
points are in the order of its cells.
"""

import cython

if cython.compiled:
    from cython.cimports.fpmatch.lab.points.triangles._partner_fit_kernel import fit_partners
    from cython.cimports.libc.math import expm1, log, log1p, sqrt
else:
    from math import expm1, log, log1p, sqrt

    from fpmatch.lab.points.triangles._partner_fit_kernel import fit_partners

COMPILED = cython.compiled

FLAT = cython.declare(cython.double, 0.2)  # of second moments: points along a line


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
        if pairs <= 2:
            return -1
        if round_ > 0 and pairs == before:
            break
        before = pairs
        if not fit_partners(p, grid, partner, move):
            return -1
    return inside


def _moved(move, x, y):
    """Return the point (x, y) moved."""
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


def uniform_rates(density, t2, rate):
    """Write the probability of a point at t, t/2, t/4 and so on, of `density` points to an area."""
    reach2 = t2
    for part in range(rate.shape[0]):
        rate[part] = -expm1(-3.141592653589793 * density * reach2)
        reach2 *= 0.25


def log_chance(partner, distance2, inside, t2, rate):
    """Return the log of the probability that so many of the points inside have partners by chance.

    Chernoff's bound on the binomial tail, at reaches of t, t/2, t/4 and so on, where a point finds
    one with the probability `rate`; the least counts, corrected for the number of reaches. So near
    pairs are more significant than far ones, and a few exact ones as significant as many rough
    ones. Two pairs determine the transform.
    """
    trials: cython.double = inside - 2
    reach2 = t2
    best = 0.0
    for part in range(rate.shape[0]):
        pairs: cython.int = 0
        for i in range(partner.shape[0]):
            if partner[i] >= 0 and distance2[i] <= reach2:
                pairs += 1
        if pairs <= 2:
            break
        share = (pairs - 2) / trials if trials > 0.0 else 0.0
        chance = rate[part]
        if share > chance > 0.0:
            value = share * log(share / chance)
            if share < 1.0:
                value += (1.0 - share) * (log1p(-share) - log1p(-chance))
            value = log(rate.shape[0]) - trials * value
            if value < best:
                best = value
        reach2 *= 0.25
    return best


@cython.locals(i=cython.Py_ssize_t, most=cython.int)
def local_rates(p, grid, move, partner, every, reach2, t2, near, distance2, each, rate):
    """Write the probability that a point finds one of Q by chance, from the points around it.

    For every `every`-th moved point inside the grid, that is ``each[:, k]``, at t, t/2, t/4 and so
    on; ``rate`` receives their means. The density is that of an ellipse: the second moments of the
    nearest points, without the partner, around the moved point. No axis is shorter than half a
    reach; points along a line count by its length. Return the number of columns written.
    """
    count: cython.int = 0
    most = near.shape[0]
    for part in range(rate.shape[0]):
        rate[part] = 0.0
    for i in range(0, p.shape[1], every):
        x, y = _moved(move, p[0, i], p[1, i])
        if x < grid.x0 or y < grid.y0 or x > grid.x1 or y > grid.y1:
            continue
        found: cython.int = grid.within(x, y, reach2, most, near, distance2, 0)
        others = sxx = sxy = syy = farthest2 = 0.0
        for k in range(found):
            if near[k] != partner[i] and others < most - 1:
                dx, dy = grid.x[near[k]] - x, grid.y[near[k]] - y
                others += 1.0
                sxx += dx * dx
                sxy += dx * dy
                syy += dy * dy
                farthest2 = distance2[k]
        if others < 3.0:
            others += 1.0
            trace, det = 0.5 * reach2, 0.0625 * reach2 * reach2
        else:
            trace, det = (sxx + syy) / others, (sxx * syy - sxy * sxy) / (others * others)
        r2 = t2
        for part in range(rate.shape[0]):
            spread = sqrt(max(det, 0.0) + 0.25 * r2 * trace + 0.0625 * r2 * r2)
            expected = others * r2 / (4.0 * spread)
            if 4.0 * det < FLAT * trace * trace:
                expected = max(expected, others * sqrt(r2 / farthest2))
            each[part, count] = -expm1(-expected)
            rate[part] += each[part, count]
            r2 *= 0.25
        count += 1
    for part in range(rate.shape[0]):
        if count > 0:
            rate[part] /= count
    return count


@cython.locals(
    e=cython.Py_ssize_t,
    i=cython.Py_ssize_t,
    j=cython.Py_ssize_t,
    k=cython.Py_ssize_t,
    kept=cython.int,
    first=cython.int,
    c=cython.int,
    d=cython.int,
)
def rival_moves(
    p, grid, partner, i, best, q, q_ring_start, q_ring, move, shifts, within, apart, moves, first,
):  # fmt: skip
    """Write moves that compete with `move`, from row `first` of ``moves`` on; return how many.

    The first are `move`, shifted from the partner of point i to its neighbours in Q, at most
    `shifts`. The others map point i and the point `best` onto other edges of Q as long: lengths
    differ by less than `within`; the most alike are written, at most as many as ``apart`` has
    entries.
    """
    px, py = p[0, best] - p[0, i], p[1, best] - p[1, i]
    nearest2 = px * px + py * py
    a, b = grid.order[partner[i]], grid.order[partner[best]]
    dx, dy = q[0, b] - q[0, a], q[1, b] - q[1, a]
    length2 = dx * dx + dy * dy
    length = sqrt(length2)
    least, most = length - within, length + within
    least2, most2 = least * least if least > 0.0 else 0.0, most * most
    begin = first
    for e in range(q_ring_start[a], min(q_ring_start[a] + shifts, q_ring_start[a + 1])):
        d = q_ring[e]
        moves[first, 0], moves[first, 1] = move[0], move[1]
        moves[first, 2] = move[2] + q[0, d] - q[0, a]
        moves[first, 3] = move[3] + q[1, d] - q[1, a]
        first += 1
    kept = 0
    for c in range(q.shape[1]):
        for e in range(q_ring_start[c], q_ring_start[c + 1]):
            d = q_ring[e]
            dx, dy = q[0, d] - q[0, c], q[1, d] - q[1, c]
            side2 = dx * dx + dy * dy
            if side2 < least2 or side2 > most2 or (c == a and d == b):
                continue
            off = side2 - length2 if side2 > length2 else length2 - side2
            if kept == apart.shape[0] and off >= apart[kept - 1]:
                continue
            if kept < apart.shape[0]:
                kept += 1
            k = kept - 1
            while k > 0 and apart[k - 1] > off:
                apart[k] = apart[k - 1]
                for m in range(4):
                    moves[first + k, m] = moves[first + k - 1, m]
                k -= 1
            apart[k] = off
            u, v = (px * dx + py * dy) / nearest2, (px * dy - py * dx) / nearest2
            moves[first + k, 0], moves[first + k, 1] = u, v
            moves[first + k, 2] = q[0, c] - u * p[0, i] + v * p[1, i]
            moves[first + k, 3] = q[1, c] - v * p[0, i] - u * p[1, i]
    return first + kept - begin


@cython.locals(i=cython.Py_ssize_t, k=cython.Py_ssize_t, inside=cython.int)
def has_rival(p, grid, t2, rate, needed, moves, known, owner, partner, distance2, visits):
    """Return whether a move other than the `known` one pairs more than chance does.

    ``known`` holds the partners of the points of `p` under the known move; the log chance of a
    rival is less than `needed`.
    """
    for k in range(moves.shape[0]):
        inside = refine(p, grid, t2, 1, owner, partner, distance2, visits, moves[k])
        if inside < 0 or log_chance(partner, distance2, inside, t2, rate) >= needed:
            continue
        pairs: cython.int = 0
        common: cython.int = 0
        for i in range(p.shape[1]):
            if partner[i] >= 0:
                pairs += 1
                if partner[i] == known[i]:
                    common += 1
        if 2 * common < pairs:
            return True
    return False


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
