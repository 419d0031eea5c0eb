"""Bare points from files, as spreadsheets, star catalogues, scripts and numpy write them.

A table has columns x and y by these names, in any case and place among others::

    name,X,Y
    Vega,279.23,38.78

or other columns that are named, or no header and two columns of numbers, as `np.savetxt` writes
them. Columns are separated by comma, semicolon, tab or spaces; numbers have a decimal point or,
where no comma separates them, all a decimal comma; values may stand in quotes. Blank lines, rows
without a value and lines that start with # are left out. The text is UTF-8, with or without a byte
order mark. A `.npy` file, recognised by its content, has an array of shape (N, 2).
"""

from __future__ import annotations

import csv
import io
import math
from array import array
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.base.npy import decode_npy, is_npy
from fpmatch.errors import FpmatchError, PointSetError

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator

    from numpy.typing import NDArray

    Record = tuple[int, list[str]]

XY: Final = ("x", "y")
DELIMITERS: Final = (",", ";", "\t", " ")
MAX_BYTES: Final = 2**30  # some twenty million points
_SHOWN_LETTERS: Final = 20  # of a value that an error quotes; a key has 44
_SHOWN_CELLS: Final = 5
_UTF16_MARKS: Final = (b"\xff\xfe", b"\xfe\xff")


def load_points(path: str | os.PathLike[str], columns: tuple[str, str] = XY) -> NDArray[np.float64]:
    """Load the points (N, 2) of a CSV or `.npy` file, or of a pipe; raises PointSetError."""
    try:
        if Path(path).is_dir():
            raise PointSetError(f"{path}: is a folder, not a file of points")
        with Path(path).open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except FileNotFoundError as error:
        raise PointSetError(f"{path}: no such file") from error
    except (OSError, ValueError) as error:
        why = (error.strerror or str(error)).lower() if isinstance(error, OSError) else error
        raise PointSetError(f"{path}: cannot be read: {why}") from error
    return decode_points(data, str(path), columns)


def decode_points(
    data: bytes, name: str = "points", columns: tuple[str, str] = XY
) -> NDArray[np.float64]:
    """Return the points (N, 2) of a file's content; no rows for a header alone.

    A table with a header has `columns` of these names, in any case.
    """
    if is_npy(data):
        return _decode_array(data, name)
    _check_text(data, name)
    table = _find_table(data, name, columns)
    records = _records(data, table.delimiter, name)
    if table.has_header:
        next(records)
    values = array("d")
    commas = table.delimiter != ","
    marks: set[str] = set()
    for line, cells in records:
        if len(cells) > table.columns:
            raise _error(name, line, f"expected {table.columns} values, found {len(cells)}")
        cells.extend([""] * (table.columns - len(cells)))
        try:
            for column, place in zip(columns, (table.x, table.y), strict=True):
                values.append(_number(cells[place], column, commas=commas))
                marks |= {",", "."} & set(cells[place])
        except ValueError as error:
            raise _error(name, line, str(error)) from error
        if len(marks) > 1:
            raise _error(name, line, "decimal commas and decimal points in one table")
    return np.array(values, dtype=np.float64).reshape(-1, 2)


def _decode_array(data: bytes, name: str) -> NDArray[np.float64]:
    """Return the points of a `.npy` file."""
    try:
        points = decode_npy(data)
    except FpmatchError as error:
        raise PointSetError(f"{name}: {error}") from error
    if points.shape[1] != 2:
        raise PointSetError(
            f"{name}: expected an array of 2 columns, x and y, found {points.shape[1]}"
        )
    finite = np.isfinite(points)
    if not finite.all():
        row, column = np.argwhere(~finite)[0].tolist()
        raise PointSetError(f"{name}, row {row + 1}: expected a finite number for {'xy'[column]}")
    return points


class _Table(NamedTuple):
    """How a table is written: its delimiter, number of columns, and where x and y stand."""

    delimiter: str
    columns: int
    x: int
    y: int
    has_header: bool


