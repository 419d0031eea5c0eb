"""Kernel: propose similarity transforms from similar triangles, and test each sequentially.

Every triangle of P, in a given order, is compared with the triangles of Q of nearly its shape; each
such pair proposes a transform. A sequential test adds one neighbour after the other and refits the
transform, so that most false proposals are rejected after a few neighbours.

A fit is: number of pairs, mean of P (x, y), mean of Q, and, centred, Σ|p|², Σp·q, Σp×q.
"""

import cython

if cython.compiled:
    from cython.cimports.libc.math import expm1, log
else:
    from math import expm1, log


COMPILED = cython.compiled

WIDEST = 6.0  # most by which a fit's uncertainty widens reach²
MIN_CHANCE = cython.declare(cython.double, 1e-300)  # of a hit, where the tolerance is tiny


def propose(
    p, order, corner_p, shape_p, ring_start, ring, q, grid, corner_q, side_q, shapes,
    shape_tolerance, widest, reach2, gain, miss, reject, accept, accept_small, test_length, seen,
    neighbours, max_proposals, fit, state,
):  # fmt: skip
    """Continue the search until a proposal passes its test; return whether one did.

    ``grid`` holds Q's points, ``shapes`` the shapes of its triangles. ``state`` holds the position
    in ``order``, the number of triangles of Q compared there, that of pairs of triangles tested,
    and the stamp of ``seen``. The test, of log-likelihood ratios, ends under `reject` and over
    `accept`; where P has fewer neighbours than `test_length`, `accept_small` suffices; ``gain``
    and `miss` come from `hit_log_likelihoods`. ``fit`` receives the fit to as many points as
    ``neighbours`` holds.
    """
    stamp = state[3]
    if test_length > neighbours.shape[0]:
        test_length = neighbours.shape[0]
    for o in range(state[0], order.shape[0]):
        k = order[o]
        zx, zy = shape_p[0, k], shape_p[1, k]
        count = -1
        met = 0
        left, top, right, bottom = shapes.around(zx, zy, widest)
        for row in range(top, bottom):
            for e in range(
                shapes.start[row * shapes.columns + left],
                shapes.start[row * shapes.columns + right],
            ):
                met += 1
                if o == state[0] and met <= state[1]:
                    continue
                dx, dy = shapes.x[e] - zx, shapes.y[e] - zy
                j = shapes.order[e]
                limit = shape_tolerance / side_q[j]
                if dx * dx + dy * dy > limit * limit:
                    continue
                if state[2] >= max_proposals:
                    return False
                state[2] += 1
                if count < 0:
                    stamp += 1
                    count = find_neighbours(
                        corner_p, k, ring_start, ring, seen, stamp, test_length, neighbours
                    )
                _fit_corners(p, corner_p, k, q, corner_q, j, fit)
                ratio = _grow(p, grid, neighbours, count, reach2, gain, miss, reject, accept, fit)
                if ratio < accept and (ratio < accept_small or count >= test_length):
                    continue
                stamp += 1
                count = find_neighbours(
                    corner_p, k, ring_start, ring, seen, stamp, neighbours.shape[0], neighbours
                )
                _fit_corners(p, corner_p, k, q, corner_q, j, fit)
                _grow(p, grid, neighbours, count, reach2, gain, miss, -1e300, 1e300, fit)
                state[0], state[1], state[3] = o, met, stamp
                return True
    return False


def find_neighbours(corner, k, ring_start, ring, seen, stamp, limit, neighbours):
    """Write the points around a triangle breadth-first, without its corners; return how many."""
    for at in range(3):
        seen[corner[k, at]] = stamp
    n = 0
    at = -3  # the corners come first
    while at < n < limit:
        i = corner[k, at + 3] if at < 0 else neighbours[at]
        at += 1
        for e in range(ring_start[i], ring_start[i + 1]):
            if seen[ring[e]] != stamp and n < limit:
                seen[ring[e]] = stamp
                neighbours[n] = ring[e]
                n += 1
    return n


