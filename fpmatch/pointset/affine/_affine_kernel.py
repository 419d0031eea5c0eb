"""Kernel: propose affine transforms from pairs of local triangles, and test each sequentially.

Any triangle can be mapped onto any other, so every triangle of P, in a given order, is compared
with every triangle of Q in its three rotations. The linear part of each map, between frames in
which both sets are equally wide in all directions, must not stretch one direction much more than
another; what remains is tested sequentially, neighbour after neighbour, as in
`fpmatch.pointset.triangles._proposal_kernel`.

A fit is: number of pairs, mean of P (x, y), mean of Q, and, centred, Σpp (xx, xy, yy) and Σqp (xx,
xy, yx, yy). A move is the matrix [A | t], row by row. Q is a grid; indices of its points are in the
order of its cells.
"""

import cython

if cython.compiled:
    from cython.cimports.fpmatch.pointset.triangles._proposal_kernel import WIDEST, find_neighbours
else:
    from fpmatch.pointset.triangles._proposal_kernel import WIDEST, find_neighbours

COMPILED = cython.compiled


def propose(
    p, order, corner_p, ring_start, ring, q, grid, corner_q, wide_q, max_anisotropy, least_area,
    most_area, reach2, gain, miss, reject, accept, accept_small, test_length, seen, neighbours,
    max_proposals, fit, state,
):  # fmt: skip
    """Continue the search until a proposal passes its test; return whether one did.

    ``p`` is equally wide in all directions, as is ``wide_q``, the points ``q`` of the ``grid`` in
    another frame; between these two a map stretches no direction more than `max_anisotropy` times
    another, and areas by `least_area` to `most_area`. ``state`` holds the position in ``order``,
    the number of triangles of Q compared there, of those tested in all, and the stamp of ``seen``.
    The other parameters are those of the kernel for similarities.
    """
    stamp = state[3]
    if test_length > neighbours.shape[0]:
        test_length = neighbours.shape[0]
    limit = max_anisotropy + 1.0 / max_anisotropy
    many = 3 * corner_q.shape[0]
    for o in range(state[0], order.shape[0]):
        k = order[o]
        a, b, c = corner_p[k, 0], corner_p[k, 1], corner_p[k, 2]
        ux, uy = p[0, b] - p[0, a], p[1, b] - p[1, a]
        vx, vy = p[0, c] - p[0, a], p[1, c] - p[1, a]
        area = ux * vy - uy * vx
        count = -1
        for met in range(state[1] if o == state[0] else 0, many):
            j, r = met // 3, met % 3
            a, b, c = corner_q[j, r], corner_q[j, (r + 1) % 3], corner_q[j, (r + 2) % 3]
            fx, fy = wide_q[0, b] - wide_q[0, a], wide_q[1, b] - wide_q[1, a]
            gx, gy = wide_q[0, c] - wide_q[0, a], wide_q[1, c] - wide_q[1, a]
            area_q = fx * gy - fy * gx
            if area_q < least_area * area or area_q > most_area * area:
                continue
            # the linear map times the area, and its determinant times the area squared
            xx, xy = fx * vy - gx * uy, gx * ux - fx * vx
            yx, yy = fy * vy - gy * uy, gy * ux - fy * vx
            if xx * xx + xy * xy + yx * yx + yy * yy > limit * area * area_q:
                continue
            if state[2] >= max_proposals:
                return False
            state[2] += 1
            if count < 0:
                stamp += 1
                count = find_neighbours(
                    corner_p, k, ring_start, ring, seen, stamp, test_length, neighbours
                )
            _fit_corners(p, corner_p, k, q, a, b, c, fit)
            ratio = _grow(p, grid, neighbours, count, reach2, gain, miss, reject, accept, fit)
            if ratio < accept and (ratio < accept_small or count >= test_length):
                continue
            stamp += 1
            count = find_neighbours(
                corner_p, k, ring_start, ring, seen, stamp, neighbours.shape[0], neighbours
            )
            _fit_corners(p, corner_p, k, q, a, b, c, fit)
            _grow(p, grid, neighbours, count, reach2, gain, miss, -1e300, 1e300, fit)
            state[0], state[1], state[3] = o, met + 1, stamp
            return True
    return False


