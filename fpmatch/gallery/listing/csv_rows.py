"""Rows of tables that people and programs write: lists of prints and of pairs, scores."""

from __future__ import annotations

import csv
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fpmatch.base.output import reason
from fpmatch.printable import printable

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator

    from fpmatch.errors import FpmatchError

DELIMITERS: Final = ("\t", ";", ",")
_BEGINS_FORMULA: Final = tuple("=+-@＝＋－＠")  # and their full-width forms


def csv_rows(
    path: str | os.PathLike[str],
    error: type[FpmatchError],
    *,
    spaces: bool = False,
    exact: bool = False,
    comments: bool = False,
) -> Iterator[tuple[int, list[str]]]:
    """Yield line number and cells, without outer spaces, of the rows that are not blank.

    Cells are separated by comma, tab or semicolon, the most frequent of the first row; with
    `spaces` also by spaces, where that has none of these. The text is UTF-8 with or without a byte
    order mark, and cells may be quoted. With `exact` cells keep outer spaces; with `comments` lines
    that begin with ``#`` are left out, in CSV those before the first row. Raises `error`, with file
    and line, for anything else.
    """

    def is_idle(text: str) -> bool:
        return not text.strip() or (comments and text.lstrip().startswith("#"))

    source, line = Path(path), 0
    try:
        with source.open(encoding="utf-8-sig", newline="") as stream:
            lines = iter(stream)
            first, skipped = "", 0
            for first in lines:
                if not is_idle(first):
                    break
                skipped += 1
            else:
                return
            delimiter = max(DELIMITERS, key=first.count)
            if spaces and not any(map(first.count, DELIMITERS)):
                for line, text in enumerate(chain([first], lines), skipped + 1):
                    if not is_idle(text):
                        yield line, text.split()
                return
            reader = csv.reader(
                chain([first], lines), delimiter=delimiter, skipinitialspace=not exact, strict=True
            )
            line = skipped
            for row in reader:
                line = skipped + reader.line_num
                cells = row if exact else [cell.strip() for cell in row]
                if any(cell.strip() for cell in cells):
                    yield line, cells
            line = skipped + reader.line_num
    except UnicodeDecodeError as bad:
        raise error("not a CSV file in UTF-8", path=path, code="not text") from bad
    except csv.Error as bad:
        raise error(f"line {line + 1}: not a CSV file: {bad}", path=path, code="not CSV") from bad
    except OSError as bad:
        raise error(f"cannot be read: {reason(bad)}", path=path, code="unreadable") from bad


def csv_cell(text: str) -> str:
    """Return text for a cell of a CSV file, which no spreadsheet takes for a formula.

    Spreadsheets compute cells that begin with ``=``, ``+``, ``-`` or ``@``, some also in full
    width, which may run programs and send data: of text that is no number such a first character
    is escaped. A quote before it, which some programs write, would be lost to programs that read
    the file.
    """
    shown = printable(text)
    if shown.startswith(_BEGINS_FORMULA) and not _is_number(shown):
        first = f"\\x{ord(shown[0]):02x}" if shown[0].isascii() else ascii(shown[0])[1:-1]
        return f"{first}{shown[1:]}"
    return shown


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def row_error(
    error: type[FpmatchError], path: str | os.PathLike[str], line: int, why: str
) -> FpmatchError:
    """Return the error for a malformed row; `why` may begin with the name of a column."""
    comma = "," if why.startswith("column ") else ":"
    return error(f"line {line}{comma} {why}", path=path, code="malformed row")
