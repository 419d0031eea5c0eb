"""Lists of the pairs to compare, as test protocols and other programs write them.

A list is a CSV file with the columns ``probe`` and ``reference`` among others, and perhaps
``genuine``; or, without a first row that names these, they are the first two values of a row, and
``genuine`` the last of three. Values are separated by comma, semicolon, tab or spaces. ``genuine``
is 1 where both prints show the same finger, 0 where not, and may be empty::

    101_1.tif 101_2.tif 1
    101_1.tif 102_1.tif 0

Prints are named as in their database, with or without extension, or by any path that ends so.
"""

from __future__ import annotations

from array import array
from collections import Counter, defaultdict
from functools import partial
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.errors import ScoringError
from fpmatch.gallery.listing.csv_rows import csv_cell, csv_rows, row_error
from fpmatch.gallery.listing.kinds import kind_of
from fpmatch.printable import printable

if TYPE_CHECKING:
    import os
    from collections.abc import Iterable, Iterator, Sequence

    from numpy.typing import NDArray

PROBE: Final = "probe"
REFERENCE: Final = "reference"
GENUINE: Final = "genuine"
list_error: Final = partial(row_error, ScoringError)
_VALUES: Final = {"1": True, "genuine": True, "0": False, "impostor": False, "imposter": False}


class ListedPair(NamedTuple):
    """One row of a list: its line, the names of the two prints, and whether they are mated."""

    line: int
    probe: str
    reference: str
    genuine: bool | None


def iterate_pairs(path: str | os.PathLike[str]) -> Iterator[ListedPair]:
    r"""Yield the rows of a list of pairs, in the form that this module describes.

    Raises ScoringError if the file cannot be read or is malformed; the message names file, line and
    column.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from fpmatch.gallery.batch.pair_list import iterate_pairs
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "pairs.txt")
    ...     _ = file.write_text("101_1.tif 101_2.tif 1\n101_1.tif 102_1.tif 0\n")
    ...     [row.genuine for row in iterate_pairs(file)]
    [True, False]
    """
    columns: tuple[int, ...] = ()
    for line, cells in csv_rows(path, ScoringError, spaces=True):
        if not columns:
            if {PROBE, REFERENCE} <= set(cells):
                names = (PROBE, REFERENCE, GENUINE) if GENUINE in cells else (PROBE, REFERENCE)
                columns = tuple(map(cells.index, names))
                continue
            columns = (0, 1, 2) if len(cells) == 3 else (0, 1)
        probe, reference, *others = [cells[k] if k < len(cells) else "" for k in columns]
        if not (probe and reference):
            raise list_error(path, line, "expected a probe and a reference")
        genuine = others[0].casefold() if others else ""
        if genuine and genuine not in _VALUES:
            raise list_error(path, line, f"column genuine: must be 1 or 0, not {others[0]!r}")
        yield ListedPair(line, probe, reference, _VALUES.get(genuine))


class PrintNames:
    """Find the number of a print of one side by what a list calls it.

    `names` are the prints' own, different from each other, and `root` the folder in which they are
    paths (None: they are no paths).
    """

    def __init__(self, names: Sequence[str], root: Path | None = None) -> None:
        self._numbers = {name: n for n, name in enumerate(names)}
        stems = Counter(Path(name).stem for name in names)
        for n, name in enumerate(names):
            stem = Path(name).stem
            if stems[stem] == 1:
                self._numbers.setdefault(stem, n)
        self._paths: dict[str, list[tuple[tuple[str, ...], int]]] = defaultdict(list)
        if root is not None:
            above = Path(printable(root.absolute()))
            for n, name in enumerate(names):
                parts = Path(above, name).parts
                for last in {parts[-1], Path(parts[-1]).stem}:
                    self._paths[last].append(((*parts[:-1], last), n))

    def find(self, name: str) -> int | None:
        """Return the number of a print; None where no one print is called so."""
        name = csv_cell(name)
        if name in self._numbers:
            return self._numbers[name]
        parts = PurePosixPath(name.replace("\\", "/")).parts
        parts = parts[1:] if parts[:1] == (".",) else parts
        if not parts:
            return None
        ending = {n for path, n in self._paths.get(parts[-1], ()) if path[-len(parts) :] == parts}
        return ending.pop() if len(ending) == 1 else None


def print_names(place: str | os.PathLike[str], names: Sequence[str]) -> PrintNames:
    """Return the names of the prints of a folder, a manifest or a gallery."""
    match kind_of(place):
        case "folder":
            return PrintNames(names, Path(place))
        case "manifest":
            return PrintNames(names, Path(place).parent)
    return PrintNames(names)


class NumberedPairs(NamedTuple):
    """Pairs as numbers of prints, shape (N, 2); `genuine` is 1, 0 or -1 (unknown), shape (N,)."""

    prints: NDArray[np.int32]
    genuine: NDArray[np.int8]
    lines: array[int]


def number_pairs(
    path: str | os.PathLike[str],
    rows: Iterable[ListedPair],
    probes: PrintNames,
    references: PrintNames,
) -> NumberedPairs:
    """Return the rows of a list as numbers of prints; ScoringError for an unknown print."""
    # 17 bytes a pair: less than the rows of the output
    numbers, genuine, lines = array("i"), array("b"), array("q")
    for row in rows:
        sides = ((PROBE, probes, row.probe), (REFERENCE, references, row.reference))
        for side, names, name in sides:
            number = names.find(name)
            if number is None:
                raise list_error(path, row.line, f"there is no {side} {name!r}")
            numbers.append(number)
        genuine.append(-1 if row.genuine is None else row.genuine)
        lines.append(row.line)
    if not lines:
        raise ScoringError("the list holds no pairs", path=path, code="empty")
    prints = np.array(numbers, np.int32).reshape(-1, 2)
    return NumberedPairs(prints, np.array(genuine, np.int8), lines)
