# mypy: ignore-errors
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
from cython.cimports.libc.math import exp, floor, sqrt

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
    a: cython.double = t * (
        0.9998660 + u * (-0.3302995 + u * (0.1801410 + u * (-0.0851330 + u * 0.0208351)))
    )
    if ay > ax:
        a = 0.5 * PI - a
    if x < 0:
        a = PI - a
    if y < 0:
        a = -a
    whole: cython.int = int(floor(a * PER_RADIAN + 0.5))
    return whole & MASK


@cython.locals(k=cython.int)
def _turning(x, y, points, share, bend, count, omit):
    """Return by how much the singular points but `omit` turn the ridges at (x, y), y up."""
    total = 0.0
    for k in range(count):
        if k == omit:
            continue
        argument = angle_of(y - points[k, 1], x - points[k, 0])
        corner: cython.int = argument >> 13
        t = (argument & 8191) * (1.0 / 8192)
        after: cython.int = (corner + 1) & 7
        bent = bend[k, corner] * (1 - t) + bend[k, after] * t
        signed = argument - TURN if argument >= HALF else argument
        total += share[k] * (signed + bent)
    return total


@cython.locals(rows=cython.int, columns=cython.int, b=cython.int, i=cython.int)
def draw_orientation(
    points, share, counts, bend, narrowing, arching, variation, inside, step, level
):
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
                    whole: cython.int = int(floor(at))
                    bend[b, k, corner] -= narrowing[b] * SINE[(whole & MASK) >> TABLE_BITS]
        size = arching[b, 5]
        for i in range(rows):
            y = (0.5 * (rows - 1) - i) * step
            widening = y / size / arching[b, 2]
            wide = arching[b, 1] * (1 + (widening if widening > 0 else 0.0))
            above = arching[b, 0] / (1 + exp(-(y / size + arching[b, 3]) / arching[b, 4]))
            for j in range(inside[b, i, 0], inside[b, i, 1]):
                x = (j - 0.5 * (columns - 1)) * step
                turn = _turning(x, y, points[b], share[b], bend[b], counts[b], -1)
                u = x / size / wide
                turn -= above * u * exp(0.5 * (1 - u * u))
                turn += variation[b, i, j]
                whole = int(floor(turn / LEVEL + 0.5))
                level[b, i, j] = (whole * LEVEL) & (HALF - 1)
    return 0


@cython.locals(
    rows=cython.int, columns=cython.int, lanes=cython.int, sweep=cython.int, k=cython.int
)
def grow_phase(normal, inside, noise, start, step, sweeps, sum_, link, wave):
    """Grow and relax the ridges' phase as unit vectors `wave` (2, R + 2, C + 2, B); return 0.

    `normal` (2, R + 2, C + 2, B) has x and y of the ridges' normal over their period, `inside`
    (R + 2, C + 2, B) is 1 at nodes of the finger and 0 elsewhere, as everywhere in the border.
    Row by row, the phase at a node is the mean of what the nodes before demand, turned by `noise`
    (R, C, B) in turns, or by `start` (2, B) where there are none. `sweeps` times, in turn from the
    end and from the beginning, it becomes the mean of what all eight around demand. `sum_` (2, B)
    and `link` (4, 4, R + 2, C + 2, B) are overwritten, the latter by the advance to the nodes to
    the right, and right, under and left below: cosine, sine, sign of the other's frame, and turns.
    """
    _link(normal, step, link)
    rows, columns, lanes = wave.shape[1] - 2, wave.shape[2] - 2, wave.shape[3]
    tiny: cython.float = 1e-20
    two: cython.float = 2.0
    one: cython.float = 1.0
    for sweep in range(sweeps + 1):
        for ii in range(rows):
            i: cython.int = rows - ii if sweep & 1 else ii + 1
            for jj in range(columns):
                j: cython.int = columns - jj if sweep & 1 else jj + 1
                for b in range(lanes):
                    sum_[0, b] = start[0, b]
                    sum_[1, b] = start[1, b]
                for k in range(4):
                    # the node before on this line, of which the link leads here
                    p: cython.int = i - 1 if k else i
                    q: cython.int = j + k - 2 if k else j - 1
                    # two loops: compilers vectorize with few arrays only
                    for b in range(lanes):
                        x: cython.float = wave[0, p, q, b] * link[k, 0, p, q, b]
                        sum_[0, b] += x - wave[1, p, q, b] * link[k, 1, p, q, b]
                    for b in range(lanes):
                        x = wave[0, p, q, b] * link[k, 1, p, q, b]
                        y: cython.float = wave[1, p, q, b] * link[k, 0, p, q, b]
                        sum_[1, b] += link[k, 2, p, q, b] * (x + y)
                for k in range(4 if sweep else 0):
                    p = i + 1 if k else i
                    q = j + 2 - k if k else j + 1
                    for b in range(lanes):
                        y = link[k, 2, i, j, b] * wave[1, p, q, b]
                        x = wave[0, p, q, b] * link[k, 0, i, j, b]
                        sum_[0, b] += x + y * link[k, 1, i, j, b]
                    for b in range(lanes):
                        y = link[k, 2, i, j, b] * wave[1, p, q, b]
                        x = wave[0, p, q, b] * link[k, 1, i, j, b]
                        sum_[1, b] += y * link[k, 0, i, j, b] - x
                for b in range(lanes):
                    x = sum_[0, b]
                    y = sum_[1, b]
                    root: cython.float = sqrt(x * x + y * y + tiny)
                    scale = inside[i, j, b] / root
                    sum_[0, b] = x * scale
                    sum_[1, b] = y * scale
                if sweep == 0:
                    for b in range(lanes):
                        h = _sine_of_half(noise[i - 1, j - 1, b])
                        c = one - two * h * h
                        root = sqrt(abs(one - h * h))
                        s = two * h * root
                        x = sum_[0, b]
                        y = sum_[1, b]
                        wave[0, i, j, b] = x * c - y * s
                        wave[1, i, j, b] = x * s + y * c
                else:
                    for b in range(lanes):
                        wave[0, i, j, b] = sum_[0, b]
                        wave[1, i, j, b] = sum_[1, b]
    return 0


