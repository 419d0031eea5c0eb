# mypy: ignore-errors
"""Kernel: least-squares fits of transforms to points that have partners in a grid.

A move is a similarity transform as in `fpmatch.pointset.geometry._least_squares_kernel`, or an
affine one as the matrix [A | t], row by row. The sums are in another order than there, so that
results differ in the last bits. Interpreted, they run as they stand.
"""

import cython


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
