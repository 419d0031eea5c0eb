"""Kernel: what the two prints say to an alignment, and what that is worth.

A transform is (c, s, x, y) as `_align_kernel` has it; `evidence` are the entries named below.
Interpreted, the functions run as they stand.
"""

import cython
import numpy as np

if cython.compiled:
    from cython.cimports.fpmatch.matching._print_kernel import Print
    from cython.cimports.libc.math import exp, log, log1p, sqrt
else:
    from math import exp, log, log1p, sqrt

    from fpmatch.matching._print_kernel import Print

from fpmatch.matching.rounding import ORIENTATIONS

COMPILED = cython.compiled

# Entries of the evidence:
PAIRS = cython.declare(cython.Py_ssize_t, 0)
LOCAL = cython.declare(cython.Py_ssize_t, 1)
UNPAIRED = cython.declare(cython.Py_ssize_t, 2)
COMMON = cython.declare(cython.Py_ssize_t, 3)
AREA = cython.declare(cython.Py_ssize_t, 4)
OVERLAP = cython.declare(cython.Py_ssize_t, 5)
ORIENTATION = cython.declare(cython.Py_ssize_t, 6)
CHANGE = cython.declare(cython.Py_ssize_t, 7)
ROUGHNESS = cython.declare(cython.Py_ssize_t, 8)
KNOWN = cython.declare(cython.Py_ssize_t, 9)
ENTRIES = 10

# Of the features, those from here on are of the orientation:
OF_FLOW = cython.declare(cython.Py_ssize_t, 5)
FEATURES = 8

# Cosine and sine of twice the difference of two orientations, by the difference of their codes.
_STEPS = cython.declare(cython.Py_ssize_t, ORIENTATIONS)
_TURNS = np.arange(-ORIENTATIONS, ORIENTATIONS + 1) * (2 * np.pi / ORIENTATIONS)
_COSINE = cython.declare(cython.double[::1], np.cos(_TURNS))
_SINE = cython.declare(cython.double[::1], np.sin(_TURNS))


@cython.ccall
@cython.nogil
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
@cython.exceptval(check=False)
def gather(
    a: Print,
    b: Print,
    partner: cython.int[::1],
    bent: cython.double[:, ::1],
    c: cython.double,
    s: cython.double,
    x: cython.double,
    y: cython.double,
    likeness: cython.float[:, ::1],
    margin: cython.double,
    doubt_cells: cython.double,
    doubt_change: cython.double,
    scratch: cython.int[::1],
    evidence: cython.double[::1],
) -> cython.int:
    """Gather the evidence of an alignment of A on B.

    ``partner[i]`` is the index in B of what minutia i of A is paired with, or -1; `bent` holds
    where it lies. Unpaired minutiae count where the other print reaches `margin` beyond them.
    `scratch` is as long as B has minutiae, and as A has columns of cells.
    """
    i: cython.Py_ssize_t
    j: cython.Py_ssize_t
    pairs: cython.double = 0.0
    common: cython.double = 0.0
    local: cython.double = 0.0
    unpaired_a: cython.double = 0.0
    unpaired_b: cython.double = 0.0
    px: cython.double
    py: cython.double
    qx: cython.double
    qy: cython.double
    area: cython.double
    smaller: cython.double
    scale: cython.double = c * c + s * s
    for j in range(b.size):
        scratch[j] = 0
    for i in range(a.size):
        j = partner[i]
        if j >= 0:
            pairs += 1.0
            common += 1.0
            local += cython.cast(cython.double, likeness[i, j])
            scratch[j] = 1
        elif b.holds(bent[0, i], bent[1, i]):
            common += 1.0
            if b.surrounds(bent[0, i], bent[1, i], margin):
                unpaired_a += a.quality[i] * a.quality[i]
    for j in range(b.size):
        if scratch[j]:
            common += 1.0
            continue
        qx = b.points[0, j] - x
        qy = b.points[1, j] - y
        px = (c * qx + s * qy) / scale
        py = (c * qy - s * qx) / scale
        if a.holds(px, py):
            common += 1.0
            if a.surrounds(px, py, margin):
                unpaired_b += b.quality[j] * b.quality[j]
    evidence[PAIRS] = pairs
    evidence[LOCAL] = local
    evidence[UNPAIRED] = unpaired_a + unpaired_b
    evidence[COMMON] = common
    field_agreement(a, b, c, s, x, y, doubt_cells, doubt_change, scratch, evidence)
    smaller = a.inside * (a.step * a.step)
    area = b.inside * (b.step * b.step)
    smaller = area if area < smaller else smaller
    area = evidence[AREA]
    evidence[OVERLAP] = 0.0
    if smaller > 0.0:
        evidence[OVERLAP] = area / smaller if area < smaller else 1.0
    return 0