def _fit_corners(p, corner_p, k, q, a, b, c, fit):
    """Start a fit with the corners of two triangles."""
    fit[0] = 3.0
    fit[1] = (p[0, corner_p[k, 0]] + p[0, corner_p[k, 1]] + p[0, corner_p[k, 2]]) / 3.0
    fit[2] = (p[1, corner_p[k, 0]] + p[1, corner_p[k, 1]] + p[1, corner_p[k, 2]]) / 3.0
    fit[3] = (q[0, a] + q[0, b] + q[0, c]) / 3.0
    fit[4] = (q[1, a] + q[1, b] + q[1, c]) / 3.0
    for r in range(5, 12):
        fit[r] = 0.0
    for r in range(3):
        i = a if r == 0 else b if r == 1 else c
        px = p[0, corner_p[k, r]] - fit[1]
        py = p[1, corner_p[k, r]] - fit[2]
        qx, qy = q[0, i] - fit[3], q[1, i] - fit[4]
        fit[5] += px * px
        fit[6] += px * py
        fit[7] += py * py
        fit[8] += qx * px
        fit[9] += qx * py
        fit[10] += qy * px
        fit[11] += qy * py


def _grow(p, grid, neighbours, count, reach2, gain, miss, reject, accept, fit):
    """Add one neighbour after the other to the fit where it has a partner; return the test's ratio.

    The partner is sought within √reach2, and farther by the fit's own uncertainty there.
    """
    size, pmx, pmy, qmx, qmy = fit[0], fit[1], fit[2], fit[3], fit[4]
    sxx, sxy, syy = fit[5], fit[6], fit[7]
    cxx, cxy, cyx, cyy = fit[8], fit[9], fit[10], fit[11]
    one_of, one_det = 1.0 / size, 1.0 / (sxx * syy - sxy * sxy)
    ratio = 0.0
    widest = WIDEST - 1.0
    steps = (gain.shape[0] - 1) / widest
    for n in range(count):
        i = neighbours[n]
        px, py = p[0, i] - pmx, p[1, i] - pmy
        # the offset in the frame where Σpp is the identity's: A·p = C·w
        wx, wy = (syy * px - sxy * py) * one_det, (sxx * py - sxy * px) * one_det
        x, y = qmx + cxx * wx + cxy * wy, qmy + cyx * wx + cyy * wy
        if x < grid.x0 or y < grid.y0 or x > grid.x1 or y > grid.y1:
            continue
        wider = min(one_of + px * wx + py * wy, widest)
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
        px, py = px * shrink, py * shrink
        sxx += px * px / shrink
        sxy += px * py / shrink
        syy += py * py / shrink
        cxx += qx * px
        cxy += qx * py
        cyx += qy * px
        cyy += qy * py
        one_det = 1.0 / (sxx * syy - sxy * sxy)
        if ratio > accept:
            break
    fit[0], fit[1], fit[2], fit[3], fit[4] = size, pmx, pmy, qmx, qmy
    fit[5], fit[6], fit[7] = sxx, sxy, syy
    fit[8], fit[9], fit[10], fit[11] = cxx, cxy, cyx, cyy
    return ratio


def move_of(fit, move):
    """Write the move of a fit."""
    det = fit[5] * fit[7] - fit[6] * fit[6]
    for r in range(2):
        cx, cy = fit[8 + 2 * r], fit[9 + 2 * r]
        move[3 * r] = (cx * fit[7] - cy * fit[6]) / det
        move[3 * r + 1] = (cy * fit[5] - cx * fit[6]) / det
        move[3 * r + 2] = fit[3 + r] - move[3 * r] * fit[1] - move[3 * r + 1] * fit[2]
