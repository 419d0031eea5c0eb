"""Kernel: ridge orientation, ridge phase and minutiae of fingers, on a coarse lattice.

The height of the ridges at a point is the cosine of a phase, which advances by a turn from ridge to
ridge. Nodes of the lattice lie `step` pixels apart, x right and y down. The phase grows from node
to node by the advance that ridge orientation and period demand, with some noise, and is then
relaxed; it keeps vortices, around which it advances by a turn: there a ridge begins. These are the
minutiae, as in the amplitude and frequency model of Larkin and Fletcher, "A coherent framework for
fingerprint analysis: are fingerprints holograms?", Optics Express 15 (2007).

All arrays hold a batch of fingers along their first axis. Angles are 65,536ths of a turn.
"""

import cython
import numpy as np
from cython.cimports.libc.math import exp, floor

TURN = cython.declare(cython.int, 65536)
HALF = cython.declare(cython.int, 32768)
MASK = cython.declare(cython.int, 65535)
TABLE_BITS = cython.declare(cython.int, 6)  # of an angle, below those that the table looks up
LEVEL = cython.declare(cython.int, 16)  # of orientations, so that rounding differs on no machine
CORNERS = cython.declare(cython.int, 8)  # of the correction around a singular point
PI = cython.declare(cython.double, 3.141592653589793)
PER_RADIAN = cython.declare(cython.double, 10430.378350470453)  # TURN / 2π
TINY = cython.declare(cython.double, 1e-12)

_ANGLES = np.arange(1024) * (2 * np.pi / 1024)
COSINE = cython.declare(cython.float[::1], memoryview(np.cos(_ANGLES).astype(np.float32)))
SINE = cython.declare(cython.float[::1], memoryview(np.sin(_ANGLES).astype(np.float32)))


def angle_of(y, x):
    """Return the angle of a vector in 65,536ths of a turn, to about one of them."""
    ax, ay = abs(x), abs(y)
    larger, smaller = (ay, ax) if ay > ax else (ax, ay)
    t = smaller / (larger + TINY)
    u = t * t
    # Abramowitz and Stegun 4.4.49
    a = t * (0.9998660 + u * (-0.3302995 + u * (0.1801410 + u * (-0.0851330 + u * 0.0208351))))
    if ay > ax:
        a = 0.5 * PI - a
    if x < 0:
        a = PI - a
    if y < 0:
        a = -a
    whole = int(floor(a * PER_RADIAN + 0.5))
    return whole & MASK


def _turning(x, y, points, share, bend, count, omit):
    """Return by how much the singular points but `omit` turn the ridges at (x, y), y up."""
    total = 0.0
    for k in range(count):
        if k == omit:
            continue
        argument = angle_of(y - points[k, 1], x - points[k, 0])
        corner = argument >> 13
        t = (argument & 8191) * (1.0 / 8192)
        after = (corner + 1) & 7
        bent = bend[k, corner] * (1 - t) + bend[k, after] * t
        signed = argument - TURN if argument >= HALF else argument
        total += share[k] * (signed + bent)
    return total


def draw_orientation(points, share, counts, bend, narrowing, arching, variation, step, level):
    """Fill the ridge orientation `level` (B, R, C), from 0 to half a turn.

    `points` (B, 4, 2) are singular points in pixels from the middle, y up, of which `counts` (B)
    exist, with `share` (B, 4), a half for a core and minus a half for a delta, and `bend`
    (B, 4, 8), the corrections of their arguments; those of cores are narrowed by `narrowing` (B).
    `arching` (B, 6) has steepness, half width, widening, joint and its softness, and size;
    `variation` (B, R, C) is added. All but lengths in 65,536ths of a turn. Returns 0.
    """
    rows, columns = level.shape[1], level.shape[2]
    for b in range(level.shape[0]):
        for k in range(counts[b]):
            if share[b, k] > 0:
                x, y = points[b, k, 0], points[b, k, 1]
                opening = 2 * _turning(x, y, points[b], share[b], bend[b], counts[b], k)
                for corner in range(CORNERS):
                    at = corner * (1.0 * TURN / CORNERS) - opening
                    whole = int(floor(at))
                    bend[b, k, corner] -= narrowing[b] * SINE[(whole & MASK) >> TABLE_BITS]
        size = arching[b, 5]
        for i in range(rows):
            y = (0.5 * (rows - 1) - i) * step
            widening = y / size / arching[b, 2]
            wide = arching[b, 1] * (1 + (widening if widening > 0 else 0.0))
            above = arching[b, 0] / (1 + exp(-(y / size + arching[b, 3]) / arching[b, 4]))
            for j in range(columns):
                x = (j - 0.5 * (columns - 1)) * step
                turn = _turning(x, y, points[b], share[b], bend[b], counts[b], -1)
                u = x / size / wide
                turn -= above * u * exp(0.5 * (1 - u * u))
                turn += variation[b, i, j]
                whole = int(floor(turn / LEVEL + 0.5))
                level[b, i, j] = (whole * LEVEL) & (HALF - 1)
    return 0


