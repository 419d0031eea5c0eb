# mypy: ignore-errors
"""Kernel: the least-squares fit of a transform to points that have partners in a grid.

A move is (s·cos θ, s·sin θ, tx, ty) of eq. (1). The sums are in another order
than there, so that results differ in the last bits. Interpreted, it runs as it stands.
"""

import cython


@cython.locals(i=cython.Py_ssize_t)
def fit_partners(p, grid, partner, move):
    """Fit `move` to the points that have partners (not -1) in a grid; return whether there is one.

    Two passes: means, then centred sums; without a fit `move` stays as it is.
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
    if pairs < 2:
        return False
    px, py = px / pairs, py / pairs
    qx, qy = qx / pairs, qy / pairs
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