def _check_text(data: bytes, name: str) -> None:
    """Refuse what is no UTF-8 text, empty, or too much."""
    if not data:
        raise PointSetError(f"{name}: the file is empty")
    if len(data) > MAX_BYTES:
        raise PointSetError(f"{name}: more than {MAX_BYTES // 2**20} MiB")
    if data.startswith(_UTF16_MARKS):
        raise PointSetError(f"{name}: text in UTF-16, not UTF-8")
    if b"\0" in data:
        raise PointSetError(f"{name}: not a text file")
    try:
        data.decode()
    except UnicodeDecodeError as error:
        line = len((data[: error.start] + b"?").splitlines())
        raise _error(name, line, f"not UTF-8 text (byte 0x{data[error.start]:02x})") from error


def _records(data: bytes, delimiter: str, name: str) -> Iterator[Record]:
    """Yield the records that hold a value, each with the line it begins on."""
    begin, open_quote = 0, False

    def lines() -> Iterator[str]:
        """Yield what is neither blank nor a comment, and all that a quote runs over."""
        nonlocal begin, open_quote
        for number, line in enumerate(io.TextIOWrapper(io.BytesIO(data), "utf-8-sig", newline="")):
            if not open_quote:
                start = line.lstrip()
                if not start or start.startswith("#"):
                    continue
                begin, open_quote = number + 1, True
            yield line

    try:
        for cells in csv.reader(lines(), delimiter=delimiter, skipinitialspace=True, strict=True):
            open_quote = False
            while cells and not cells[-1]:  # as spreadsheets fill short rows up
                cells.pop()
            if cells:
                yield begin, cells
    except csv.Error as error:
        raise _error(name, begin, f"malformed row ({error})") from error


def _find_table(data: bytes, name: str, columns: tuple[str, str]) -> _Table:
    """Return the form under which the first record is a header with x and y, or two numbers."""
    x, y = (column.strip().casefold() for column in columns)
    firsts: list[Record] = []
    refusal = PointSetError(f"{name}: no points, only blank lines and comments")
    for delimiter in DELIMITERS:
        try:
            line, cells = next(_records(data, delimiter, name), (0, []))
        except PointSetError as error:
            refusal = error
            continue
        header = [cell.strip().casefold() for cell in cells]
        for column in (x, y):
            if {x, y} <= set(header) and header.count(column) > 1:
                raise _error(name, line, f"more than one column {column}")
        if {x, y} <= set(header):
            return _Table(delimiter, len(cells), header.index(x), header.index(y), True)
        numbers = (_float(cell.replace(",", ".")) for cell in cells)
        if columns == XY and len(cells) == 2 and None not in numbers:
            return _Table(delimiter, 2, 0, 1, False)
        if cells:
            firsts.append((line, cells))
    if not firsts:
        raise refusal
    line, cells = max(firsts, key=lambda first: len(first[1]))
    shown = ", ".join(map(_shown, cells[:_SHOWN_CELLS])) + ", …" * (len(cells) > _SHOWN_CELLS)
    by = "comma, semicolon, tab or spaces"
    form = f"a header with columns {_shown(x)} and {_shown(y)}, separated by {by}"
    if columns == XY:
        form = f"a header with columns x and y, or two numbers, separated by {by}"
    raise _error(name, line, f"expected {form}; found {shown}")


def _number(text: str, column: str, *, commas: bool) -> float:
    """Return a finite number, or raise a ValueError that names `column` and its text."""
    decimal = text.replace(",", ".") if commas else text
    value = None if "_" in text else _float(decimal)  # Python alone takes 1_000 for a number
    if value is not None and math.isfinite(value):
        return value
    if value is not None:
        raise ValueError(f"expected a finite number for {column}, not {_shown(text)}")
    if not text.strip():
        raise ValueError(f"expected a number for {column}, found nothing")
    comma = "," in text and _float(text.replace(",", ".")) is not None
    hint = "; where commas separate, decimals take a point" if comma else ""
    raise ValueError(f"expected a number for {column}, not {_shown(text)}{hint}")


def _float(text: str) -> float | None:
    """Return the value of a number, None for any other text."""
    try:
        return float(text)
    except ValueError:
        return None


def _shown(text: str) -> str:
    """Return a value as an error quotes it."""
    return repr(text if len(text) <= _SHOWN_LETTERS else text[:_SHOWN_LETTERS] + "…")


def _error(name: str, line: int, what: str) -> PointSetError:
    return PointSetError(f"{name}, line {line}: {what}")
