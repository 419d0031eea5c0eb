"""Bare points from files, as spreadsheets, scripts and numpy write them.

A table has columns x and y by these names, in any case and place among others::

    name,X,Y
    Vega,279.23,38.78

or no header and two columns of numbers. Columns are separated by commas, or by tabs and spaces.
Blank lines and lines that start with # are left out. The text is UTF-8. A `.npy` file, recognised
by its content, has an array of shape (N, 2).
"""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.base.npy import decode_npy, is_npy
from fpmatch.errors import FpmatchError, PointSetError

if TYPE_CHECKING:
    import os

    from numpy.typing import NDArray

MAX_BYTES: Final = 2**30  # some twenty million points


class PointTable(NamedTuple):
    """Points (N, 2), and their names: the values of the first other column, if there is one."""

    points: NDArray[np.float64]
    names: list[str]


def load_table(path: str | os.PathLike[str]) -> PointTable:
    """Load points and their names, of a table or `.npy` file; raises PointSetError."""
    try:
        with Path(path).open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
        if len(data) > MAX_BYTES:
            raise PointSetError(f"more than {MAX_BYTES // 2**20} MiB")
        return decode_table(data)
    except FpmatchError as error:
        raise PointSetError(str(error), path=path) from error
    except (OSError, ValueError) as error:
        why = (getattr(error, "strerror", None) or str(error)).lower()
        raise PointSetError(f"cannot be read: {why}", path=path) from error


def decode_table(data: bytes) -> PointTable:
    """Return the points and names in a file's content; no rows for a header alone."""
    if is_npy(data):
        points = decode_npy(data)
        if points.shape[1] != 2 or not np.isfinite(points).all():
            raise PointSetError("expected an array of 2 columns of finite numbers, x and y")
        return PointTable(points, [])
    try:
        lines = data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise PointSetError("not a text in UTF-8") from error
    rows = [(n, line) for n, line in enumerate(lines, 1) if line.strip() and line.strip()[0] != "#"]
    if not rows:
        raise PointSetError("no points")
    first = _cells(*rows[0])
    header = [cell.strip().casefold() for cell in first]
    if header.count("x") == header.count("y") == 1:
        places = header.index("x"), header.index("y")
        rows = rows[1:]
    elif len(first) == 2 and all(math.isfinite(_number(cell)) for cell in first):
        places = 0, 1
    else:
        form = "a header with columns x and y or two numbers, separated by commas or spaces"
        raise PointSetError(f"line {rows[0][0]}: expected {form}")
    other = next((k for k in range(len(first)) if k not in places), None)
    points, names = np.empty((len(rows), 2)), []
    for row, (number, line) in enumerate(rows):
        cells = _cells(number, line)
        if len(cells) != len(first):
            raise PointSetError(f"line {number}: expected {len(first)} values, found {len(cells)}")
        points[row] = [_number(cells[place]) for place in places]
        if not np.isfinite(points[row]).all():
            raise PointSetError(f"line {number}: expected finite numbers for x and y")
        if other is not None:
            names.append(cells[other])
    return PointTable(points, names)


def _cells(number: int, line: str) -> list[str]:
    """Return the values of a line."""
    if "," not in line:
        return line.split()
    try:
        return next(csv.reader([line], skipinitialspace=True, strict=True))
    except csv.Error as error:
        raise PointSetError(f"line {number}: malformed row ({error})") from error


def _number(text: str) -> float:
    """Return a number, NaN for other texts; Python alone takes 1_000 for one."""
    try:
        return math.nan if "_" in text else float(text)
    except ValueError:
        return math.nan
