"""Kernel: the minutiae of packed templates, whose numbers have as few bits as they need.

A column of numbers begins with a byte of its own, and has the highest bit of each number first.
"""

import cython

if cython.compiled:
    from cython.cimports.libc.math import rint
else:
    rint = round  # to even, too


def at_500_dpi(values, zoom, column):
    """Write positions as whole pixels at 500 dpi above the least one; return that.

    Pixel centres stay such: the positions are ``(values + 0.5) * zoom - 0.5``, rounded.
    """
    n = values.shape[0]
    least = 0
    for i in range(n):
        column[i] = cython.cast(cython.longlong, rint((float(values[i]) + 0.5) * zoom - 0.5))
        if i == 0 or column[i] < least:
            least = column[i]
    for i in range(n):
        column[i] -= least
    return least


def write_columns(columns, widths, data):
    """Write numbers from 0 on, row k of `columns` in ``widths[k]`` bits each, to zeros."""
    begin = 0
    for k in range(columns.shape[0]):
        bit = 8 * begin
        for i in range(columns.shape[1]):
            for place in range(widths[k] - 1, -1, -1):
                if columns[k, i] >> place & 1:
                    data[bit >> 3] |= 128 >> (bit & 7)
                bit += 1
        begin = (bit + 7) >> 3
    return 0


def read_columns(data, widths, columns):
    """Read the numbers that `write_columns` wrote; `data` has all their bytes."""
    begin = 0
    for k in range(columns.shape[0]):
        bit = 8 * begin
        for i in range(columns.shape[1]):
            value = 0
            for _ in range(widths[k]):
                value = value << 1
                if data[bit >> 3] & (128 >> (bit & 7)):
                    value += 1
                bit += 1
            columns[k, i] = value
        begin = (bit + 7) >> 3
    return 0


def to_image(column, least, zoom, values):
    """Write the positions in the image of numbers that `at_500_dpi` wrote, rounded once."""
    for i in range(column.shape[0]):
        values[i] = (float(column[i] + least) + 0.5) / zoom - 0.5
    return 0
