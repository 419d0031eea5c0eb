"""Kernel: find the similarity transform between two point sets from alike Delaunay triangles.

A triangle's shape is the complex number z of its third corner once its longest side lies from 0
to 1. Triangles of Q are sorted by shape into square bins and points of Q into square cells. Each
triangle of P, the most telling first, meets the triangles of Q that its shape could have become;
each such pair proposes a transform, which has to hold for one neighbour after the other in a
sequential test, refitted as it grows; what passes is refitted and re-paired over all points.

Points are arrays (2, N). A move is (s·cos θ, s·sin θ, tx, ty). Interpreted, the functions run as
they stand.
"""

import cython

if cython.compiled:
    from cython.cimports.libc.math import exp, floor, log, sqrt
else:
    from math import exp, floor, log, sqrt

COMPILED = cython.compiled


@cython.ccall
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
def label_triangles(
    point: cython.double[:, ::1],
    triangle: cython.int[:, ::1],
    near_tie: cython.double,
    corner: cython.int[:, ::1],
    shape: cython.double[:, ::1],
) -> cython.Py_ssize_t:
    """Write each triangle from each side that is longest to within `near_tie`; return how many.

    ``corner[k]`` receives the ends of that side and the apex, counter-clockwise; ``shape[k]`` the
    real and imaginary part of z and the side's length.
    """
    k: cython.Py_ssize_t = 0
    i: cython.Py_ssize_t
    r: cython.Py_ssize_t
    a: cython.int
    b: cython.int
    c: cython.int
    dx: cython.double
    dy: cython.double
    ex: cython.double
    ey: cython.double
    side: cython.double
    longest: cython.double
    for i in range(triangle.shape[0]):
        longest = 0.0
        for r in range(3):
            a = triangle[i, r]
            b = triangle[i, (r + 1) % 3]
            dx = point[0, b] - point[0, a]
            dy = point[1, b] - point[1, a]
            side = dx * dx + dy * dy
            if side > longest:
                longest = side
        for r in range(3):
            a = triangle[i, r]
            b = triangle[i, (r + 1) % 3]
            c = triangle[i, (r + 2) % 3]
            dx = point[0, b] - point[0, a]
            dy = point[1, b] - point[1, a]
            side = dx * dx + dy * dy
            if side < longest * near_tie * near_tie or side <= 0.0:
                continue
            ex = point[0, c] - point[0, a]
            ey = point[1, c] - point[1, a]
            corner[k, 0] = a
            corner[k, 1] = b
            corner[k, 2] = c
            shape[k, 0] = (ex * dx + ey * dy) / side
            shape[k, 1] = (ey * dx - ex * dy) / side
            shape[k, 2] = sqrt(side)
            k += 1
    return k


@cython.ccall
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
def sort_into_cells(
    x: cython.double[::1],
    y: cython.double[::1],
    count: cython.Py_ssize_t,
    x0: cython.double,
    y0: cython.double,
    side: cython.double,
    columns: cython.int,
    rows: cython.int,
    start: cython.int[::1],
    member: cython.int[::1],
) -> cython.int:
    """Sort points into the cells of a grid; cell k holds ``member[start[k]:start[k + 1]]``."""
    i: cython.Py_ssize_t
    k: cython.int
    for i in range(columns * rows + 1):
        start[i] = 0
    for i in range(count):
        k = _cell(x[i], y[i], x0, y0, side, columns, rows)
        start[k + 1] += 1
    for i in range(columns * rows):
        start[i + 1] += start[i]
    for i in range(count - 1, -1, -1):
        k = _cell(x[i], y[i], x0, y0, side, columns, rows)
        start[k + 1] -= 1
        member[start[k + 1]] = cython.cast(cython.int, i)
    # the ends have become the starts, one cell late
    for i in range(columns * rows):
        start[i] = start[i + 1]
    start[columns * rows] = cython.cast(cython.int, count)
    return 0


