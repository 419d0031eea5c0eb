"""Kernel: propose similarity transforms from alike triangles, and test each as it grows.

Every triangle of P, in a given order, meets the triangles of Q that its shape could have become;
each such pair proposes a transform, which has to hold for one neighbour after the other in a
sequential test, refitted as it grows, so that a false one is given up after a few. Interpreted,
the functions run as they stand.
"""

import cython

if cython.compiled:
    from cython.cimports.fpmatch.pointset._grid_kernel import CellGrid
    from cython.cimports.libc.math import expm1, log
else:
    from math import expm1, log

    from fpmatch.pointset._grid_kernel import CellGrid

COMPILED = cython.compiled

WIDEST = cython.declare(cython.double, 6.0)  # times reach²: a young fit is uncertain, not lost
LEAST_CHANCE = cython.declare(cython.double, 1e-300)  # of a tolerance of next to nothing


@cython.ccall
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
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
    give_up: cython.double,
    pass_on: cython.double,
    pass_small: cython.double,
    test_length: cython.Py_ssize_t,
    seen: cython.int[::1],
    company: cython.int[::1],
    most: cython.long,
    fit: cython.double[::1],
    state: cython.long[::1],
) -> cython.bint:
    """Go on with the search until a proposal passes its test; return whether one did.

    ``grid`` holds Q's points by place, ``shapes`` its triangles by shape. ``state`` says where the
    search stands: place in ``order``, triangles of Q met there, pairs of triangles tested, stamp
    of ``seen``. The test, of log-likelihood ratios, ends under `give_up` and over `pass_on`; where
    P has no more neighbours to ask, `pass_small` is enough; ``gain`` and `miss` come from
    `hit_log_likelihoods`. ``fit`` receives the transform, grown
    over as many points as ``company`` holds: see `_fit_corners`.
    """
    o: cython.Py_ssize_t
    k: cython.Py_ssize_t
    e: cython.Py_ssize_t
    j: cython.Py_ssize_t
    row: cython.Py_ssize_t
    met: cython.long
    around: cython.Py_ssize_t
    low_column: cython.int
    high_column: cython.int
    low_row: cython.int
    high_row: cython.int
    stamp: cython.int = cython.cast(cython.int, state[3])
    zx: cython.double
    zy: cython.double
    dx: cython.double
    dy: cython.double
    limit: cython.double
    ratio: cython.double
    if test_length > company.shape[0]:
        test_length = company.shape[0]
    for o in range(state[0], order.shape[0]):
        k = order[o]
        zx = shape_p[0, k]
        zy = shape_p[1, k]
        around = -1
        met = 0
        low_column = shapes.column(zx - widest)
        high_column = shapes.column(zx + widest)
        low_row = shapes.row(zy - widest)
        high_row = shapes.row(zy + widest)
        for row in range(low_row, high_row + 1):
            for e in range(
                shapes.start[row * shapes.columns + low_column],
                shapes.start[row * shapes.columns + high_column + 1],
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
                if state[2] >= most:
                    return False
                state[2] += 1
                if around < 0:
                    stamp += 1
                    around = _neighbours(
                        corner_p, k, ring_start, ring, seen, stamp, test_length, company
                    )
                _fit_corners(p, corner_p, k, q, corner_q, j, fit)
                ratio = _grow(p, grid, company, around, reach2, gain, miss, give_up, pass_on, fit)
                if ratio < pass_on and (ratio < pass_small or around >= test_length):
                    continue
                stamp += 1
                around = _neighbours(
                    corner_p, k, ring_start, ring, seen, stamp, company.shape[0], company
                )
                _fit_corners(p, corner_p, k, q, corner_q, j, fit)
                _grow(p, grid, company, around, reach2, gain, miss, -1e300, 1e300, fit)
                state[0] = o
                state[1] = met
                state[3] = stamp
                return True
    return False


@cython.cfunc
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.exceptval(check=False)
def _neighbours(
    corner: cython.int[:, ::1],
    k: cython.Py_ssize_t,
    ring_start: cython.const[cython.int][::1],
    ring: cython.const[cython.int][::1],
    seen: cython.int[::1],
    stamp: cython.int,
    limit: cython.Py_ssize_t,
    company: cython.int[::1],
) -> cython.Py_ssize_t:
    """Write the points around a triangle, nearer rings first, without its corners."""
    n: cython.Py_ssize_t = 0
    next_: cython.Py_ssize_t = 0
    r: cython.Py_ssize_t
    e: cython.Py_ssize_t
    i: cython.int
    for r in range(3):
        seen[corner[k, r]] = stamp
    for r in range(3):
        i = corner[k, r]
        for e in range(ring_start[i], ring_start[i + 1]):
            if seen[ring[e]] != stamp and n < limit:
                seen[ring[e]] = stamp
                company[n] = ring[e]
                n += 1
    while next_ < n < limit:
        i = company[next_]
        next_ += 1
        for e in range(ring_start[i], ring_start[i + 1]):
            if seen[ring[e]] != stamp and n < limit:
                seen[ring[e]] = stamp
                company[n] = ring[e]
                n += 1
    return n


@cython.cfunc
@cython.boundscheck(False)
@cython.wraparound(False)
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
    """Begin a least-squares fit with the corners of two triangles.

    A fit is: number of pairs, mean of P (x, y), mean of Q, and, centred, Σ|p|², Σp·q, Σp×q.
    """
    r: cython.Py_ssize_t
    px: cython.double
    py: cython.double
    qx: cython.double
    qy: cython.double
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
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
@cython.exceptval(check=False)
def _grow(
    p: cython.double[:, ::1],
    grid: CellGrid,
    company: cython.int[::1],
    around: cython.Py_ssize_t,
    reach2: cython.double,
    gain: cython.double[::1],
    miss: cython.double,
    give_up: cython.double,
    pass_on: cython.double,
    fit: cython.double[::1],
) -> cython.double:
    """Take one neighbour after the other into the fit where it has a partner; test as it grows.

    A neighbour is looked for within √reach2, and farther by the fit's own uncertainty there.
    Returned is the log-likelihood ratio of a true transform to a false one: ``gain``, by the area
    of that reach, for every neighbour with a partner (see `hit_log_likelihoods`), `miss` for the others.
    """
    n: cython.Py_ssize_t
    i: cython.int
    at: cython.int
    size: cython.double = fit[0]
    pmx: cython.double = fit[1]
    pmy: cython.double = fit[2]
    qmx: cython.double = fit[3]
    qmy: cython.double = fit[4]
    spread: cython.double = fit[5]
    cosine: cython.double = fit[6]
    sine: cython.double = fit[7]
    one_of: cython.double = 1.0 / size
    one_spread: cython.double = 1.0 / spread
    wc: cython.double = cosine * one_spread
    ws: cython.double = sine * one_spread
    px: cython.double
    py: cython.double
    qx: cython.double
    qy: cython.double
    x: cython.double
    y: cython.double
    wider: cython.double
    shrink: cython.double
    ratio: cython.double = 0.0
    widest: cython.double = WIDEST - 1.0
    steps: cython.double = (gain.shape[0] - 1) / widest
    for n in range(around):
        i = company[n]
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
            if ratio < give_up:
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
        if ratio > pass_on:
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
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
def hit_log_likelihoods(
    expected: cython.double, share: cython.double, gain: cython.double[::1]
) -> cython.double:
    """Write the log-likelihood ratios of a neighbour with a partner; return that of one without.

    A true transform brings `share` of the neighbours onto points of Q, a false one does so by
    chance. ``gain`` has steps for reaches of 1 to `WIDEST` times reach2 in area; `expected` points
    of Q are within reach2.
    """
    k: cython.Py_ssize_t
    steps: cython.double = gain.shape[0] - 1
    chance: cython.double
    for k in range(gain.shape[0]):
        chance = -expm1(-expected * (1.0 + (WIDEST - 1.0) * k / steps))
        if chance < LEAST_CHANCE:
            chance = LEAST_CHANCE
        gain[k] = log((share + (1.0 - share) * chance) / chance)
    return log(1.0 - share)
