"""Kernel: lay one print over the other and pair their minutiae, one to one.

Minutiae are columns of an array (4, N): x, y in pixels at 500 dpi with y pointing up, and the unit
vector (c, s) of the direction. A transform is (s·cos θ, s·sin θ, tx, ty). Interpreted, the
functions run as they stand and give the same pairs.
"""

import cython

if cython.compiled:
    from cython.cimports.libc.math import exp, sqrt
else:
    from math import exp, sqrt

COMPILED = cython.compiled


@cython.ccall
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
def support_of_seeds(
    a: cython.double[:, ::1],
    b: cython.double[:, ::1],
    seeds: cython.int[:, ::1],
    near: cython.double,
    spread: cython.double,
    far: cython.double,
    min_cosine: cython.double,
    transforms: cython.double[:, ::1],
    support: cython.double[::1],
    moved: cython.double[:, ::1],
    reach: cython.double[::1],
    partner: cython.int[::1],
    weight: cython.double[::1],
    rival: cython.int[::1],
    rival_weight: cython.double[::1],
) -> cython.int:
    """Let each seed, a pair of minutiae (i, j), propose a transform; refine it once, and weigh it.

    The seed's own directions give the rotation, its positions the shift. Minutiae are paired
    within a reach that grows from `near` by `spread` a pixel of distance from the seed up to
    `far`; the similarity transform fitted to these pairs goes to ``transforms[k]`` and the sum of
    the pairs' weights to ``support[k]``.
    """
    k: cython.Py_ssize_t
    i: cython.Py_ssize_t
    p: cython.Py_ssize_t
    q: cython.Py_ssize_t
    cosine: cython.double
    sine: cython.double
    dx: cython.double
    dy: cython.double
    r: cython.double
    for k in range(seeds.shape[0]):
        p = seeds[k, 0]
        q = seeds[k, 1]
        cosine = a[2, p] * b[2, q] + a[3, p] * b[3, q]
        sine = a[2, p] * b[3, q] - a[3, p] * b[2, q]
        transforms[k, 0] = cosine
        transforms[k, 1] = sine
        transforms[k, 2] = b[0, q] - cosine * a[0, p] + sine * a[1, p]
        transforms[k, 3] = b[1, q] - sine * a[0, p] - cosine * a[1, p]
        for i in range(a.shape[1]):
            dx = a[0, i] - a[0, p]
            dy = a[1, i] - a[1, p]
            r = near + spread * sqrt(dx * dx + dy * dy)
            reach[i] = r if r < far else far
        move(a, transforms[k], moved)
        support[k] = pair(moved, b, reach, min_cosine, partner, weight, rival, rival_weight)
        fit(a, b, partner, weight, transforms[k])
    return 0


@cython.ccall
@cython.boundscheck(False)
@cython.wraparound(False)
def move(
    a: cython.double[:, ::1], transform: cython.double[::1], moved: cython.double[:, ::1]
) -> cython.int:
    """Apply a transform to minutiae; directions turn, their length stays one."""
    i: cython.Py_ssize_t
    c: cython.double = transform[0]
    s: cython.double = transform[1]
    scale: cython.double = sqrt(c * c + s * s)
    for i in range(a.shape[1]):
        moved[0, i] = transform[2] + c * a[0, i] - s * a[1, i]
        moved[1, i] = transform[3] + s * a[0, i] + c * a[1, i]
        moved[2, i] = (c * a[2, i] - s * a[3, i]) / scale
        moved[3, i] = (s * a[2, i] + c * a[3, i]) / scale
    return 0


@cython.ccall
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
@cython.exceptval(check=False)
def pair(
    moved: cython.double[:, ::1],
    b: cython.double[:, ::1],
    reach: cython.double[::1],
    min_cosine: cython.double,
    partner: cython.int[::1],
    weight: cython.double[::1],
    rival: cython.int[::1],
    rival_weight: cython.double[::1],
) -> cython.double:
    """Pair moved minutiae with those of B, each with the one it fits best, where that is mutual.

    A pair at distance d within the reach r of its minutia, with directions at cosine t, weighs
    ``(1 - d²/2r²)·(t - min_cosine)/(1 - min_cosine)``. ``partner[i]`` receives the index in B or
    -1, ``weight[i]`` the weight; the sum of the weights is returned. `rival` and `rival_weight`
    are scratch as long as B.
    """
    i: cython.Py_ssize_t
    j: cython.Py_ssize_t
    best_j: cython.Py_ssize_t
    dx: cython.double
    dy: cython.double
    d2: cython.double
    r2: cython.double
    cosine: cython.double
    value: cython.double
    best: cython.double
    total: cython.double = 0.0
    scale: cython.double = 1.0 / (1.0 - min_cosine)
    for j in range(b.shape[1]):
        rival[j] = -1
        rival_weight[j] = 0.0
    for i in range(moved.shape[1]):
        best = 0.0
        best_j = -1
        r2 = reach[i] * reach[i]
        for j in range(b.shape[1]):
            dx = b[0, j] - moved[0, i]
            dy = b[1, j] - moved[1, i]
            d2 = dx * dx + dy * dy
            if d2 >= r2:
                continue
            cosine = moved[2, i] * b[2, j] + moved[3, i] * b[3, j]
            if cosine <= min_cosine:
                continue
            value = (1.0 - 0.5 * d2 / r2) * (cosine - min_cosine) * scale
            if value > best:
                best = value
                best_j = j
            if value > rival_weight[j]:
                rival_weight[j] = value
                rival[j] = cython.cast(cython.int, i)
        partner[i] = cython.cast(cython.int, best_j)
        weight[i] = best
    for i in range(moved.shape[1]):
        if partner[i] >= 0 and rival[partner[i]] == i:
            total += weight[i]
        else:
            partner[i] = -1
            weight[i] = 0.0
    return total