@cython.cfunc
@cython.inline
@cython.cdivision(True)
@cython.exceptval(check=False)
def _cell(
    x: cython.double,
    y: cython.double,
    x0: cython.double,
    y0: cython.double,
    side: cython.double,
    columns: cython.int,
    rows: cython.int,
) -> cython.int:
    column: cython.int = cython.cast(cython.int, floor((x - x0) / side))
    row: cython.int = cython.cast(cython.int, floor((y - y0) / side))
    column = 0 if column < 0 else (columns - 1 if column >= columns else column)
    row = 0 if row < 0 else (rows - 1 if row >= rows else row)
    return row * columns + column


@cython.cfunc
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
@cython.exceptval(check=False)
def _nearest(
    q: cython.double[:, ::1],
    x: cython.double,
    y: cython.double,
    reach2: cython.double,
    grid: cython.double[::1],
    size: cython.int[::1],
    start: cython.int[::1],
    member: cython.int[::1],
) -> cython.int:
    """Return the point of Q nearest to (x, y) within the reach, or -1; ties go to the first."""
    reach: cython.double = sqrt(reach2)
    low_column: cython.int = cython.cast(cython.int, floor((x - reach - grid[0]) / grid[2]))
    high_column: cython.int = cython.cast(cython.int, floor((x + reach - grid[0]) / grid[2]))
    low_row: cython.int = cython.cast(cython.int, floor((y - reach - grid[1]) / grid[2]))
    high_row: cython.int = cython.cast(cython.int, floor((y + reach - grid[1]) / grid[2]))
    row: cython.int
    k: cython.int
    best: cython.int = -1
    closest: cython.double = reach2
    dx: cython.double
    dy: cython.double
    d2: cython.double
    if low_column < 0:
        low_column = 0
    if low_row < 0:
        low_row = 0
    if high_column >= size[0]:
        high_column = size[0] - 1
    if high_row >= size[1]:
        high_row = size[1] - 1
    if low_column > high_column:
        return -1
    for row in range(low_row, high_row + 1):
        for k in range(start[row * size[0] + low_column], start[row * size[0] + high_column + 1]):
            dx = q[0, member[k]] - x
            dy = q[1, member[k]] - y
            d2 = dx * dx + dy * dy
            if d2 < closest or (d2 == closest and best >= 0 and member[k] < best):
                closest = d2
                best = member[k]
    return best


@cython.cfunc
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.exceptval(check=False)
def _company(
    corner: cython.int[:, ::1],
    k: cython.Py_ssize_t,
    ring_start: cython.int[::1],
    ring: cython.int[::1],
    seen: cython.int[::1],
    stamp: cython.int,
    limit: cython.Py_ssize_t,
    company: cython.int[::1],
) -> cython.Py_ssize_t:
    """List up to `limit` points around a triangle, nearer rings first, without its corners."""
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
) -> cython.int:
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
    return 0


