"""Kernel: the search of van Wamelen, Li and Iyengar, from neighbour lists to the global match.

A set is a grid: `point` (2, N), x and y in [0, 1), ordered by cell, row by row; `start` (cells +
1,), where each cell begins; `shape` (2,), rows and columns; `per_unit`, cells a unit of length.
Indices of points are indices into that order. A move is (s·cos θ, s·sin θ, tx, ty) of eq. (1).
`looks` (1,) counts the points and cells looked at, the measure of work done. Interpreted, the
functions run as they stand and give the same.
"""

import cython

COMPILED = cython.compiled


@cython.ccall
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
def search(
    p_point: cython.double[:, ::1],
    p_start: cython.int[::1],
    p_shape: cython.int[::1],
    p_per_unit: cython.double,
    q_point: cython.double[:, ::1],
    q_start: cython.int[::1],
    q_shape: cython.int[::1],
    q_per_unit: cython.double,
    pivot: cython.int[::1],
    scene: cython.int[::1],
    near_p: cython.int[::1],
    near_q: cython.int[:, ::1],
    squared: cython.double[::1],
    bases: cython.int,
    window: cython.int,
    enough_near: cython.int,
    enough: cython.int,
    tolerance: cython.double,
    most_looks: cython.longlong,
    move: cython.double[::1],
    pair: cython.int[:, :, ::1],
    taken: cython.int[::1],
    looks: cython.longlong[::1],
    found: cython.int[::1],
) -> None:
    """Try each `pivot` of P on each point of `scene`, a permutation of Q, until one pair matches.

    The farthest of the pivot's k neighbours serve as base neighbours: `bases` of them, each laid
    on the `window` neighbours of similar rank of the point of Q. `enough_near` neighbours that
    meet points of Q within twice the tolerance make a local match, `enough` pairs a global one.
    The search gives up once it has looked at `most_looks` points.

    `near_q` (N, k) keeps the neighbour lists of Q, each -1 until it is needed; `near_p` (k,),
    `squared` (k,), `pair` (2, 2, M + 1) and `taken` (N,), all 0, are room to work in. ``found``
    receives the number of pairs (0: no match), which are ``pair[0, :, :found[0]]``, and the
    number of local matches; `move` the transform.
    """
    i: cython.Py_ssize_t
    j: cython.Py_ssize_t
    base: cython.int
    rank: cython.int
    p: cython.int
    q: cython.int
    near: cython.int
    k: cython.int = near_p.shape[0]
    half: cython.int = window // 2
    found[0] = 0
    found[1] = 0
    for i in range(pivot.shape[0]):
        p = pivot[i]
        find_neighbours(p_point, p_start, p_shape, p_per_unit, p, near_p, squared, looks)
        for j in range(scene.shape[0]):
            q = scene[j]
            if near_q[q, 0] < 0:
                find_neighbours(q_point, q_start, q_shape, q_per_unit, q, near_q[q], squared, looks)
            for base in range(k - half - bases, k - half):
                for rank in range(base - half, base + half + 1):
                    if looks[0] >= most_looks:
                        return
                    if not lay(p_point, p, near_p[base], q_point, q, near_q[q, rank], move):
                        continue
                    near = match_locally(
                        p_point, near_p, q_point, q_start, q_shape, q_per_unit,
                        move, 2.0 * tolerance, enough_near, pair[0], taken, looks,
                    )  # fmt: skip
                    if near == 0:
                        continue
                    found[1] += 1
                    pair[0, 0, near] = p
                    pair[0, 1, near] = q
                    found[0] = match_globally(
                        p_point, q_point, q_start, q_shape, q_per_unit,
                        tolerance, near + 1, enough, most_looks, move, pair, taken, looks,
                    )  # fmt: skip
                    if found[0] > 0:
                        return


@cython.ccall
@cython.inline
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
@cython.exceptval(check=False)
def lay(
    p_point: cython.double[:, ::1],
    p: cython.int,
    p_base: cython.int,
    q_point: cython.double[:, ::1],
    q: cython.int,
    q_base: cython.int,
    move: cython.double[::1],
) -> cython.int:
    """Write the move that lays p on q and p's neighbour on q's; return 0 where there is none."""
    px: cython.double = p_point[0, p_base] - p_point[0, p]
    py: cython.double = p_point[1, p_base] - p_point[1, p]
    qx: cython.double = q_point[0, q_base] - q_point[0, q]
    qy: cython.double = q_point[1, q_base] - q_point[1, q]
    length: cython.double = px * px + py * py
    if not (length > 0.0 and qx * qx + qy * qy > 0.0):
        return 0
    move[0] = (px * qx + py * qy) / length
    move[1] = (px * qy - py * qx) / length
    move[2] = q_point[0, q] - (move[0] * p_point[0, p] - move[1] * p_point[1, p])
    move[3] = q_point[1, q] - (move[1] * p_point[0, p] + move[0] * p_point[1, p])
    return 1