def _advance(level, period, b, i, j, di, dj, step):
    """Return the advance of the phase from node (i, j) by (di, dj), in its frame.

    A multiple of two, plus one where the other node's frame is turned round.
    """
    angle, other = level[b, i, j], level[b, i + di, j + dj]
    c, s = COSINE[angle >> TABLE_BITS], SINE[angle >> TABLE_BITS]
    oc, os = COSINE[other >> TABLE_BITS], SINE[other >> TABLE_BITS]
    turned = 0
    w, ow = 1.0 / period[b, i, j], 1.0 / period[b, i + di, j + dj]
    if c * oc + s * os < 0:
        turned, ow = 1, -ow
    # the phase rises along the normal (-sin, cos), y up
    along = -(s * w + os * ow) * dj - (c * w + oc * ow) * di
    whole = int(floor(0.5 * along * step * TURN + 0.5))
    return 2 * whole + turned


def grow_phase(level, period, inside, first, noise, sweeps, step, link, phase):
    """Fill the phase (B, R, C) at the nodes of `inside` (B, R, 2), a range of columns a row.

    `noise` (B, R, C) is added while it grows, from `first` (B) at the first node; it is then
    relaxed `sweeps` times towards what its neighbours demand. `link` (4, R, C) is overwritten.
    Returns 0.
    """
    for b in range(level.shape[0]):
        _link(level, period, inside, b, step, link)
        for sweep in range(sweeps + 1):
            _sweep(inside, first[b], noise, b, sweep, link, phase)
    return 0


def _link(level, period, inside, b, step, link):
    """Fill the advances from each node to those right, and right, under and left below it."""
    rows = level.shape[1]
    for i in range(rows):
        for j in range(inside[b, i, 0], inside[b, i, 1]):
            if j + 1 < inside[b, i, 1]:
                link[0, i, j] = _advance(level, period, b, i, j, 0, 1, step)
            if i + 1 < rows:
                for k in range(1, 4):
                    if inside[b, i + 1, 0] <= j + 2 - k < inside[b, i + 1, 1]:
                        link[k, i, j] = _advance(level, period, b, i, j, 1, 2 - k, step)
    return 0


def _sweep(inside, first, noise, b, sweep, link, phase):
    """Set each node's phase to the mean of what the nodes around demand; the first grows it."""
    rows = phase.shape[1]
    back = sweep & 1
    for ii in range(rows):
        i = rows - 1 - ii if back else ii
        begin, end = inside[b, i, 0], inside[b, i, 1]
        for jj in range(end - begin):
            j = end - 1 - jj if back else begin + jj
            x = y = 0.0
            for side in range(8):
                # of the four links onward and the four that lead here
                k = side & 3
                onward = side < 4
                if onward and sweep == 0:
                    continue
                di = (1 if k else 0) if onward else (-1 if k else 0)
                dj = (1 if k == 0 else 2 - k) * (1 if onward else -1)
                if (
                    i + di < 0
                    or i + di >= rows
                    or j + dj < inside[b, i + di, 0]
                    or j + dj >= inside[b, i + di, 1]
                ):
                    continue
                other = phase[b, i + di, j + dj]
                if onward:
                    # other - advance in this frame
                    code = link[k, i, j]
                    value = (-other if code & 1 else other) - (code >> 1)
                else:
                    code = link[k, i + di, j + dj]
                    value = other + (code >> 1)
                    value = -value if code & 1 else value
                at = (value & MASK) >> TABLE_BITS
                x += COSINE[at]
                y += SINE[at]
            if x * x + y * y < TINY:
                phase[b, i, j] = first if sweep == 0 else phase[b, i, j]
            else:
                phase[b, i, j] = angle_of(y, x)
            if sweep == 0:
                phase[b, i, j] = (phase[b, i, j] + noise[b, i, j]) & MASK
    return 0