@cython.cfunc
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
@cython.exceptval(check=False)
def _grow(
    p: cython.double[:, ::1],
    q: cython.double[:, ::1],
    company: cython.int[::1],
    around: cython.Py_ssize_t,
    density: cython.double,
    t2: cython.double,
    share: cython.double,
    surely_not: cython.double,
    surely: cython.double,
    grid: cython.double[::1],
    size: cython.int[::1],
    cell_start: cython.int[::1],
    cell_member: cython.int[::1],
    fit: cython.double[::1],
) -> cython.double:
    """Take one neighbour after the other into the fit where it has a partner; test as it grows.

    A neighbour is looked for within what the tolerance and the fit's own uncertainty there allow.
    Returned is the log-likelihood ratio of a true transform, under which `share` of the points
    have partners, to a false one, under which Q's density alone decides.
    """
    n: cython.Py_ssize_t
    i: cython.int
    at: cython.int
    wc: cython.double
    ws: cython.double
    px: cython.double
    py: cython.double
    qx: cython.double
    qy: cython.double
    x: cython.double
    y: cython.double
    reach2: cython.double
    chance: cython.double
    shrink: cython.double
    ratio: cython.double = 0.0
    miss: cython.double = log(1.0 - share)
    for n in range(around):
        i = company[n]
        wc = fit[6] / fit[5]
        ws = fit[7] / fit[5]
        px = p[0, i] - fit[1]
        py = p[1, i] - fit[2]
        x = fit[3] + wc * px - ws * py
        y = fit[4] + ws * px + wc * py
        if x < grid[0] or y < grid[1] or x > grid[3] or y > grid[4]:
            continue
        reach2 = t2 * (1.0 + 1.0 / fit[0] + (px * px + py * py) / fit[5])
        if reach2 > 6.0 * t2:
            reach2 = 6.0 * t2
        at = _nearest(q, x, y, reach2, grid, size, cell_start, cell_member)
        if at < 0:
            ratio += miss
            if ratio < surely_not:
                break
        else:
            chance = 1.0 - exp(-3.141592653589793 * density * reach2)
            ratio += log((share + (1.0 - share) * chance) / chance)
            # means and centred sums with one pair more
            shrink = fit[0] / (fit[0] + 1.0)
            qx = q[0, at] - fit[3]
            qy = q[1, at] - fit[4]
            fit[0] += 1.0
            fit[1] += px / fit[0]
            fit[2] += py / fit[0]
            fit[3] += qx / fit[0]
            fit[4] += qy / fit[0]
            fit[5] += shrink * (px * px + py * py)
            fit[6] += shrink * (px * qx + py * qy)
            fit[7] += shrink * (px * qy - py * qx)
            if ratio > surely:
                break
    return ratio


