"""Kernel: propose similarity transforms from similar triangles, and test each sequentially.

Every triangle of P, in a given order, is compared with the triangles of Q of nearly its shape; each
such pair proposes a transform. A sequential test adds one neighbour after the other and refits the
transform, so that most false proposals are rejected after a few neighbours.

A fit is: number of pairs, mean of P (x, y), mean of Q, and, centred, Σ|p|², Σp·q, Σp×q.
"""

import cython

if cython.compiled:
    from cython.cimports.fpmatch.pointset._grid_kernel import CellGrid
    from cython.cimports.libc.math import expm1, log
else:
    from math import expm1, log

    from fpmatch.pointset._grid_kernel import CellGrid

COMPILED = cython.compiled

WIDEST = cython.declare(cython.double, 6.0)  # most by which a fit's uncertainty widens reach²
MIN_CHANCE = cython.declare(cython.double, 1e-300)  # of a hit, where the tolerance is tiny


@cython.ccall
def propose(
    p: cython.double[:, ::1],
    order: cython.Py_ssize_t[::1],
    corner_p: cython.int[:, ::1],
    shape_p: cython.double[:, ::1],
    ring_start: cython.const[cython.int][::1],
    ring: cython.const[cython.int][::1],
    q: cython.double[:, ::1],
    grid: CellGrid,
    corner_q: cython.int[:, ::1],
    side_q: cython.double[::1],
    shapes: CellGrid,
    shape_tolerance: cython.double,
    widest: cython.double,
    reach2: cython.double,
    gain: cython.double[::1],
    miss: cython.double,
    reject: cython.double,
    accept: cython.double,
    accept_small: cython.double,
    test_length: cython.Py_ssize_t,
    seen: cython.int[::1],
    neighbours: cython.int[::1],
    max_proposals: cython.long,
    fit: cython.double[::1],
    state: cython.long[::1],
) -> cython.bint:
    """Continue the search until a proposal passes its test; return whether one did.

    ``grid`` holds Q's points, ``shapes`` the shapes of its triangles. ``state`` holds the position
    in ``order``, the number of triangles of Q compared there, that of pairs of triangles tested,
    and the stamp of ``seen``. The test, of log-likelihood ratios, ends under `reject` and over
    `accept`; where P has fewer neighbours than `test_length`, `accept_small` suffices; ``gain``
    and `miss` come from `hit_log_likelihoods`. ``fit`` receives the fit to as many points as
    ``neighbours`` holds.
    """
    cython.declare(
        o=cython.Py_ssize_t, k=cython.Py_ssize_t, e=cython.Py_ssize_t, j=cython.Py_ssize_t,
        row=cython.Py_ssize_t, met=cython.long, count=cython.Py_ssize_t, low_column=cython.int,
        end_column=cython.int, stamp=cython.int,
    )  # fmt: skip
    stamp = cython.cast(cython.int, state[3])
    if test_length > neighbours.shape[0]:
        test_length = neighbours.shape[0]
    for o in range(state[0], order.shape[0]):
        k = order[o]
        zx = shape_p[0, k]
        zy = shape_p[1, k]
        count = -1
        met = 0
        low_column = shapes.column(zx - widest)
        end_column = shapes.column(zx + widest) + 1
        for row in range(shapes.row(zy - widest), shapes.row(zy + widest) + 1):
            for e in range(
                shapes.start[row * shapes.columns + low_column],
                shapes.start[row * shapes.columns + end_column],
            ):
                met += 1
                if o == state[0] and met <= state[1]:
                    continue
                dx = shapes.x[e] - zx
                dy = shapes.y[e] - zy
                j = shapes.order[e]
                limit = shape_tolerance / side_q[j]
                if dx * dx + dy * dy > limit * limit:
                    continue
                if state[2] >= max_proposals:
                    return False
                state[2] += 1
                if count < 0:
                    stamp += 1
                    count = _find_neighbours(
                        corner_p, k, ring_start, ring, seen, stamp, test_length, neighbours
                    )
                _fit_corners(p, corner_p, k, q, corner_q, j, fit)
                ratio = _grow(p, grid, neighbours, count, reach2, gain, miss, reject, accept, fit)
                if ratio < accept and (ratio < accept_small or count >= test_length):
                    continue
                stamp += 1
                count = _find_neighbours(
                    corner_p, k, ring_start, ring, seen, stamp, neighbours.shape[0], neighbours
                )
                _fit_corners(p, corner_p, k, q, corner_q, j, fit)
                _grow(p, grid, neighbours, count, reach2, gain, miss, -1e300, 1e300, fit)
                state[0] = o
                state[1] = met
                state[3] = stamp
                return True
    return False


