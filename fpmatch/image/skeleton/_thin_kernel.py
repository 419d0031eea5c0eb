# mypy: ignore-errors
"""Kernel: thin a binary image to a skeleton after Guo and Hall, 64 pixels at a time.

Bit k of a word is its pixel k from the left, so that a condition on the eight neighbours of each
pixel is a few operations on words. Then pixels that connection does not need are deleted one by one
in raster order. The oracle of both steps is `fpmatch.image.skeleton.thin.thin_with_skimage`.
"""

import cython

COMPILED = cython.compiled


def thin_words(
    words: cython.ulonglong[:, ::1], to_delete: cython.ulonglong[:, ::1], changed: cython.int[::1]
) -> None:
    """Thin `words` in place, by the two sub-iterations in turn, until neither deletes a pixel.

    The first and the last row and column of `words` are zeros. `to_delete`, of the same shape, and
    `changed`, for each row, are scratch space and hold zeros.
    """
    rows: cython.Py_ssize_t = words.shape[0]
    cython.declare(r=cython.Py_ssize_t, c=cython.Py_ssize_t)
    turn: cython.int = 1
    last: cython.int = 0  # the turn in which a pixel was last deleted
    with cython.nogil:
        while turn - last <= 2:
            for r in range(1, rows - 1):
                # the same sub-iteration processed this row two turns ago
                if max(changed[r - 1], changed[r], changed[r + 1]) >= turn - 2:
                    _find_deletable(words, to_delete, r, turn % 2 == 1)
            for r in range(1, rows - 1):
                for c in range(1, words.shape[1] - 1):
                    if to_delete[r, c] != 0:
                        words[r, c] &= ~to_delete[r, c]
                        to_delete[r, c] = 0
                        changed[r] = turn
                        last = turn
            turn += 1


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _find_deletable(
    words: cython.ulonglong[:, ::1],
    to_delete: cython.ulonglong[:, ::1],
    r: cython.Py_ssize_t,
    first: cython.bint,
) -> cython.void:
    """Write which pixels of row r the first, or the second, sub-iteration deletes."""
    cython.declare(c=cython.Py_ssize_t, side=cython.ulonglong)
    for c in range(1, words.shape[1] - 1):
        north: cython.ulonglong = words[r - 1, c]
        south: cython.ulonglong = words[r + 1, c]
        here: cython.ulonglong = words[r, c]
        east: cython.ulonglong = (here >> 1) | (words[r, c + 1] << 63)
        west: cython.ulonglong = (here << 1) | (words[r, c - 1] >> 63)
        north_east: cython.ulonglong = (north >> 1) | (words[r - 1, c + 1] << 63)
        north_west: cython.ulonglong = (north << 1) | (words[r - 1, c - 1] >> 63)
        south_east: cython.ulonglong = (south >> 1) | (words[r + 1, c + 1] << 63)
        south_west: cython.ulonglong = (south << 1) | (words[r + 1, c - 1] >> 63)
        # connected parts around the pixel: exactly one of the four terms must be true
        a0: cython.ulonglong = ~east & (north_east | north)
        a1: cython.ulonglong = ~north & (north_west | west)
        a2: cython.ulonglong = ~west & (south_west | south)
        a3: cython.ulonglong = ~south & (south_east | east)
        one: cython.ulonglong = (a0 ^ a1 ^ a2 ^ a3) & ~((a0 & a1) | (a2 & a3))
        # pairs of neighbours, counted in two ways: at least two of both, and not four of both
        p0: cython.ulonglong = north_east | north
        p1: cython.ulonglong = north_west | west
        p2: cython.ulonglong = south_west | south
        p3: cython.ulonglong = south_east | east
        q0: cython.ulonglong = east | north_east
        q1: cython.ulonglong = north | north_west
        q2: cython.ulonglong = west | south_west
        q3: cython.ulonglong = south | south_east
        two: cython.ulonglong = (p0 & p1) | (p2 & p3) | ((p0 | p1) & (p2 | p3))
        two &= (q0 & q1) | (q2 & q3) | ((q0 | q1) & (q2 | q3))
        four: cython.ulonglong = p0 & p1 & p2 & p3 & q0 & q1 & q2 & q3
        if first:
            side = (north | north_east | ~south_east) & east
        else:
            side = (south | south_west | ~north_west) & west
        to_delete[r, c] = here & one & two & ~four & ~side


def delete_simple_points(
    image: cython.uchar[:, ::1], pixels: cython.int[::1], removable: cython.uchar[::1]
) -> None:
    """Delete the pixels of `image` (0/1, with a border of zeros) that connection does not need.

    `pixels` are the flat indices of ones; `removable` is 1 for each byte of neighbours (bit k for
    neighbour k, counter-clockwise from east) whose pixel may be deleted.
    """
    flat: cython.pointer(cython.uchar) = cython.address(image[0, 0])
    width: cython.Py_ssize_t = image.shape[1]
    count: cython.Py_ssize_t = pixels.shape[0]
    cython.declare(kept=cython.Py_ssize_t, i=cython.Py_ssize_t)
    lost: cython.Py_ssize_t = 1
    with cython.nogil:
        while lost > 0:
            kept = 0
            for i in range(count):
                if removable[_neighbours(flat, pixels[i], width)]:
                    flat[pixels[i]] = 0
                else:
                    pixels[kept] = pixels[i]
                    kept += 1
            lost = count - kept
            count = kept


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _neighbours(
    image: cython.pointer(cython.uchar), at: cython.Py_ssize_t, width: cython.Py_ssize_t
) -> cython.int:
    return (
        image[at + 1]
        | (image[at - width + 1] << 1)
        | (image[at - width] << 2)
        | (image[at - width - 1] << 3)
        | (image[at - 1] << 4)
        | (image[at + width - 1] << 5)
        | (image[at + width] << 6)
        | (image[at + width + 1] << 7)
    )
