"""Kernel: thin a binary image to a skeleton by a table of deletable neighbourhoods.

The pixels that are left are kept in a list; each sub-iteration looks up the byte of their eight
neighbours (bit k for neighbour k, counter-clockwise from east) and deletes, all at once, those
that the table of that sub-iteration names. Sequential passes then delete what is still not needed
for connection. Its oracle is `fpmatch.image.thin.thin_with_numpy`.
"""

import cython

COMPILED = cython.compiled


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


@cython.boundscheck(False)
@cython.wraparound(False)
def thin_listed(
    image: cython.uchar[:, ::1],
    pixels: cython.int[::1],
    doomed: cython.int[::1],
    deletable: cython.uchar[:, ::1],
    removable: cython.uchar[::1],
) -> None:
    """Thin `image` (0/1, with a border of zeros) in place; `pixels` are the flat indices of ones.

    `doomed` is scratch space as long as `pixels`.
    """
    flat: cython.pointer(cython.uchar) = cython.address(image[0, 0])
    width: cython.Py_ssize_t = image.shape[1]
    count: cython.Py_ssize_t = pixels.shape[0]
    kept: cython.Py_ssize_t
    lost: cython.Py_ssize_t
    i: cython.Py_ssize_t
    step: cython.Py_ssize_t
    changed: cython.bint = True
    with cython.nogil:
        while changed:
            changed = False
            for step in range(2):
                kept = 0
                lost = 0
                for i in range(count):
                    if deletable[step, _neighbours(flat, pixels[i], width)]:
                        doomed[lost] = pixels[i]
                        lost += 1
                    else:
                        pixels[kept] = pixels[i]
                        kept += 1
                for i in range(lost):
                    flat[doomed[i]] = 0
                count = kept
                if lost > 0:
                    changed = True
        lost = 1
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