@cython.ccall
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
@cython.exceptval(check=False)
def match_locally(
    p_point: cython.double[:, ::1],
    near_p: cython.int[::1],
    q_point: cython.double[:, ::1],
    q_start: cython.int[::1],
    q_shape: cython.int[::1],
    q_per_unit: cython.double,
    move: cython.double[::1],
    reach: cython.double,
    enough: cython.int,
    pair: cython.int[:, ::1],
    taken: cython.int[::1],
    looks: cython.longlong[::1],
) -> cython.int:
    """Count the neighbours whose image has a point of Q within `reach`; 0 where not `enough`.

    ``pair[:, :count]`` receives these neighbours and the points of Q nearest to their images.
    """
    i: cython.Py_ssize_t
    x: cython.double
    y: cython.double
    q: cython.int
    count: cython.int = 0
    k: cython.int = near_p.shape[0]
    for i in range(k):
        if count + k - i < enough:
            return 0
        x = move[0] * p_point[0, near_p[i]] - move[1] * p_point[1, near_p[i]] + move[2]
        y = move[1] * p_point[0, near_p[i]] + move[0] * p_point[1, near_p[i]] + move[3]
        q = nearest_within(q_point, q_start, q_shape, q_per_unit, x, y, reach, taken, looks)
        if q >= 0:
            pair[0, count] = near_p[i]
            pair[1, count] = q
            count += 1
    return count if count >= enough else 0


@cython.ccall
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
@cython.exceptval(check=False)
def match_globally(
    p_point: cython.double[:, ::1],
    q_point: cython.double[:, ::1],
    q_start: cython.int[::1],
    q_shape: cython.int[::1],
    q_per_unit: cython.double,
    tolerance: cython.double,
    pairs: cython.int,
    enough: cython.int,
    most_looks: cython.longlong,
    move: cython.double[::1],
    pair: cython.int[:, :, ::1],
    taken: cython.int[::1],
    looks: cython.longlong[::1],
) -> cython.int:
    """Fit and re-pair by turns, from ``pair[0, :, :pairs]`` on, until the count stops growing.

    Returns the number of pairs, 0 where they are not `enough`. They are then ``pair[0]``, each
    within `tolerance` under `move`: those of the last round that did not lose any.
    """
    i: cython.Py_ssize_t
    more: cython.int
    count: cython.int = 0
    even: cython.double = 0.0
    odd: cython.double = 0.0
    tx: cython.double = 0.0
    ty: cython.double = 0.0
    while fit_pairs(p_point, q_point, pair[0], pairs, move):
        more = pair_within(
            p_point, q_point, q_start, q_shape, q_per_unit,
            move, tolerance, count, most_looks, pair[1], taken, looks,
        )  # fmt: skip
        if more < count or more == 0:
            break
        for i in range(more):
            pair[0, 0, i] = pair[1, 0, i]
            pair[0, 1, i] = pair[1, 1, i]
        even = move[0]
        odd = move[1]
        tx = move[2]
        ty = move[3]
        if more == count:
            break
        count = more
        pairs = more
    move[0] = even
    move[1] = odd
    move[2] = tx
    move[3] = ty
    return count if count >= enough else 0


@cython.ccall
@cython.inline
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
@cython.exceptval(check=False)
def fit_pairs(
    p_point: cython.double[:, ::1],
    q_point: cython.double[:, ::1],
    pair: cython.int[:, ::1],
    count: cython.int,
    move: cython.double[::1],
) -> cython.int:
    """Write the least-squares move of the pairs (2, count); return 0 where it would collapse P."""
    i: cython.Py_ssize_t
    px: cython.double
    py: cython.double
    qx: cython.double
    qy: cython.double
    n: cython.double = count
    # sums of the offsets from the first pair
    p0x: cython.double = p_point[0, pair[0, 0]]
    p0y: cython.double = p_point[1, pair[0, 0]]
    q0x: cython.double = q_point[0, pair[1, 0]]
    q0y: cython.double = q_point[1, pair[1, 0]]
    sum_px: cython.double = 0.0
    sum_py: cython.double = 0.0
    sum_qx: cython.double = 0.0
    sum_qy: cython.double = 0.0
    spread: cython.double = 0.0
    even: cython.double = 0.0
    odd: cython.double = 0.0
    for i in range(1, count):
        px = p_point[0, pair[0, i]] - p0x
        py = p_point[1, pair[0, i]] - p0y
        qx = q_point[0, pair[1, i]] - q0x
        qy = q_point[1, pair[1, i]] - q0y
        sum_px += px
        sum_py += py
        sum_qx += qx
        sum_qy += qy
        spread += px * px + py * py
        even += px * qx + py * qy
        odd += px * qy - py * qx
    spread -= (sum_px * sum_px + sum_py * sum_py) / n
    even -= (sum_px * sum_qx + sum_py * sum_qy) / n
    odd -= (sum_px * sum_qy - sum_py * sum_qx) / n
    if not (spread > 0.0 and even * even + odd * odd > 0.0):
        return 0
    even = even / spread
    odd = odd / spread
    px = p0x + sum_px / n
    py = p0y + sum_py / n
    move[0] = even
    move[1] = odd
    move[2] = q0x + sum_qx / n - (even * px - odd * py)
    move[3] = q0y + sum_qy / n - (odd * px + even * py)
    return 1