def find_vortices(level, period, inside, phase, step, spacing, place, minutia, found):
    """Fill `minutia` (B, M, 3) with place and direction of vortices, `found` (B) with their number.

    `place` (B, R, C, 2), 0 to 1, is where in its square a vortex lies. Of two nearer than
    `spacing` periods none is kept. Returns 0.
    """
    for b in range(level.shape[0]):
        count = 0
        for i in range(level.shape[1] - 1):
            begin = max(inside[b, i, 0], inside[b, i + 1, 0])
            end = min(inside[b, i, 1], inside[b, i + 1, 1]) - 1
            for j in range(begin, end):
                charge = _charge(level, period, phase, b, i, j, step)
                if charge == 0 or count == minutia.shape[1]:
                    continue
                minutia[b, count, 0] = (j + place[b, i, j, 0]) * step
                minutia[b, count, 1] = (i + place[b, i, j, 1]) * step
                minutia[b, count, 2] = _direction(level, b, i, j, charge)
                count += 1
        found[b] = _thin_out(minutia[b], count, spacing, period, b, step)
    return 0


def _edge(level, period, phase, b, i, j, di, dj, step):
    """Return the whole advance of the phase along an edge, as `_advance` does."""
    code = _advance(level, period, b, i, j, di, dj, step)
    other = phase[b, i + di, j + dj]
    rest = ((-other if code & 1 else other) - phase[b, i, j] - (code >> 1) + HALF) & MASK
    return 2 * ((code >> 1) + rest - HALF) + (code & 1)


def _charge(level, period, phase, b, i, j, step):
    """Return by how many turns the phase advances around a square; 0 at singular points."""
    top = _edge(level, period, phase, b, i, j, 0, 1, step)
    left = _edge(level, period, phase, b, i, j, 1, 0, step)
    right = _edge(level, period, phase, b, i, j + 1, 1, 0, step)
    bottom = _edge(level, period, phase, b, i + 1, j, 0, 1, step)
    if (top ^ left ^ right ^ bottom) & 1:
        return 0
    lower = -(bottom >> 1) if left & 1 else bottom >> 1
    later = -(right >> 1) if top & 1 else right >> 1
    around = (left >> 1) + lower - later - (top >> 1)
    return (around + HALF) >> 16


def _direction(level, b, i, j, charge):
    """Return the direction of a minutia: the mean of the square's, where there are more ridges."""
    angle = level[b, i, j]
    c, s = COSINE[angle >> TABLE_BITS], SINE[angle >> TABLE_BITS]
    x, y = c, s
    for k in range(1, 4):
        other = level[b, i + (k >> 1), j + (k & 1)] >> TABLE_BITS
        oc, os = COSINE[other], SINE[other]
        sign = 1.0 if c * oc + s * os > 0 else -1.0
        x += sign * oc
        y += sign * os
    return angle_of(y * charge, x * charge)


def _thin_out(minutia, count, spacing, period, b, step):
    """Remove minutiae with another within `spacing` periods; return how many are left."""
    for k in range(count):
        if minutia[k, 2] < 0:
            continue
        i, j = int(minutia[k, 1] / step), int(minutia[k, 0] / step)
        reach = spacing * period[b, i, j]
        for other in range(k + 1, count):
            dx = minutia[other, 0] - minutia[k, 0]
            dy = minutia[other, 1] - minutia[k, 1]
            if dy > reach + step:
                break
            if minutia[other, 2] >= 0 and dx * dx + dy * dy < reach * reach:
                minutia[other, 2] = -1
                minutia[k, 2] = -1
                break
    kept = 0
    for k in range(count):
        if minutia[k, 2] >= 0:
            for column in range(3):
                minutia[kept, column] = minutia[k, column]
            kept += 1
    return kept