@cython.ccall
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
def fit(
    a: cython.double[:, ::1],
    b: cython.double[:, ::1],
    partner: cython.int[::1],
    weight: cython.double[::1],
    transform: cython.double[::1],
) -> cython.int:
    """Fit the similarity transform to the pairs by weighted least squares; return their number.

    The directions of the pairs count as well as their positions do at 30 px from the middle, so
    that few pairs, or pairs close together, leave the rotation no freedom. With fewer than two
    pairs the transform stays as it is. The scale is held within 6 % of one.
    """
    i: cython.Py_ssize_t
    j: cython.Py_ssize_t
    n: cython.int = 0
    w: cython.double
    total: cython.double = 0.0
    amx: cython.double = 0.0
    amy: cython.double = 0.0
    bmx: cython.double = 0.0
    bmy: cython.double = 0.0
    cosine: cython.double = 0.0
    sine: cython.double = 0.0
    spread: cython.double = 0.0
    turn_c: cython.double = 0.0
    turn_s: cython.double = 0.0
    dx: cython.double
    dy: cython.double
    ex: cython.double
    ey: cython.double
    length: cython.double
    scale: cython.double
    for i in range(a.shape[1]):
        j = partner[i]
        if j >= 0:
            w = weight[i]
            n += 1
            total += w
            amx += w * a[0, i]
            amy += w * a[1, i]
            bmx += w * b[0, j]
            bmy += w * b[1, j]
    if n < 2 or total <= 0.0:
        return n
    amx /= total
    amy /= total
    bmx /= total
    bmy /= total
    for i in range(a.shape[1]):
        j = partner[i]
        if j >= 0:
            w = weight[i]
            dx = a[0, i] - amx
            dy = a[1, i] - amy
            ex = b[0, j] - bmx
            ey = b[1, j] - bmy
            cosine += w * (dx * ex + dy * ey)
            sine += w * (dx * ey - dy * ex)
            spread += w * (dx * dx + dy * dy)
            turn_c += w * (a[2, i] * b[2, j] + a[3, i] * b[3, j])
            turn_s += w * (a[2, i] * b[3, j] - a[3, i] * b[2, j])
    scale = sqrt(cosine * cosine + sine * sine) / spread if spread > 0.0 else 1.0
    if n < 4:
        scale = 1.0
    scale = 0.94 if scale < 0.94 else (1.06 if scale > 1.06 else scale)
    cosine += 900.0 * turn_c
    sine += 900.0 * turn_s
    length = sqrt(cosine * cosine + sine * sine)
    if length <= 0.0:
        return n
    transform[0] = scale * cosine / length
    transform[1] = scale * sine / length
    transform[2] = bmx - transform[0] * amx + transform[1] * amy
    transform[3] = bmy - transform[1] * amx - transform[0] * amy
    return n


@cython.ccall
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
@cython.exceptval(check=False)
def refine(
    a: cython.double[:, ::1],
    b: cython.double[:, ::1],
    transform: cython.double[::1],
    rigid_rounds: cython.int,
    rigid_reach: cython.double,
    bend_rounds: cython.int,
    bend_sigma: cython.double,
    near: cython.double,
    spread: cython.double,
    far: cython.double,
    min_cosine: cython.double,
    moved: cython.double[:, ::1],
    bent: cython.double[:, ::1],
    reach: cython.double[::1],
    partner: cython.int[::1],
    weight: cython.double[::1],
    rival: cython.int[::1],
    rival_weight: cython.double[::1],
) -> cython.double:
    """Refit and re-pair in turn, first rigidly, then bending with the skin; return the weight.

    In each bending round every minutia is displaced by the Gaussian mean (`bend_sigma`) of the
    other pairs' residuals, and paired within a reach that grows from `near` by `spread` a pixel of
    distance from the nearest other pair, up to `far`.
    """
    i: cython.Py_ssize_t
    k: cython.Py_ssize_t
    j: cython.Py_ssize_t
    r: cython.int
    dx: cython.double
    dy: cython.double
    d2: cython.double
    nearest: cython.double
    g: cython.double
    mass: cython.double
    mx: cython.double
    my: cython.double
    total: cython.double = 0.0
    scale: cython.double = -0.5 / (bend_sigma * bend_sigma)
    for i in range(a.shape[1]):
        reach[i] = rigid_reach
    for r in range(rigid_rounds):
        move(a, transform, moved)
        total = pair(moved, b, reach, min_cosine, partner, weight, rival, rival_weight)
        fit(a, b, partner, weight, transform)
    move(a, transform, moved)
    for r in range(bend_rounds):
        for i in range(a.shape[1]):
            mass = 0.3
            mx = 0.0
            my = 0.0
            nearest = 1e12
            for k in range(a.shape[1]):
                j = partner[k]
                if j < 0 or k == i:
                    continue
                dx = moved[0, k] - moved[0, i]
                dy = moved[1, k] - moved[1, i]
                d2 = dx * dx + dy * dy
                if d2 < nearest:
                    nearest = d2
                g = weight[k] * exp(scale * d2)
                mass += g
                mx += g * (b[0, j] - moved[0, k])
                my += g * (b[1, j] - moved[1, k])
            bent[0, i] = moved[0, i] + mx / mass
            bent[1, i] = moved[1, i] + my / mass
            bent[2, i] = moved[2, i]
            bent[3, i] = moved[3, i]
            g = near + spread * sqrt(nearest)
            reach[i] = g if g < far else far
        total = pair(bent, b, reach, min_cosine, partner, weight, rival, rival_weight)
    return total