@cython.ccall
@cython.nogil
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
@cython.exceptval(check=False)
def field_agreement(
    a: Print,
    b: Print,
    c: cython.double,
    s: cython.double,
    x: cython.double,
    y: cython.double,
    doubt_cells: cython.double,
    doubt_change: cython.double,
    above: cython.int[::1],
    evidence: cython.double[::1],
) -> cython.int:
    """Lay the orientation field of A over that of B.

    The evidence receives the area of those cells of A that fall into the region of B, and, where
    both orientations are known, what `fpmatch.matching.score.Evidence` says of them. `above`, as
    long as A has columns, is scratch: the codes of B under the cells of the row before.
    """
    row: cython.int
    column: cython.int
    place: cython.Py_ssize_t
    way: cython.int
    code: cython.Py_ssize_t
    near: cython.Py_ssize_t
    other: cython.Py_ssize_t
    near_other: cython.Py_ssize_t
    left: cython.Py_ssize_t
    ax: cython.double
    ay: cython.double
    bx: cython.double
    by: cython.double
    turn_a: cython.double
    turn_b: cython.double
    cells: cython.double = 0.0
    cosines: cython.double = 0.0
    sines: cython.double = 0.0
    steps: cython.double = 0.0
    alike: cython.double = 0.0
    both: cython.double = 0.0
    only_a: cython.double = 0.0
    only_b: cython.double = 0.0
    per_px: cython.double = 1.0 / b.step
    known: cython.bint = a.has_flow and b.has_flow
    place = a.cell_at - 1
    for column in range(a.columns):
        above[column] = 0
    for row in range(a.rows):
        ay = -(a.first_row + row + 0.5) * a.step
        left = 0
        for column in range(a.columns):
            place += 1
            near_other = above[column]
            above[column] = 0
            code = cython.cast(cython.Py_ssize_t, a.cell[place])
            if code == 0:
                left = 0
                continue
            ax = (a.first_column + column + 0.5) * a.step
            bx = (x + c * ax - s * ay) * per_px - b.first_column
            by = -(y + s * ax + c * ay) * per_px - b.first_row
            other = 0
            if 0.0 <= bx < b.columns and 0.0 <= by < b.rows:
                other = cython.cast(cython.Py_ssize_t, by) * b.columns
                other += cython.cast(cython.Py_ssize_t, bx)
                other = cython.cast(cython.Py_ssize_t, b.cell[b.cell_at + other])
            if other == 0:
                left = 0
                continue
            cells += 1.0
            if known:
                cosines += _COSINE[other - code + _STEPS]
                sines += _SINE[other - code + _STEPS]
                for way in range(2):
                    if way:
                        near_other = left
                        near = place - 1
                    else:
                        near = place - a.columns
                    if near_other == 0:
                        continue
                    near = code - cython.cast(cython.Py_ssize_t, a.cell[near]) + _STEPS
                    near_other = other - near_other + _STEPS
                    turn_a = _SINE[near]
                    turn_b = _SINE[near_other]
                    both += turn_a * turn_b
                    only_a += turn_a * turn_a
                    only_b += turn_b * turn_b
                    alike += _COSINE[near] * _COSINE[near_other] + turn_a * turn_b
                    steps += 1.0
            left = other
            above[column] = cython.cast(cython.int, other)
    evidence[AREA] = cells * (a.step * a.step)
    # A is turned by the transform: twice its angle has the cosine (c² - s²)/scale
    cosines = ((c * c - s * s) * cosines + 2.0 * c * s * sines) / (c * c + s * s)
    evidence[ORIENTATION] = cosines / (cells + doubt_cells)
    evidence[CHANGE] = both / (sqrt(only_a * only_b) + doubt_change)
    evidence[ROUGHNESS] = 1.0 - alike / (steps + doubt_cells)
    evidence[KNOWN] = 1.0 if known else 0.0
    return 0


@cython.ccall
@cython.nogil
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
@cython.exceptval(check=False)
def describe(
    evidence: cython.double[::1],
    doubt_pairs: cython.double,
    doubt_area: cython.double,
    least_roughness: cython.double,
    feature: cython.double[::1],
) -> cython.int:
    """Turn the evidence into features; see `fpmatch.matching.score`."""
    pairs: cython.double = evidence[PAIRS]
    feature[0] = log(1.0 + evidence[LOCAL])
    feature[1] = log((1.0 + evidence[LOCAL]) / (1.0 + pairs))
    feature[2] = sqrt(evidence[UNPAIRED] / (pairs + doubt_pairs))
    feature[3] = log(evidence[AREA] + doubt_area)
    feature[4] = evidence[OVERLAP]
    feature[5] = evidence[ORIENTATION]
    feature[6] = evidence[CHANGE]
    feature[7] = log(evidence[ROUGHNESS] + least_roughness)
    return 0


@cython.ccall
@cython.nogil
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
@cython.exceptval(check=False)
def weigh(
    evidence: cython.double[::1],
    doubt_pairs: cython.double,
    doubt_area: cython.double,
    least_roughness: cython.double,
    standard: cython.double[:, ::1],
    bias: cython.double,
    feature: cython.double[::1],
) -> cython.double:
    """Return the similarity that the evidence amounts to; see `fpmatch.matching.score`.

    The rows of `standard` are the features' middles, spreads and weights; `feature` is scratch.
    """
    k: cython.Py_ssize_t
    total: cython.double = bias
    describe(evidence, doubt_pairs, doubt_area, least_roughness, feature)
    for k in range(feature.shape[0]):
        if k < OF_FLOW or evidence[KNOWN] > 0.0:
            total += standard[2, k] * (feature[k] - standard[0, k]) / standard[1, k]
    if total > 0.0:
        return total + log1p(exp(-total))
    return log1p(exp(total))
