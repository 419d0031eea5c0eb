# mypy: ignore-errors
"""Kernel: what an extractor finds of fingers pressed on a sensor, without an image.

Fingers are lattices of `_ridge_phase_kernel`; angles are 65,536ths of a turn. All arrays hold a
batch of impressions along their first axis, of which number b is of finger ``of[b]``.
"""

import cython
import numpy as np
from cython.cimports.libc.math import cos, exp, floor, sin, sqrt

if cython.compiled:
    from cython.cimports.fpmatch.lab.synthesis._ridge_phase_kernel import angle_of
else:
    from fpmatch.lab.synthesis._ridge_phase_kernel import angle_of

TURN = cython.declare(cython.int, 65536)
HALF = cython.declare(cython.int, 32768)
QUARTER = cython.declare(cython.int, 16384)
MASK = cython.declare(cython.int, 65535)
RADIANS = cython.declare(cython.double, 9.587379924285257e-05)  # 2π / TURN
STICKING_RADIUS = cython.declare(cython.double, 0.35)  # as `fpmatch.lab.synthesis.warp`
EDGE_START = cython.declare(cython.double, 0.86)  # as `fpmatch.lab.synthesis.contact`
EDGE_STEEPNESS = cython.declare(cython.double, 50.0)
ROUNDS = cython.declare(cython.int, 8)  # of the inverse of the warp
BROKEN = cython.declare(cython.double, 0.6)  # share of spurious minutiae that come in pairs
LEAST_GAP = cython.declare(cython.double, 0.4)  # between them, in cells
MORE_GAP = cython.declare(cython.double, 0.6)
SIDE = cython.declare(cython.int, 8)  # bits along a cell
NONE = cython.declare(cython.ulonglong, 0)
ONE = cython.declare(cython.ulonglong, 1)
SQUARENESS = cython.declare(cython.int, 64)  # steps of the tables of the outline

_RATIO = np.arange(66) / 64
_ROUND, _SQUARE = (
    memoryview((1 + _RATIO**p) ** (1 / p)) for p in (2.1, 2.7)
)  # exponents of the superellipses at the tip and at the joint
AT_TIP = cython.declare(cython.double[::1], _ROUND)
AT_JOINT = cython.declare(cython.double[::1], _SQUARE)


def _slip(x, y, w):
    """Return the share of the finger's motion that the skin at (x, y) takes part in."""
    ux = (w[4] * (x - w[0]) + w[5] * (y - w[1])) / w[2]
    uy = (w[4] * (y - w[1]) - w[5] * (x - w[0])) / w[3]
    slip = sqrt(ux * ux + uy * uy) - STICKING_RADIUS
    if slip <= 0:
        return 0.0
    if slip >= 1:
        return 1.0
    t = slip * slip * 2.4674011002723395  # (π/2)²
    s = 1.5707963267948966 * slip * (1 - t / 6 * (1 - t / 20 * (1 - t / 42 * (1 - t / 72))))
    return s * s


def outline_radius(x, y, w):
    """Return the radius of a place in a contact, as `fpmatch.lab.synthesis.contact`."""
    across = abs(w[4] * (x - w[0]) + w[5] * (y - w[1])) / w[2]
    along: cython.double = (w[4] * (y - w[1]) - w[5] * (x - w[0])) / w[3]
    table = AT_JOINT if along > 0 else AT_TIP
    along = abs(along)
    larger, smaller = (across, along) if across > along else (along, across)
    if larger <= 0:
        return 0.0
    at = SQUARENESS * smaller / larger
    step: cython.int = int(at)
    t = at - step
    return larger * (table[step] * (1 - t) + table[step + 1] * t)


@cython.locals(b=cython.int, i=cython.int, j=cython.int)
def map_corners(warp, cell, corner):
    """Fill the place in the master (B, R + 1, C + 1, 2) of the corners of all cells; return 0.

    `warp` (B, 13) has centre, half axes, cosine and sine of the rotation, scale, shift of the
    placement; cosine and sine of the torsion, and the slide; `cell` is the side in pixels.
    """
    for b in range(corner.shape[0]):
        w = warp[b]
        for i in range(corner.shape[1]):
            for j in range(corner.shape[2]):
                x, y = j * cell, i * cell
                slip = _slip(x, y, w)
                ax, ay = x - w[0], y - w[1]
                x -= slip * (w[9] * ax - w[10] * ay - ax + w[11]) + w[7]
                y -= slip * (w[10] * ax + w[9] * ay - ay + w[12]) + w[8]
                corner[b, i, j, 0] = (w[4] * x + w[5] * y) / w[6]
                corner[b, i, j, 1] = (w[4] * y - w[5] * x) / w[6]
    return 0