@cython.ccall
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
@cython.exceptval(check=False)
def pair_within(
    p_point: cython.double[:, ::1],
    q_point: cython.double[:, ::1],
    q_start: cython.int[::1],
    q_shape: cython.int[::1],
    q_per_unit: cython.double,
    move: cython.double[::1],
    tolerance: cython.double,
    enough: cython.int,
    most_looks: cython.longlong,
    pair: cython.int[:, ::1],
    taken: cython.int[::1],
    looks: cython.longlong[::1],
) -> cython.int:
    """Pair each image of P with the nearest point of Q within `tolerance` that is still free.

    Returns the number of pairs, or 0 as soon as they can no longer be `enough` or the work is too
    much; `pair` receives them. `taken` (N of Q,) is all 0 before and after.
    """
    i: cython.Py_ssize_t
    x: cython.double
    y: cython.double
    q: cython.int
    count: cython.int = 0
    m: cython.int = p_point.shape[1]
    for i in range(m):
        if count + m - i < enough or looks[0] >= most_looks:
            break
        x = move[0] * p_point[0, i] - move[1] * p_point[1, i] + move[2]
        y = move[1] * p_point[0, i] + move[0] * p_point[1, i] + move[3]
        q = nearest_within(q_point, q_start, q_shape, q_per_unit, x, y, tolerance, taken, looks)
        if q >= 0:
            taken[q] = 1
            pair[0, count] = i
            pair[1, count] = q
            count += 1
    for i in range(count):
        taken[pair[1, i]] = 0
    return count if count >= enough and looks[0] < most_looks else 0


@cython.ccall
@cython.inline
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
@cython.exceptval(check=False)
def nearest_within(
    point: cython.double[:, ::1],
    start: cython.int[::1],
    shape: cython.int[::1],
    per_unit: cython.double,
    x: cython.double,
    y: cython.double,
    reach: cython.double,
    taken: cython.int[::1],
    looks: cython.longlong[::1],
) -> cython.int:
    """Return the point nearest to (x, y), not `taken`, within `reach`; -1 for none.

    Of equals it is the first; `taken` (N,) is 0 for a point that is free.
    """
    j: cython.Py_ssize_t
    row: cython.Py_ssize_t
    dx: cython.double
    dy: cython.double
    distance: cython.double
    begin: cython.int
    end: cython.int
    left: cython.int
    right: cython.int
    nearest: cython.int = -1
    least: cython.double = reach * reach
    if not (
        x + reach >= 0.0
        and y + reach >= 0.0
        and (x - reach) * per_unit < shape[1]
        and (y - reach) * per_unit < shape[0]
    ):
        return -1
    left = _cell_of(x - reach, per_unit, shape[1])
    right = _cell_of(x + reach, per_unit, shape[1]) + 1
    for row in range(
        _cell_of(y - reach, per_unit, shape[0]), _cell_of(y + reach, per_unit, shape[0]) + 1
    ):
        begin = start[row * shape[1] + left]
        end = start[row * shape[1] + right]
        looks[0] += 1 + end - begin
        for j in range(begin, end):
            dx = point[0, j] - x
            dy = point[1, j] - y
            distance = dx * dx + dy * dy
            if taken[j] == 0 and (distance < least or (distance == least and nearest < 0)):
                least = distance
                nearest = j
    return nearest


