# mypy: ignore-errors
"""Kernel: small steps of preparing prints, each a pass over an array.

They are the box around the mask of a ridge field, the codes of the ridge orientation, the qualities
of minutiae and the rounding of weights.
"""

import cython

from fpmatch.templates import plausibility

if cython.compiled:
    from cython.cimports.libc.math import rint
else:
    rint = round  # to even, too

STEPS = cython.declare(
    cython.double, 100.0
)  # of a quality and of the root of a weight, from 0 to 1
MOST = cython.declare(cython.double, 255.0)  # steps of the root of a weight
ORIENTATIONS = cython.declare(cython.int, 255)  # steps in half a turn
LEAST_EVEN = cython.declare(cython.double, plausibility.LEAST_EVEN)
LEAST_EVEN_OF_FEW = cython.declare(cython.double, plausibility.LEAST_EVEN_OF_FEW)
FEW_MINUTIAE = cython.declare(cython.longlong, plausibility.FEW_MINUTIAE)


def box_of(mask, box):
    """Write top, bottom, left and right of the box around a mask, all 0 where it is empty.

    Bottom and right are the first row and column below it and to the right of it.
    """
    rows, columns = mask.shape[0], mask.shape[1]
    top = bottom = right = 0
    left = columns
    for row in range(rows):
        first = 0
        while first < columns and not mask[row, first]:
            first += 1
        if first == columns:
            continue
        last = columns - 1
        while not mask[row, last]:
            last -= 1
        if bottom == 0:
            top = row
        bottom = row + 1
        left = min(left, first)
        right = max(right, last + 1)
    box[0], box[1], box[2], box[3] = top, bottom, left if bottom else 0, right
    return 0


def write_codes(orientation, mask, per_radian, code):
    """Fill `code` for the cells of a mask: 0 outside.

    Inside, it is the orientation in radians in steps of ``1 / per_radian``, from 1 on.
    """
    for i in range(code.shape[0]):
        code[i] = 0
        if mask[i]:
            step = cython.cast(cython.longlong, rint(orientation[i] * per_radian))
            step %= ORIENTATIONS
            if step < 0:  # compiled, a remainder has the sign of the number
                step += ORIENTATIONS
            code[i] = step + 1
    return 0


@cython.locals(i=cython.Py_ssize_t)
def write_qualities(quality, start, usual, scaled):
    """Fill `scaled` with the qualities of the minutiae of many prints, 0 to 1, from 0 to 100.

    Print k has the minutiae from ``start[k]`` up to the next. Where all are 0, or all 100, its
    template gives none, and they are the usual one; so they are where a few minutiae have nearly
    all of the quality (`plausibility.evenness`): no extraction gives such qualities, by which most
    minutiae would count for nothing where they have no partner.
    """
    for k in range(start.shape[0] - 1):
        total: cython.longlong = 0
        squares: cython.longlong = 0
        count: cython.longlong = start[k + 1] - start[k]
        for i in range(start[k], start[k + 1]):
            value = cython.cast(cython.longlong, quality[i])
            total += value
            squares += value * value
        even: cython.longlong = 0  # by `count`
        for i in range(start[k], start[k + 1]):
            value = cython.cast(cython.longlong, quality[i])
            even += min(count * value * value, squares)
        least: cython.double = LEAST_EVEN if count >= FEW_MINUTIAE else LEAST_EVEN_OF_FEW
        given: cython.bint = 0 < total < STEPS * count and even >= least * count * squares
        for i in range(start[k], start[k + 1]):
            scaled[i] = quality[i] / STEPS if given else usual
    return 0


def round_weights(root_weight, code):
    """Round the square roots of weights (N, K) to hundredths, 2.55 at most, and write these."""
    for i in range(root_weight.shape[0]):
        for k in range(root_weight.shape[1]):
            step = rint(float(root_weight[i, k]) * STEPS)
            step = step if step < MOST else MOST
            code[i, k] = cython.cast(cython.uchar, step)
            root_weight[i, k] = step / STEPS
    return 0