def _fit_corners(p, corner_p, k, q, corner_q, j, fit):
    """Start a fit with the corners of two triangles."""
    fit[0] = 3.0
    for r in range(1, 8):
        fit[r] = 0.0
    for r in range(3):
        fit[1] += p[0, corner_p[k, r]] / 3.0
        fit[2] += p[1, corner_p[k, r]] / 3.0
        fit[3] += q[0, corner_q[j, r]] / 3.0
        fit[4] += q[1, corner_q[j, r]] / 3.0
    for r in range(3):
        px = p[0, corner_p[k, r]] - fit[1]
        py = p[1, corner_p[k, r]] - fit[2]
        qx = q[0, corner_q[j, r]] - fit[3]
        qy = q[1, corner_q[j, r]] - fit[4]
        fit[5] += px * px + py * py
        fit[6] += px * qx + py * qy
        fit[7] += px * qy - py * qx


def _grow(p, grid, neighbours, count, reach2, gain, miss, reject, accept, fit):
    """Add one neighbour after the other to the fit where it has a partner; return the test's ratio.

    The partner is sought within √reach2, and farther by the fit's own uncertainty there. The
    log-likelihood ratio of a true transform to a false one is the sum of ``gain``, by the area of
    that reach, for each neighbour with a partner, and of `miss` for the others.
    """
    size, pmx, pmy, qmx, qmy = fit[0], fit[1], fit[2], fit[3], fit[4]
    spread, cosine, sine = fit[5], fit[6], fit[7]
    one_of, one_spread = 1.0 / size, 1.0 / spread
    wc, ws = cosine * one_spread, sine * one_spread
    ratio = 0.0
    widest = WIDEST - 1.0
    steps = (gain.shape[0] - 1) / widest
    for n in range(count):
        i = neighbours[n]
        px, py = p[0, i] - pmx, p[1, i] - pmy
        x, y = qmx + wc * px - ws * py, qmy + ws * px + wc * py
        if x < grid.x0 or y < grid.y0 or x > grid.x1 or y > grid.y1:
            continue
        wider = min(one_of + (px * px + py * py) * one_spread, widest)
        at = grid.nearest(x, y, reach2 * (1.0 + wider))
        if at < 0:
            ratio += miss
            if ratio < reject:
                break
            continue
        step = int(wider * steps)
        ratio += gain[step]
        # means and centred sums with one pair more
        shrink = size / (size + 1.0)
        size += 1.0
        one_of = 1.0 / size
        qx, qy = grid.x[at] - qmx, grid.y[at] - qmy
        pmx += px * one_of
        pmy += py * one_of
        qmx += qx * one_of
        qmy += qy * one_of
        spread += shrink * (px * px + py * py)
        cosine += shrink * (px * qx + py * qy)
        sine += shrink * (px * qy - py * qx)
        one_spread = 1.0 / spread
        wc, ws = cosine * one_spread, sine * one_spread
        if ratio > accept:
            break
    fit[0], fit[1], fit[2], fit[3], fit[4] = size, pmx, pmy, qmx, qmy
    fit[5], fit[6], fit[7] = spread, cosine, sine
    return ratio


def hit_log_likelihoods(expected, share, gain):
    """Write the log-likelihood ratios of a neighbour with a partner; return that of one without.

    A true transform brings `share` of the neighbours onto points of Q, a false one does so by
    chance. ``gain`` has steps for reaches of 1 to `WIDEST` times reach2 in area; `expected` points
    of Q are within reach2.
    """
    steps = gain.shape[0] - 1
    for k in range(gain.shape[0]):
        chance = max(-expm1(-expected * (1.0 + (WIDEST - 1.0) * k / steps)), MIN_CHANCE)
        gain[k] = log((share + (1.0 - share) * chance) / chance)
    return log(1.0 - share)