@cython.locals(i=cython.int, j=cython.int, k=cython.int)
def _link(normal, step, link):
    """Fill the advances from each node to those right, and right, under and left below it."""
    lanes: cython.int = normal.shape[3]
    half: cython.float = 0.5
    one: cython.float = 1.0
    two: cython.float = 2.0
    shift: cython.float = 1024.0
    for i in range(normal.shape[1] - 1):
        for j in range(1, normal.shape[2] - 1):
            for k in range(4):
                p: cython.int = i + 1 if k else i
                q: cython.int = j + 2 - k if k else j + 1
                right = half * step * (q - j)
                down = half * step * (p - i)
                for b in range(lanes):
                    x = normal[0, i, j, b]
                    y = normal[1, i, j, b]
                    ox = normal[0, p, q, b]
                    oy = normal[1, p, q, b]
                    f = one if x * ox + y * oy >= 0 else -one
                    turns = (x + f * ox) * right + (y + f * oy) * down
                    whole: cython.int = int(turns + shift + half)
                    h = _sine_of_half(turns + shift - whole)
                    link[k, 0, i, j, b] = one - two * h * h
                    root: cython.float = sqrt(abs(one - h * h))
                    link[k, 1, i, j, b] = two * h * root
                    link[k, 2, i, j, b] = f
                    link[k, 3, i, j, b] = turns
    return 0


def _sine_of_half(turns):
    """Return the sine of half an angle of -1/2 to 1/2 turns, to 1e-5."""
    a: cython.float = 3.1415800
    b: cython.float = -5.1671200
    c: cython.float = 2.5417800
    d: cython.float = -0.5540850
    u = turns * turns
    return turns * (a + u * (b + u * (c + u * d)))


@cython.locals(b=cython.int, i=cython.int, j=cython.int, k=cython.int, q=cython.int, p=cython.int)
def find_vortices(
    level, period, inside, link, wave, step, spacing, place, phase, turns, minutia, found
):
    """Fill `phase` (B, R, C), `minutia` (B, M, 3) with place and direction, and `found` (B).

    `inside` (B, R, 2) has the first column of nodes of each row and one past the last; `place`
    (B, R, C, 2), 0 to 1, is where in its square a vortex lies; `turns` (2, R, C) is overwritten.
    Of two minutiae nearer than `spacing` periods none is kept. Returns 0.
    """
    rows: cython.int = level.shape[1]
    for b in range(level.shape[0]):
        for i in range(rows):
            for j in range(inside[b, i, 0], inside[b, i, 1]):
                phase[b, i, j] = angle_of(wave[1, i + 1, j + 1, b], wave[0, i + 1, j + 1, b])
        for i in range(rows):
            for j in range(inside[b, i, 0], inside[b, i, 1]):
                # to the right, and under it
                for k in range(2):
                    p, q = i + k, j + 1 - k
                    if p < rows and inside[b, p, 0] <= q < inside[b, p, 1]:
                        t: cython.double = link[2 * k, 3, i + 1, j + 1, b]
                        rest = link[2 * k, 2, i + 1, j + 1, b] * phase[b, p, q] - phase[b, i, j]
                        rest = rest * (1.0 / TURN) - t
                        turns[k, i, j] = t + rest - floor(rest + 0.5)
        count: cython.int = 0
        for i in range(rows - 1):
            begin = max(inside[b, i, 0], inside[b, i + 1, 0])
            end: cython.int = min(inside[b, i, 1], inside[b, i + 1, 1]) - 1
            for j in range(begin, end):
                top, left = link[0, 2, i + 1, j + 1, b], link[2, 2, i + 1, j + 1, b]
                if top * link[2, 2, i + 1, j + 2, b] != left * link[0, 2, i + 2, j + 1, b]:
                    continue  # a singular point
                around = turns[1, i, j] + left * turns[0, i + 1, j]
                around -= top * turns[1, i, j + 1] + turns[0, i, j]
                charge: cython.int = int(floor(around + 0.5))
                if charge == 0 or count == minutia.shape[1]:
                    continue
                minutia[b, count, 0] = (j + place[b, i, j, 0]) * step
                minutia[b, count, 1] = (i + place[b, i, j, 1]) * step
                minutia[b, count, 2] = _direction(level, b, i, j, charge)
                count += 1
        found[b] = _thin_out(minutia[b], count, spacing, period, b, step)
    return 0


@cython.locals(k=cython.int, c=cython.double, s=cython.double, oc=cython.double, os=cython.double)
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


@cython.locals(i=cython.int, j=cython.int, other=cython.int, column=cython.int)
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
    kept: cython.int = 0
    for k in range(count):
        if minutia[k, 2] >= 0:
            for column in range(3):
                minutia[kept, column] = minutia[k, column]
            kept += 1
    return kept