@cython.locals(b=cython.int, i=cython.int, j=cython.int, k=cython.int)
def press(warp, corner, cell, outline, spots, edges, of, step, threshold, strength, doubt):
    """Add edge and spots to `threshold` (B, R, C), and fill `doubt`, 2 where no skin touches.

    `outline` is the relative size of the contact in each cell, `spots` (B, S, 5) have x, y, both
    inverse extents in pixels, and height. Returns 0.
    """
    for b in range(doubt.shape[0]):
        w = warp[b]
        for i in range(doubt.shape[1]):
            for j in range(doubt.shape[2]):
                doubt[b, i, j] = 2.0
                mx = 0.5 * (corner[b, i, j, 0] + corner[b, i + 1, j + 1, 0])
                my = 0.5 * (corner[b, i, j, 1] + corner[b, i + 1, j + 1, 1])
                row: cython.int = int(floor(my / step + 0.5))
                if row < 0 or row >= edges.shape[1]:
                    continue
                if mx < edges[of[b], row, 0] or mx > edges[of[b], row, 1]:
                    continue
                x, y = (j + 0.5) * cell, (i + 0.5) * cell
                out = outline_radius(x, y, w) * outline[b, i, j] - EDGE_START
                if out > 0:
                    threshold[b, i, j] += EDGE_STEEPNESS * out * out
                for k in range(spots.shape[1]):
                    if spots[b, k, 4] != 0:
                        dx = (x - spots[b, k, 0]) * spots[b, k, 2]
                        dy = (y - spots[b, k, 1]) * spots[b, k, 3]
                        threshold[b, i, j] += spots[b, k, 4] * exp(-0.5 * (dx * dx + dy * dy))
                value: cython.double = abs(threshold[b, i, j]) / strength[b, i, j]
                doubt[b, i, j] = 2.0 if value > 2 else value
    return 0


@cython.locals(b=cython.int, i=cython.int, j=cython.int)
def show_cells(
    corner, cell, doubt, most_doubt, width, of, step, level, period, phase, inside,
    noise, turn_noise, mask, orientation, ridges,
):  # fmt: skip
    """Fill mask, orientation in radians and ridges of the cells (B, R, C); return 0.

    Cells of a larger `doubt` than `most_doubt` are outside the mask. Ridges are where the
    phase is less than `width` from their crest. `turn_noise` is added to orientations in 65,536ths
    of a turn, `noise` to the phase of a cell.
    """
    for b in range(mask.shape[0]):
        f = of[b]
        for i in range(mask.shape[1]):
            for j in range(mask.shape[2]):
                mask[b, i, j] = 0
                orientation[b, i, j] = 0
                ridges[b, i, j] = 0
                if doubt[b, i, j] > most_doubt:
                    continue
                x, y = corner[b, i, j, 0], corner[b, i, j, 1]
                ax = 0.5 * (corner[b, i, j + 1, 0] - x)
                ay = 0.5 * (corner[b, i, j + 1, 1] - y)
                bx = 0.5 * (corner[b, i + 1, j, 0] - x)
                by = 0.5 * (corner[b, i + 1, j, 1] - y)
                ax += 0.5 * (corner[b, i + 1, j + 1, 0] - corner[b, i + 1, j, 0])
                ay += 0.5 * (corner[b, i + 1, j + 1, 1] - corner[b, i + 1, j, 1])
                bx += 0.5 * (corner[b, i + 1, j + 1, 0] - corner[b, i, j + 1, 0])
                by += 0.5 * (corner[b, i + 1, j + 1, 1] - corner[b, i, j + 1, 1])
                angle = _level_at(x + 0.5 * (ax + bx), y + 0.5 * (ay + by), f, step, level, inside)
                if angle < 0:
                    continue
                mask[b, i, j] = 1
                turned = _to_image(angle, ax, ay, bx, by) + turn_noise[b, i, j]
                orientation[b, i, j] = (turned & (HALF - 1)) * RADIANS
                ridges[b, i, j] = _picture(
                    x, y, ax / SIDE, ay / SIDE, bx / SIDE, by / SIDE, width,
                    noise[b, i, j], f, step, level, period, phase, inside,
                )  # fmt: skip
    return 0


