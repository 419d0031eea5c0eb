"""Kernel: what the two prints say to an alignment: ring points kept, and ridges that agree.

A transform is (c, s, x, y) as `_align_kernel` has it; `evidence` are the entries named below.
Interpreted, the functions run as they stand.
"""

import cython
import numpy as np

if cython.compiled:
    from cython.cimports.fpmatch.matching._print_kernel import Print
    from cython.cimports.libc.math import exp
    from cython.cimports.libc.math import pow as power
else:
    from math import exp
    from math import pow as power

    from fpmatch.matching._print_kernel import Print

from fpmatch.matching.rounding import ORIENTATIONS

COMPILED = cython.compiled

# Entries of the evidence:
PAIRS = cython.declare(cython.Py_ssize_t, 0)
LOCAL = cython.declare(cython.Py_ssize_t, 1)
CIRCLE = cython.declare(cython.Py_ssize_t, 2)
UNPAIRED = cython.declare(cython.Py_ssize_t, 3)
COMMON = cython.declare(cython.Py_ssize_t, 4)
ORIENTATION = cython.declare(cython.Py_ssize_t, 5)
OVERLAP = cython.declare(cython.Py_ssize_t, 6)
ENTRIES = 7

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
    doubt: cython.double,
    unknown: cython.double,
    taken: cython.int[::1],
    evidence: cython.double[::1],
) -> cython.int:
    """Gather the evidence of an alignment of A on B.

    ``partner[i]`` is the index in B of what minutia i of A is paired with, or -1; `bent` holds
    where it lies. To the common cells over which the orientation is a mean `doubt` more are
    added; it is `unknown` where either print's is. `taken`, as long as B, is scratch.
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
    cells: cython.double
    area: cython.double
    smaller: cython.double
    scale: cython.double = c * c + s * s
    for j in range(b.size):
        taken[j] = 0
    for i in range(a.size):
        j = partner[i]
        if j >= 0:
            pairs += 1.0
            common += 1.0
            local += cython.cast(cython.double, likeness[i, j])
            taken[j] = 1
        elif b.holds(bent[0, i], bent[1, i]):
            common += 1.0
            unpaired_a += a.quality[i]
    for j in range(b.size):
        if taken[j]:
            common += 1.0
            continue
        px = b.points[0, j] - x
        py = b.points[1, j] - y
        if a.holds((c * px + s * py) / scale, (c * py - s * px) / scale):
            common += 1.0
            unpaired_b += b.quality[j]
    field_agreement(a, b, c, s, x, y, evidence)
    cells = evidence[OVERLAP]
    evidence[ORIENTATION] /= cells + doubt
    if not (a.has_flow and b.has_flow):
        evidence[ORIENTATION] = unknown
    smaller = a.inside * (a.step * a.step)
    area = b.inside * (b.step * b.step)
    smaller = area if area < smaller else smaller
    area = cells * (a.step * a.step)
    evidence[OVERLAP] = 0.0
    if smaller > 0.0:
        evidence[OVERLAP] = area / smaller if area < smaller else 1.0
    evidence[PAIRS] = pairs
    evidence[LOCAL] = local
    evidence[CIRCLE] = ring_agreement(a, b, partner)
    evidence[UNPAIRED] = unpaired_a + unpaired_b
    evidence[COMMON] = common
    return 0


@cython.ccall
@cython.nogil
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.exceptval(check=False)
def ring_agreement(a: Print, b: Print, partner: cython.int[::1]) -> cython.double:
    """Return the agreement on the unit circle of the one-rings of all pairs.

    For each pair of minutiae and each point of the one's ring whose partner stands in the other's:
    the smaller of their weights times the cosine between their places on the circle.
    """
    i: cython.Py_ssize_t
    j: cython.Py_ssize_t
    k: cython.Py_ssize_t
    m: cython.Py_ssize_t
    other: cython.int
    weight: cython.double
    total: cython.double = 0.0
    for i in range(a.size):
        j = partner[i]
        if j < 0:
            continue
        for k in range(a.ring_start[i], a.ring_start[i + 1]):
            other = partner[a.ring[k]]
            if other < 0:
                continue
            for m in range(b.ring_start[j], b.ring_start[j + 1]):
                if b.ring[m] == other:
                    weight = a.circle[2, k]
                    if b.circle[2, m] < weight:
                        weight = b.circle[2, m]
                    total += weight * (
                        a.circle[0, k] * b.circle[0, m] + a.circle[1, k] * b.circle[1, m]
                    )
                    break
    return total


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
    evidence: cython.double[::1],
) -> cython.int:
    """Lay the orientation field of A over that of B.

    The evidence receives as overlap the number of cells of A that fall into the region of B, and
    as orientation the sum of the cosines of twice the difference between the orientations.
    """
    row: cython.int
    column: cython.int
    place: cython.Py_ssize_t
    code: cython.Py_ssize_t
    other: cython.Py_ssize_t
    ax: cython.double
    ay: cython.double
    bx: cython.double
    by: cython.double
    cells: cython.double = 0.0
    cosines: cython.double = 0.0
    sines: cython.double = 0.0
    scale: cython.double = c * c + s * s
    per_px: cython.double = 1.0 / b.step
    place = a.cell_at
    for row in range(a.rows):
        ay = -(a.first_row + row + 0.5) * a.step
        for column in range(a.columns):
            code = cython.cast(cython.Py_ssize_t, a.cell[place])
            place += 1
            if code == 0:
                continue
            ax = (a.first_column + column + 0.5) * a.step
            bx = (x + c * ax - s * ay) * per_px - b.first_column
            by = -(y + s * ax + c * ay) * per_px - b.first_row
            if not (0.0 <= bx < b.columns and 0.0 <= by < b.rows):
                continue
            other = cython.cast(cython.Py_ssize_t, by) * b.columns
            other += cython.cast(cython.Py_ssize_t, bx)
            other = cython.cast(cython.Py_ssize_t, b.cell[b.cell_at + other])
            if other == 0:
                continue
            cells += 1.0
            cosines += _COSINE[other - code + _STEPS]
            sines += _SINE[other - code + _STEPS]
    evidence[OVERLAP] = cells
    # A is turned by the transform: twice its angle has the cosine (c² - s²)/scale
    evidence[ORIENTATION] = ((c * c - s * s) * cosines + 2.0 * c * s * sines) / scale
    return 0


@cython.ccall
@cython.nogil
@cython.boundscheck(False)
@cython.wraparound(False)
@cython.cdivision(True)
@cython.exceptval(check=False)
def weigh(evidence: cython.double[::1], parameters: cython.double[::1]) -> cython.double:
    """Return the similarity that the evidence amounts to; see `fpmatch.matching.score`.

    The `parameters` are, in order: local, circle and unpaired power, unpaired offset, orientation
    and overlap weight.
    """
    circle: cython.double = evidence[CIRCLE] if evidence[CIRCLE] > 0.0 else 0.0
    for_: cython.double = power(1.0 + evidence[LOCAL], parameters[0])
    for_ *= power(1.0 + circle, parameters[1])
    for_ *= exp(parameters[4] * evidence[ORIENTATION] + parameters[5] * evidence[OVERLAP])
    return for_ / power(parameters[3] + evidence[UNPAIRED], parameters[2])
