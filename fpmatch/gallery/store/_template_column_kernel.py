# mypy: ignore-errors
"""Kernel: minutiae and cells of stored templates, whose numbers have as few bits as they need.

A column of numbers begins with a byte of its own, and has the highest bit of each number first.
"""

import cython


@cython.locals(place=cython.int)
def write_columns(columns, widths, data):
    """Write numbers from 0 on, row k of `columns` in ``widths[k]`` bits each, to zeros."""
    begin: cython.Py_ssize_t = 0
    for k in range(columns.shape[0]):
        bit: cython.Py_ssize_t = 8 * begin
        for i in range(columns.shape[1]):
            for place in range(widths[k] - 1, -1, -1):
                if columns[k, i] >> place & 1:
                    data[bit >> 3] |= 128 >> (bit & 7)
                bit += 1
        begin = (bit + 7) >> 3
    return 0


@cython.locals(i=cython.Py_ssize_t)
def read_columns(data, at, widths, start, columns):
    """Read the numbers that `write_columns` wrote of many templates; `data` has all their bytes.

    Those of template t begin at byte ``at[t]``, with ``widths[t, k]`` bits each; they become the
    entries ``start[t]`` to ``start[t + 1]`` of the rows of `columns`.
    """
    with cython.nogil:
        for t in range(at.shape[0]):
            begin: cython.Py_ssize_t = at[t]
            for k in range(columns.shape[0]):
                bit = 8 * begin
                for i in range(start[t], start[t + 1]):
                    value: cython.longlong = 0
                    left: cython.int = widths[t, k]
                    while left > 0:
                        place: cython.int = 8 - (bit & 7)
                        taken = place if place < left else left
                        byte = cython.cast(cython.int, data[bit >> 3]) >> (place - taken)
                        value = (value << taken) | (byte & ((1 << taken) - 1))
                        bit += taken
                        left -= taken
                    columns[k, i] = value
                begin = (bit + 7) >> 3
    return 0


@cython.locals(top=cython.int, bottom=cython.int, left=cython.int, right=cython.int)
def read_cells(data, at, end, start, columns, cell_bytes, mask, orientation, after, tight):
    """Read the cells of the ridge fields of many templates: mask and orientation.

    Those of template t are the entries ``start[t]`` to ``start[t + 1]`` of `mask`, in rows of
    ``columns[t]``; their bits begin at byte ``at[t]`` of `data`, which has all of them. The
    orientation follows of those inside the mask, and ``cell_bytes[t]`` for each of these, up to
    byte ``end[t]``. `orientation` is filled template by template, ``after[t]`` with the byte after
    that of template t, or -1 where the bytes do not end at ``end[t]``, and ``tight[t]`` with
    whether no row or column at the border is empty.

    Return how many cells are inside.
    """
    filled: cython.Py_ssize_t = 0
    with cython.nogil:
        for t in range(at.shape[0]):
            inside = top = bottom = left = right = 0
            cells: cython.Py_ssize_t = start[t + 1] - start[t]
            width: cython.Py_ssize_t = columns[t]
            row = column = 0
            for i in range(cells):
                value: cython.int = (
                    cython.cast(cython.int, data[at[t] + (i >> 3)]) >> (7 - (i & 7)) & 1
                )
                mask[start[t] + i] = value
                inside += value
                top |= value & (row == 0)
                bottom |= value & (i >= cells - width)
                left |= value & (column == 0)
                column += 1
                if column == width:
                    column = 0
                    row += 1
                    right |= value
            place = at[t] + ((cells + 7) >> 3)
            after[t] = -1
            tight[t] = top & bottom & left & right
            if place + ((inside + 1) >> 1) + cell_bytes[t] * inside != end[t]:
                continue
            for i in range(inside):
                orientation[filled + i] = data[place + (i >> 1)] >> (4 - 4 * (i & 1)) & 15
            filled += inside
            after[t] = place + ((inside + 1) >> 1)
    return filled


def to_image(column, least, zoom, values):
    """Write the positions in the image of rounded numbers, above the least one."""
    for i in range(column.shape[0]):
        values[i] = (float(column[i] + least) + 0.5) / zoom - 0.5
    return 0
