# mypy: ignore-errors
"""Kernel: least-squares fits of transforms to paired points.

A move is the similarity transform of eq. (1) as (s·cos θ, s·sin θ, tx, ty), or an affine one as the
matrix [A | t], row by row. A similarity is the closed form of
`fpmatch.pointset.geometry.similarity.Similarity.fit`: with Σ|p|², Σp·q and Σp×q of centred points,
s·cos θ = Σp·q / Σ|p|² and s·sin θ = Σp×q / Σ|p|². `fit_lists` and `fit_partners` sum in different
orders, so their results differ in the last bits. Interpreted, they run as they stand.
"""

import cython

COMPILED = cython.compiled


def fit_lists(px, py, p_list, p_begin, p0, qx, qy, q_list, q_begin, q0, count, shift, move):
    """Fit `move` to the pair (p0, q0) and to `count` pairs of two lists; return whether it exists.

    Entry ``p_begin + j`` of `p_list` is paired with entry ``q_begin + (j + shift) % count`` of
    `q_list`. One pass over offsets from the first pair; without a fit `move` stays as it is.
    """
    x0, y0 = px[p0], py[p0]
    u0, v0 = qx[q0], qy[q0]
    sum_x = sum_y = sum_u = sum_v = 0.0
    spread = dot = cross = 0.0
    m = q_begin + shift
    for j in range(p_begin, p_begin + count):
        i: cython.Py_ssize_t = p_list[j]
        x, y = px[i] - x0, py[i] - y0
        i = q_list[m]
        u, v = qx[i] - u0, qy[i] - v0
        sum_x += x
        sum_y += y
        sum_u += u
        sum_v += v
        spread += x * x + y * y
        dot += x * u + y * v
        cross += x * v - y * u
        m += 1
        if m == q_begin + count:
            m = q_begin
    n: cython.double = count + 1
    spread -= (sum_x * sum_x + sum_y * sum_y) / n
    dot -= (sum_x * sum_u + sum_y * sum_v) / n
    cross -= (sum_x * sum_v - sum_y * sum_u) / n
    if not (spread > 0.0 and dot * dot + cross * cross > 0.0):
        return False
    a, b = dot / spread, cross / spread
    x, y = x0 + sum_x / n, y0 + sum_y / n
    move[0], move[1] = a, b
    move[2] = u0 + sum_u / n - (a * x - b * y)
    move[3] = v0 + sum_v / n - (b * x + a * y)
    return True


@cython.locals(i=cython.Py_ssize_t)
def fit_partners(p, grid, partner, move):
    """Fit `move` to the points that have partners (not -1) in a grid; return whether there is one.

    It is a similarity where it has four values, affine where it has six. Two passes: means, then
    centred sums; without a fit `move` stays as it is.
    """
    pairs: cython.int = 0
    px = py = qx = qy = 0.0
    for i in range(p.shape[1]):
        at = partner[i]
        if at >= 0:
            pairs += 1
            px += p[0, i]
            py += p[1, i]
            qx += grid.x[at]
            qy += grid.y[at]
    if 2 * pairs < move.shape[0]:
        return False
    px, py = px / pairs, py / pairs
    qx, qy = qx / pairs, qy / pairs
    if move.shape[0] == 6:
        return _fit_affine(p, grid, partner, px, py, qx, qy, move)
    return _fit_similarity(p, grid, partner, px, py, qx, qy, move)


@cython.locals(i=cython.Py_ssize_t)
def _fit_similarity(p, grid, partner, px, py, qx, qy, move):
    """Fit a similarity to points that have partners, given the means of both."""
    spread = dot = cross = 0.0
    for i in range(p.shape[1]):
        at = partner[i]
        if at >= 0:
            x, y = p[0, i] - px, p[1, i] - py
            u, v = grid.x[at] - qx, grid.y[at] - qy
            spread += x * x + y * y
            dot += x * u + y * v
            cross += x * v - y * u
    if spread <= 0.0 or (dot == 0.0 and cross == 0.0):
        return False
    move[0], move[1] = dot / spread, cross / spread
    move[2] = qx - move[0] * px + move[1] * py
    move[3] = qy - move[1] * px - move[0] * py
    return True


@cython.locals(i=cython.Py_ssize_t)
def _fit_affine(p, grid, partner, px, py, qx, qy, move):
    """Fit an affine transform to points that have partners, given the means of both."""
    sxx = sxy = syy = cxx = cxy = cyx = cyy = 0.0
    for i in range(p.shape[1]):
        at = partner[i]
        if at >= 0:
            x, y = p[0, i] - px, p[1, i] - py
            u, v = grid.x[at] - qx, grid.y[at] - qy
            sxx += x * x
            sxy += x * y
            syy += y * y
            cxx += u * x
            cxy += u * y
            cyx += v * x
            cyy += v * y
    det = sxx * syy - sxy * sxy
    if not det > 1e-12 * sxx * syy:
        return False
    move[0], move[1] = (cxx * syy - cxy * sxy) / det, (cxy * sxx - cxx * sxy) / det
    move[3], move[4] = (cyx * syy - cyy * sxy) / det, (cyy * sxx - cyx * sxy) / det
    move[2] = qx - move[0] * px - move[1] * py
    move[5] = qy - move[3] * px - move[4] * py
    return True