@cython.ccall
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
@cython.exceptval(check=False)
def find_neighbours(
    point: cython.double[:, ::1],
    start: cython.int[::1],
    shape: cython.int[::1],
    per_unit: cython.double,
    i: cython.int,
    near: cython.int[::1],
    squared: cython.double[::1],
    looks: cython.longlong[::1],
) -> cython.void:
    """Write the nearest neighbours of point i, by distance and then by index, into `near` (k,).

    `squared` receives their squared distances. The set has more than k points. The cells are
    looked through in square shells around the point's own, until no other can hold a neighbour.
    """
    count: cython.int = 0
    shell: cython.int = 0
    line: cython.int
    step: cython.int
    left: cython.int
    right: cython.int
    gap: cython.double
    x: cython.double = point[0, i]
    y: cython.double = point[1, i]
    column: cython.int = _cell_of(x, per_unit, shape[1])
    row: cython.int = _cell_of(y, per_unit, shape[0])
    while True:
        left = column - shell if column > shell else 0
        right = column + shell if column + shell < shape[1] else shape[1] - 1
        for line in range(
            row - shell if row > shell else 0,
            (row + shell if row + shell < shape[0] else shape[0] - 1) + 1,
        ):
            if line == row - shell or line == row + shell:
                count = _insert_cells(
                    point, i, start[line * shape[1] + left], start[line * shape[1] + right + 1],
                    near, squared, count, looks,
                )  # fmt: skip
                continue
            for step in range(column - shell, column + shell + 1, 2 * shell):
                if 0 <= step < shape[1]:
                    count = _insert_cells(
                        point, i, start[line * shape[1] + step], start[line * shape[1] + step + 1],
                        near, squared, count, looks,
                    )  # fmt: skip
        gap = _distance_to_unseen(x * per_unit, column, shell, shape[1])
        gap = min(gap, _distance_to_unseen(y * per_unit, row, shell, shape[0]))
        if gap < 0.0:
            gap = 0.0
        gap = gap / per_unit
        if count == near.shape[0] and squared[count - 1] < gap * gap:
            break
        shell += 1
        if shell >= shape[0] and shell >= shape[1]:
            break


@cython.cfunc
@cython.inline
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.exceptval(check=False)
def _insert_cells(
    point: cython.double[:, ::1],
    i: cython.int,
    begin: cython.int,
    end: cython.int,
    near: cython.int[::1],
    squared: cython.double[::1],
    count: cython.int,
    looks: cython.longlong[::1],
) -> cython.int:
    """Insert the points begin to end, but i, into the list of nearest; return its new length."""
    j: cython.int
    place: cython.int
    dx: cython.double
    dy: cython.double
    distance: cython.double
    k: cython.int = near.shape[0]
    looks[0] += 1 + end - begin
    for j in range(begin, end):
        dx = point[0, j] - point[0, i]
        dy = point[1, j] - point[1, i]
        distance = dx * dx + dy * dy
        if j == i or (
            count == k
            and (distance > squared[k - 1] or (distance == squared[k - 1] and j > near[k - 1]))
        ):
            continue
        place = count if count < k else k - 1
        while place > 0 and (
            distance < squared[place - 1]
            or (distance == squared[place - 1] and j < near[place - 1])
        ):
            squared[place] = squared[place - 1]
            near[place] = near[place - 1]
            place -= 1
        squared[place] = distance
        near[place] = j
        if count < k:
            count += 1
    return count


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _distance_to_unseen(
    value: cython.double, cell: cython.int, shell: cython.int, cells: cython.int
) -> cython.double:
    """Return how far, in cells, `value` is from the cells beyond the shell along one axis."""
    rounding: cython.double = 1e-9
    gap: cython.double = cells
    if cell - shell > 0:
        gap = min(gap, value - (cell - shell))
    if cell + shell + 1 < cells:
        gap = min(gap, cell + shell + 1 - value)
    return gap - rounding


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _cell_of(value: cython.double, per_unit: cython.double, cells: cython.int) -> cython.int:
    """Return the row or column that `value` falls in, the nearest where it is outside."""
    place: cython.double = value * per_unit
    if place <= 0.0:
        return 0
    if place >= cells:
        return cells - 1
    return cython.cast(cython.int, place)


@cython.ccall
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.exceptval(check=False)
def hull_area(point: cython.double[:, ::1], corner: cython.int[::1]) -> cython.double:
    """Return the area of the convex hull of `point` (2, N), sorted by x and then y.

    `corner` (N + 1,) is room to work in: the lower side of the hull, then the upper.
    """
    i: cython.Py_ssize_t
    side: cython.Py_ssize_t
    count: cython.int
    a: cython.int
    b: cython.int
    c: cython.int
    n: cython.int = point.shape[1]
    twice: cython.double = 0.0
    for side in range(2):
        count = 0
        for i in range(n):
            c = i if side == 0 else n - 1 - i
            while count >= 2:
                a = corner[count - 2]
                b = corner[count - 1]
                if (point[0, b] - point[0, a]) * (point[1, c] - point[1, a]) > (
                    point[1, b] - point[1, a]
                ) * (point[0, c] - point[0, a]):
                    break
                count -= 1
            corner[count] = c
            count += 1
        for i in range(count - 1):
            a = corner[i]
            b = corner[i + 1]
            twice += (point[0, a] - point[0, 0]) * (point[1, b] - point[1, 0]) - (
                point[1, a] - point[1, 0]
            ) * (point[0, b] - point[0, 0])
    return twice / 2.0
