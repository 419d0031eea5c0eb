# mypy: ignore-errors
"""Kernel: invert the pixels of small connected parts of a binary image.

Runs of equal pixels that touch a run of the row above are joined to it in a forest (union-find),
whose roots hold the areas of the parts. Its oracle is
`fpmatch.image.skeleton.thin.flip_with_opencv`.
"""

import cython

COMPILED = cython.compiled

# Columns of `runs`.
_Y = cython.declare(cython.int, 0)
_FIRST = cython.declare(cython.int, 1)
_BEYOND = cython.declare(cython.int, 2)
_PARENT = cython.declare(cython.int, 3)
_AREA = cython.declare(cython.int, 4)


def flip_small_parts(
    image: cython.uchar[:, ::1],
    colour: cython.uchar,
    min_area: cython.int,
    reach: cython.int,
    runs: cython.int[:, ::1],
) -> None:
    """Invert, in place, the parts of value `colour` whose area is below `min_area`.

    `image` is of 0 and 1; pixels are connected over edges (`reach` 0) or also over corners (1).
    `runs` is scratch space of five columns, with a row for each possible run.
    """
    width: cython.int = image.shape[1]
    cython.declare(y=cython.int, x=cython.int, first=cython.int)
    cython.declare(near=cython.int, i=cython.int, root=cython.int)
    above: cython.int = 0  # first run of the row above that may touch the next run
    here: cython.int = 0  # first run of this row
    count: cython.int = 0
    with cython.nogil:
        for y in range(image.shape[0]):
            above = here
            here = count
            x = 0
            while x < width:
                if image[y, x] != colour:
                    x += 1
                    continue
                first = x
                while x < width and image[y, x] == colour:
                    x += 1
                runs[count, _Y] = y
                runs[count, _FIRST] = first
                runs[count, _BEYOND] = x
                runs[count, _PARENT] = count
                runs[count, _AREA] = 0
                while above < here and runs[above, _BEYOND] + reach <= first:
                    above += 1
                near = above
                while near < here and runs[near, _FIRST] < x + reach:
                    _join(runs, near, count)
                    near += 1
                count += 1
        for i in range(count):
            root = _root(runs, i)
            runs[root, _AREA] += runs[i, _BEYOND] - runs[i, _FIRST]
        for i in range(count):
            if runs[_root(runs, i), _AREA] < min_area:
                y = runs[i, _Y]
                for x in range(runs[i, _FIRST], runs[i, _BEYOND]):
                    image[y, x] = 1 - colour


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _root(runs: cython.int[:, ::1], i: cython.int) -> cython.int:
    """Return the root of a run's tree, and shorten the path to it."""
    while runs[i, _PARENT] != i:
        runs[i, _PARENT] = runs[runs[i, _PARENT], _PARENT]
        i = runs[i, _PARENT]
    return i


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _join(runs: cython.int[:, ::1], i: cython.int, j: cython.int) -> cython.void:
    """Make one tree of two; its root is the earlier run."""
    a: cython.int = _root(runs, i)
    b: cython.int = _root(runs, j)
    runs[max(a, b), _PARENT] = min(a, b)
