# mypy: ignore-errors
"""Kernel: the least-squares fit of a transform to paired points.

A move is the similarity transform of eq. (1) as (s·cos θ, s·sin θ, tx, ty), the closed form of
`fpmatch.pointset.geometry.similarity.Similarity.fit`: with Σ|p|², Σp·q and Σp×q of centred points,
s·cos θ = Σp·q / Σ|p|² and s·sin θ = Σp×q / Σ|p|². Interpreted, it runs as it stands.
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