@cython.locals(i=cython.int, j=cython.int)
def _level_at(x, y, f, step, level, inside):
    """Return the ridge orientation of a finger at the node nearest to (x, y), -1 for none."""
    i, j = int(floor(y / step + 0.5)), int(floor(x / step + 0.5))
    if i < 0 or i >= level.shape[1] or j < inside[f, i, 0] or j >= inside[f, i, 1]:
        return -1
    return level[f, i, j]


def _to_image(angle, ax, ay, bx, by):
    """Return a direction of the master in the image, whose x and y axes map to a and b."""
    c, s = cosine(angle), -cosine(angle - QUARTER)
    # the inverse of the matrix (a, b), but for its determinant
    x = by * c - bx * s
    y = ax * s - ay * c
    return angle_of(-y, x)


def cosine(angle):
    """Return the cosine of an angle in 65,536ths of a turn."""
    whole = angle & MASK
    t = (whole if whole < HALF else TURN - whole) * (2 * RADIANS)  # 0 to 2π
    t = 0.5 * t - 1.5707963267948966
    u = t * t
    return -t * (1 - u / 6 * (1 - u / 20 * (1 - u / 42 * (1 - u / 72))))


@cython.locals(
    quarter=cython.int, row=cython.int, column=cython.int, i=cython.int, j=cython.int, k=cython.int,
    across=cython.int, down=cython.int,
)  # fmt: skip
def _picture(x, y, ax, ay, bx, by, width, noise, f, step, level, period, phase, inside):
    """Return the ridges of a cell, 8 by 8 bits, each at (x, y) + column a + row b in the master."""
    bits = 0
    for quarter in range(4):
        row, column = quarter // 2 * 4, quarter % 2 * 4
        mx, my = x + (column + 2) * ax + (row + 2) * bx, y + (column + 2) * ay + (row + 2) * by
        i, j = int(floor(my / step + 0.5)), int(floor(mx / step + 0.5))
        if i < 0 or i >= level.shape[1] or j < inside[f, i, 0] or j >= inside[f, i, 1]:
            continue
        angle = level[f, i, j]
        per_px: cython.double = TURN / period[f, i, j]
        kx = -cosine(angle - QUARTER) * per_px
        ky = -cosine(angle) * per_px
        mx += -1.5 * (ax + bx) - j * step
        my += -1.5 * (ay + by) - i * step
        part: cython.int = int(kx * mx + ky * my)
        here: cython.int = phase[f, i, j] + noise + part + width - 1
        across, down = int(kx * ax + ky * ay), int(kx * bx + ky * by)
        for k in range(16):
            at: cython.int = (here + (k & 3) * across + (k >> 2) * down) & MASK
            hit = ONE if at < 2 * width - 1 else NONE
            bits |= hit << (SIDE * (row + (k >> 2)) + column + (k & 3))
    return bits