@cython.ccall
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
def search(
    p: cython.double[:, ::1],
    order: cython.int[::1],
    corner_p: cython.int[:, ::1],
    shape_p: cython.double[:, ::1],
    ring_start: cython.int[::1],
    ring: cython.int[::1],
    q: cython.double[:, ::1],
    corner_q: cython.int[:, ::1],
    shape_q: cython.double[:, ::1],
    grid: cython.double[::1],
    size: cython.int[::1],
    cell_start: cython.int[::1],
    cell_member: cython.int[::1],
    bins: cython.double[::1],
    bin_size: cython.int[::1],
    bin_start: cython.int[::1],
    bin_member: cython.int[::1],
    density: cython.double,
    tolerance: cython.double,
    shape_tolerance: cython.double,
    share: cython.double,
    surely_not: cython.double,
    surely: cython.double,
    test_length: cython.Py_ssize_t,
    most: cython.long,
    log_tests: cython.double,
    log_accept: cython.double,
    seen: cython.int[::1],
    company: cython.int[::1],
    owner: cython.int[::1],
    partner: cython.int[::1],
    distance: cython.double[::1],
    best_partner: cython.int[::1],
    fit: cython.double[::1],
    move: cython.double[::1],
    tally: cython.long[::1],
) -> cython.double:
    """Search the triangles of P in `order`; return the best log of expected chance matches.

    `share` is the share of neighbours that the sequential test supposes to have partners;
    `surely_not` and `surely` are the log-likelihood ratios at which it gives up and is content.
    The search ends when the expected number of matches as good by chance falls under
    ``exp(log_accept)``, after `most` pairs of triangles, or at the end of `order`. ``move`` and
    ``best_partner`` receive the best transform and pairs; ``tally`` counts pairs of triangles,
    passed tests, and triangles of P.
    """
    t2: cython.double = tolerance * tolerance
    best: cython.double = 1e300
    o: cython.Py_ssize_t
    k: cython.Py_ssize_t
    j: cython.Py_ssize_t
    e: cython.Py_ssize_t
    around: cython.Py_ssize_t
    stamp: cython.int = 0
    row: cython.int
    low_column: cython.int
    high_column: cython.int
    low_row: cython.int
    high_row: cython.int
    zx: cython.double
    zy: cython.double
    dx: cython.double
    dy: cython.double
    wc: cython.double
    ws: cython.double
    limit: cython.double
    ratio: cython.double
    value: cython.double
    for o in range(order.shape[0]):
        k = order[o]
        zx = shape_p[k, 0]
        zy = shape_p[k, 1]
        around = -1
        tally[2] += 1
        low_column = cython.cast(cython.int, floor((zx - bins[3] - bins[0]) / bins[2]))
        high_column = cython.cast(cython.int, floor((zx + bins[3] - bins[0]) / bins[2]))
        low_row = cython.cast(cython.int, floor((zy - bins[3] - bins[1]) / bins[2]))
        high_row = cython.cast(cython.int, floor((zy + bins[3] - bins[1]) / bins[2]))
        low_column = 0 if low_column < 0 else low_column
        low_row = 0 if low_row < 0 else low_row
        high_column = bin_size[0] - 1 if high_column >= bin_size[0] else high_column
        high_row = bin_size[1] - 1 if high_row >= bin_size[1] else high_row
        if low_column > high_column or low_row > high_row:
            continue
        for row in range(low_row, high_row + 1):
            for e in range(
                bin_start[row * bin_size[0] + low_column],
                bin_start[row * bin_size[0] + high_column + 1],
            ):
                j = bin_member[e]
                dx = shape_q[j, 0] - zx
                dy = shape_q[j, 1] - zy
                limit = shape_tolerance / shape_q[j, 2]
                if dx * dx + dy * dy > limit * limit:
                    continue
                if tally[0] >= most:
                    return best
                tally[0] += 1
                if around < 0:
                    stamp += 1
                    around = _company(
                        corner_p,
                        k,
                        ring_start,
                        ring,
                        seen,
                        stamp,
                        test_length if test_length < company.shape[0] else company.shape[0],
                        company,
                    )
                _fit_corners(p, corner_p, k, q, corner_q, j, fit)
                ratio = _grow(
                    p, q, company, around, density, t2, share, surely_not, surely,
                    grid, size, cell_start, cell_member, fit,
                )  # fmt: skip
                if ratio < surely and (around > 20 or ratio < 0.0):
                    continue
                tally[1] += 1
                stamp += 1
                around = _company(
                    corner_p,
                    k,
                    ring_start,
                    ring,
                    seen,
                    stamp,
                    company.shape[0],
                    company,
                )
                _fit_corners(p, corner_p, k, q, corner_q, j, fit)
                _grow(
                    p, q, company, around, density, t2, share, -1e300, 1e300,
                    grid, size, cell_start, cell_member, fit,
                )  # fmt: skip
                around = -1
                wc = fit[6] / fit[5]
                ws = fit[7] / fit[5]
                value = _settle(
                    p, q, wc, ws,
                    fit[3] - wc * fit[1] + ws * fit[2], fit[4] - ws * fit[1] - wc * fit[2],
                    density, t2, grid, size, cell_start, cell_member,
                    owner, partner, distance, move, best, log_tests, best_partner,
                )  # fmt: skip
                if value < best:
                    best = value
                    if best < log_accept:
                        return best
    return best