@cython.cfunc
@cython.exceptval(check=False)
def _find_neighbours(
    corner: cython.int[:, ::1],
    k: cython.Py_ssize_t,
    ring_start: cython.const[cython.int][::1],
    ring: cython.const[cython.int][::1],
    seen: cython.int[::1],
    stamp: cython.int,
    limit: cython.Py_ssize_t,
    neighbours: cython.int[::1],
) -> cython.Py_ssize_t:
    """Write the points around a triangle breadth-first, without its corners; return how many."""
    cython.declare(n=cython.Py_ssize_t, at=cython.Py_ssize_t, e=cython.Py_ssize_t, i=cython.int)
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


@cython.cfunc
@cython.exceptval(check=False)
def _fit_corners(
    p: cython.double[:, ::1],
    corner_p: cython.int[:, ::1],
    k: cython.Py_ssize_t,
    q: cython.double[:, ::1],
    corner_q: cython.int[:, ::1],
    j: cython.Py_ssize_t,
    fit: cython.double[::1],
) -> cython.void:
    """Start a fit with the corners of two triangles."""
    cython.declare(r=cython.Py_ssize_t)
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


@cython.cfunc
@cython.exceptval(check=False)
def _grow(
    p: cython.double[:, ::1],
    grid: CellGrid,
    neighbours: cython.int[::1],
    count: cython.Py_ssize_t,
    reach2: cython.double,
    gain: cython.double[::1],
    miss: cython.double,
    reject: cython.double,
    accept: cython.double,
    fit: cython.double[::1],
) -> cython.double:
    """Add one neighbour after the other to the fit where it has a partner; return the test's ratio.

    The partner is sought within √reach2, and farther by the fit's own uncertainty there. The
    log-likelihood ratio of a true transform to a false one is the sum of ``gain``, by the area of
    that reach, for each neighbour with a partner, and of `miss` for the others.
    """
    cython.declare(n=cython.Py_ssize_t, i=cython.int, at=cython.int)
    size = fit[0]
    pmx = fit[1]
    pmy = fit[2]
    qmx = fit[3]
    qmy = fit[4]
    spread = fit[5]
    cosine = fit[6]
    sine = fit[7]
    one_of = 1.0 / size
    one_spread = 1.0 / spread
    wc = cosine * one_spread
    ws = sine * one_spread
    ratio = 0.0
    widest = WIDEST - 1.0
    steps = (gain.shape[0] - 1) / widest
    for n in range(count):
        i = neighbours[n]
        px = p[0, i] - pmx
        py = p[1, i] - pmy
        x = qmx + wc * px - ws * py
        y = qmy + ws * px + wc * py
        if x < grid.x0 or y < grid.y0 or x > grid.x1 or y > grid.y1:
            continue
        wider = one_of + (px * px + py * py) * one_spread
        if wider > widest:
            wider = widest
        at = grid.nearest(x, y, reach2 * (1.0 + wider))
        if at < 0:
            ratio += miss
            if ratio < reject:
                break
            continue
        ratio += gain[cython.cast(cython.Py_ssize_t, wider * steps)]
        # means and centred sums with one pair more
        shrink = size / (size + 1.0)
        size += 1.0
        one_of = 1.0 / size
        qx = grid.x[at] - qmx
        qy = grid.y[at] - qmy
        pmx += px * one_of
        pmy += py * one_of
        qmx += qx * one_of
        qmy += qy * one_of
        spread += shrink * (px * px + py * py)
        cosine += shrink * (px * qx + py * qy)
        sine += shrink * (px * qy - py * qx)
        one_spread = 1.0 / spread
        wc = cosine * one_spread
        ws = sine * one_spread
        if ratio > accept:
            break
    fit[0] = size
    fit[1] = pmx
    fit[2] = pmy
    fit[3] = qmx
    fit[4] = qmy
    fit[5] = spread
    fit[6] = cosine
    fit[7] = sine
    return ratio


@cython.ccall
def hit_log_likelihoods(
    expected: cython.double, share: cython.double, gain: cython.double[::1]
) -> cython.double:
    """Write the log-likelihood ratios of a neighbour with a partner; return that of one without.

    A true transform brings `share` of the neighbours onto points of Q, a false one does so by
    chance. ``gain`` has steps for reaches of 1 to `WIDEST` times reach2 in area; `expected` points
    of Q are within reach2.
    """
    cython.declare(k=cython.Py_ssize_t, steps=cython.double)
    steps = gain.shape[0] - 1
    for k in range(gain.shape[0]):
        chance = -expm1(-expected * (1.0 + (WIDEST - 1.0) * k / steps))
        if chance < MIN_CHANCE:
            chance = MIN_CHANCE
        gain[k] = log((share + (1.0 - share) * chance) / chance)
    return log(1.0 - share)