@cython.locals(b=cython.int, i=cython.int, j=cython.int, k=cython.int)
def show_minutiae(
    warp, corner, cell, width, height, border, doubt, of, minutiae, count, random, constants,
    bifurcation, out, found,
):  # fmt: skip
    """Fill `out` (B, M, 5): x, y, direction in radians, kind and quality; `found` (B) their number.

    `random` (B, N, 12) are even numbers for each minutia, `bifurcation` (F, N) is set for some of
    the finger's; `constants` are described in `template_impressions`. Returns 0.
    """
    for b in range(out.shape[0]):
        w = warp[b]
        f: cython.int = of[b]
        n: cython.int = 0
        for k in range(count[f]):
            if n == out.shape[1]:
                break
            r = random[b, k]
            mx, my = minutiae[f, k, 0], minutiae[f, k, 1]
            gx = w[6] * (w[4] * mx - w[5] * my) + w[7]
            gy = w[6] * (w[5] * mx + w[4] * my) + w[8]
            x, y = gx, gy
            for _ in range(ROUNDS):
                slip = _slip(x, y, w)
                ax, ay = x - w[0], y - w[1]
                x = gx + slip * (w[9] * ax - w[10] * ay - ax + w[11])
                y = gy + slip * (w[10] * ax + w[9] * ay - ay + w[12])
            i, j = int(floor(y / cell)), int(floor(x / cell))
            if i < 0 or j < 0 or i >= doubt.shape[1] or j >= doubt.shape[2]:
                continue
            unsure: cython.double = doubt[b, i, j]
            missed = constants[0] + (1 - constants[0]) * (unsure - constants[1]) / constants[2]
            if r[0] < max(missed, constants[0]) or unsure >= 2:
                continue
            spread = constants[3] * (1 + unsure) * _tail(r[10])
            x += spread * 2 * (r[1] + r[2] + r[3] - 1.5)
            y += spread * 2 * (r[4] + r[5] + r[6] - 1.5)
            if x < border or y < border or x >= width - border or y >= height - border:
                continue
            ax = corner[b, i, j + 1, 0] - corner[b, i, j, 0]
            ay = corner[b, i, j + 1, 1] - corner[b, i, j, 1]
            bx = corner[b, i + 1, j, 0] - corner[b, i, j, 0]
            by = corner[b, i + 1, j, 1] - corner[b, i, j, 1]
            whole: cython.int = int(minutiae[f, k, 2])
            turned = _to_image(whole, ax, ay, bx, by) * RADIANS
            spread = constants[4] * (1 + unsure) * _tail(r[11])
            turned += spread * 2 * (r[1] + r[4] + r[7] - 1.5)
            out[b, n, 0], out[b, n, 1], out[b, n, 2] = x, y, turned
            flipped: cython.bint = r[8] < constants[5] * (1 + unsure)
            out[b, n, 3] = 2 if (bifurcation[f, k] != 0) != flipped else 1
            out[b, n, 4] = _quality(unsure, r[9], constants)
            n += 1
        found[b] = n
    return 0


@cython.locals(b=cython.int, i=cython.int, j=cython.int, end=cython.int)
def add_spurious(
    cell, width, height, border, doubt, mask, orientation, random, constants, out, found
):
    """Append minutiae that the finger lacks to `out`; `random` (B, R, C, 8) are even; return 0."""
    for b in range(out.shape[0]):
        n: cython.int = found[b]
        for i in range(mask.shape[1]):
            for j in range(mask.shape[2]):
                if mask[b, i, j] == 0 or n == out.shape[1]:
                    continue
                r = random[b, i, j]
                unsure: cython.double = doubt[b, i, j]
                if r[0] >= constants[6] + constants[7] * unsure * unsure:
                    continue
                x, y = (j + r[1]) * cell, (i + r[2]) * cell
                along = orientation[b, i, j]
                if r[3] < 0.5:
                    along += 3.141592653589793
                # the other end of a broken ridge
                gap = (LEAST_GAP + MORE_GAP * r[4]) * cell if r[6] < BROKEN else 0.0
                for end in range(2 if gap > 0 else 1):
                    if end:
                        x -= gap * cos(along)
                        y += gap * sin(along)
                    if x < border or y < border or x >= width - border or y >= height - border:
                        continue
                    if n == out.shape[1]:
                        continue
                    turned = along + constants[4] * (1 + unsure) * 3.4 * (r[4 + end] - 0.5)
                    out[b, n, 0] = x
                    out[b, n, 1] = y
                    out[b, n, 2] = turned + 3.141592653589793 * end
                    out[b, n, 3] = 1 if r[7] < 0.5 else 2
                    out[b, n, 4] = _quality(unsure + constants[11], r[5], constants)
                    n += 1
        found[b] = n
    return 0


def _tail(even):
    """Return a factor of mean square 1 that gives normal numbers long tails."""
    return 0.5 + 2.0 * even * even * even * even * even


def _quality(unsure, even, constants):
    """Return the quality of a minutia, 0 to 100."""
    quality = constants[8] - constants[9] * unsure + constants[10] * (even - 0.5)
    return floor(min(max(quality, 1.0), 100.0))