@cython.cfunc
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
def _settle(
    p: cython.double[:, ::1],
    q: cython.double[:, ::1],
    wc: cython.double,
    ws: cython.double,
    tx: cython.double,
    ty: cython.double,
    density: cython.double,
    t2: cython.double,
    grid: cython.double[::1],
    size: cython.int[::1],
    cell_start: cython.int[::1],
    cell_member: cython.int[::1],
    owner: cython.int[::1],
    partner: cython.int[::1],
    distance: cython.double[::1],
    move: cython.double[::1],
    best: cython.double,
    log_tests: cython.double,
    best_partner: cython.int[::1],
) -> cython.double:
    """Refit and re-pair over all points until the pairs stay; return the log of chance matches.

    Where that is under `best`, `move` and `best_partner` are overwritten.
    """
    i: cython.Py_ssize_t
    at: cython.int
    round_: cython.int
    held: cython.int
    pairs: cython.int
    before: cython.int = -1
    inside: cython.int
    x: cython.double
    y: cython.double
    dx: cython.double
    dy: cython.double
    reach2: cython.double
    pmx: cython.double
    pmy: cython.double
    qmx: cython.double
    qmy: cython.double
    spp: cython.double
    sc: cython.double
    ss: cython.double
    share: cython.double
    chance: cython.double
    value: cython.double
    result: cython.double = 1e300
    for round_ in range(12):
        reach2 = 2.0 * t2 if round_ == 0 else t2
        inside = 0
        for i in range(q.shape[1]):
            owner[i] = -1
        for i in range(p.shape[1]):
            partner[i] = -1
            x = tx + wc * p[0, i] - ws * p[1, i]
            y = ty + ws * p[0, i] + wc * p[1, i]
            if x < grid[0] or y < grid[1] or x > grid[3] or y > grid[4]:
                continue
            inside += 1
            at = _nearest(q, x, y, reach2, grid, size, cell_start, cell_member)
            if at < 0:
                continue
            dx = q[0, at] - x
            dy = q[1, at] - y
            distance[i] = dx * dx + dy * dy
            held = owner[at]
            if held >= 0 and distance[held] <= distance[i]:
                continue
            if held >= 0:
                partner[held] = -1
            owner[at] = cython.cast(cython.int, i)
            partner[i] = at
        pairs = 0
        pmx = pmy = qmx = qmy = 0.0
        for i in range(p.shape[1]):
            at = partner[i]
            if at >= 0:
                pairs += 1
                pmx += p[0, i]
                pmy += p[1, i]
                qmx += q[0, at]
                qmy += q[1, at]
        if pairs < 3:
            return 1e300
        if round_ > 0 and pairs == before:
            break
        before = pairs
        pmx /= pairs
        pmy /= pairs
        qmx /= pairs
        qmy /= pairs
        spp = sc = ss = 0.0
        for i in range(p.shape[1]):
            at = partner[i]
            if at >= 0:
                dx = p[0, i] - pmx
                dy = p[1, i] - pmy
                x = q[0, at] - qmx
                y = q[1, at] - qmy
                spp += dx * dx + dy * dy
                sc += dx * x + dy * y
                ss += dx * y - dy * x
        if spp <= 0.0 or sc * sc + ss * ss <= 0.0:
            return 1e300
        wc = sc / spp
        ws = ss / spp
        tx = qmx - wc * pmx + ws * pmy
        ty = qmy - ws * pmx - wc * pmy
    # the probability of so many pairs by chance, at three reaches, by Chernoff's bound
    for round_ in range(3):
        reach2 = t2 * (1.0 if round_ == 0 else (0.5 if round_ == 1 else 0.25))
        pairs = 0
        for i in range(p.shape[1]):
            if partner[i] >= 0 and distance[i] <= reach2:
                pairs += 1
        # three pairs are used up by the transform
        share = (pairs - 2.0) / (inside - 2.0) if inside > 2 else 0.0
        chance = 1.0 - exp(-3.141592653589793 * density * reach2)
        if share > chance:
            value = share * log(share / chance)
            if share < 1.0:
                value += (1.0 - share) * log((1.0 - share) / (1.0 - chance))
            value = log_tests + 1.0986122886681098 - (inside - 2.0) * value
            if value < result:
                result = value
    if result < best:
        move[0] = wc
        move[1] = ws
        move[2] = tx
        move[3] = ty
        for i in range(p.shape[1]):
            best_partner[i] = partner[i]
    return result
