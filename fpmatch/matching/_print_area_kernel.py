"""Kernel: the box around the mask of a ridge field, and the codes of the orientation in it."""

import cython

if cython.compiled:
    from cython.cimports.libc.math import rint
else:
    rint = round  # to even, too

ORIENTATIONS = cython.declare(cython.int, 255)  # steps in half a turn


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
