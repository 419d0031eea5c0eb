"""The pairs that `fpmatch score` compares: their order and chunks, and lists of them.

A list, as test protocols and other programs write it, is a CSV file with the columns ``probe`` and
``reference`` among others, and perhaps ``genuine``; or, without a first row that names these, they
are the first two values of a row, and ``genuine`` the last of three. Values are separated by comma,
semicolon, tab or spaces. ``genuine`` is 1 where both prints show the same finger, 0 where not, and
may be empty::

    101_1.tif 101_2.tif 1
    101_1.tif 102_1.tif 0

Prints are named as in their database, with or without extension, or by any path that ends so.
"""

from __future__ import annotations

import hashlib
from array import array
from collections import defaultdict
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol

import numpy as np

from fpmatch.errors import ScoringError
from fpmatch.gallery.listing.csv_rows import csv_cell, csv_rows, row_error
from fpmatch.gallery.listing.manifest import kind_of
from fpmatch.printable import printable

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.batch.sources import StoredTemplate

PROBE: Final = "probe"
REFERENCE: Final = "reference"
GENUINE: Final = "genuine"
_list_error: Final = partial(row_error, ScoringError)
_VALUES: Final = {"1": True, "genuine": True, "0": False, "impostor": False, "imposter": False}


@dataclass(frozen=True, slots=True, eq=False)
class PairChunk:
    """Some pairs, as numbers of prints of the two sides; shape (N,) each.

    `genuine` is 1, 0 or -1 (unknown) where a list states it.
    """

    probe: NDArray[np.int32]
    reference: NDArray[np.int32]
    genuine: NDArray[np.int8] | None = None

    def __len__(self) -> int:
        return int(self.probe.size)


class Plan(Protocol):
    """The pairs to score, in chunks; different pairs have a different `identity`.

    `probes` and `references` are the numbers of the prints in these pairs, ascending.
    """

    identity: str
    number_of_chunks: int
    probes: Sequence[int]
    references: Sequence[int]

    def __len__(self) -> int:
        """Return the number of pairs."""

    def chunks(self, start: int = 0) -> Iterator[PairChunk]:
        """Yield the pairs in their order, from chunk number `start` on."""


class AllPairs:
    """All probes with all references, which come in bands.

    Every probe is compared with the first band, one probe after the other, then every probe with
    the next. Each reference is thus prepared once, and only the templates of a band and of some
    probes are in memory.
    """

    def __init__(
        self, probes: int, references: int, *, band: int = 256, pairs_per_chunk: int = 4096
    ) -> None:
        self.probes: Sequence[int] = range(probes)
        self.references: Sequence[int] = range(references)
        self._band = max(1, min(band, references))
        self._block = -(-pairs_per_chunk // self._band)
        self._blocks = -(-probes // self._block)
        self.number_of_chunks = self._blocks * -(-references // self._band)
        self.identity = f"all of {probes} x {references} in {self._band} x {self._block}"

    def __len__(self) -> int:
        return len(self.probes) * len(self.references)

    def chunks(self, start: int = 0) -> Iterator[PairChunk]:
        """Yield the pairs, as `Plan` says."""
        for number in range(start, self.number_of_chunks):
            band, block = divmod(number, self._blocks)
            reference = _span(band, self._band, len(self.references))
            probe = _span(block, self._block, len(self.probes))
            yield PairChunk(np.repeat(probe, reference.size), np.tile(reference, probe.size))


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
    >>> from fpmatch.gallery.batch.plan import iterate_pairs
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
            raise _list_error(path, line, "expected a probe and a reference")
        genuine = others[0].casefold() if others else ""
        if genuine and genuine not in _VALUES:
            raise _list_error(path, line, f"column genuine: must be 1 or 0, not {others[0]!r}")
        yield ListedPair(line, probe, reference, _VALUES.get(genuine))


class PrintNames:
    """Find the number of a print of one side by what a list calls it.

    `names` are the prints' own, different from each other; `place` is their folder, manifest or
    gallery. The names in a gallery are no paths.
    """

    def __init__(self, place: str | os.PathLike[str], names: Sequence[str]) -> None:
        self._numbers = {name: n for n, name in enumerate(names)}
        self._paths: dict[str, list[tuple[tuple[str, ...], int]]] = defaultdict(list)
        root = {"folder": Path(place), "manifest": Path(place).parent}.get(kind_of(place))
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


class GivenPairs:
    """Given pairs, in their order.

    `probe`, `reference` (N,) are the numbers of the prints, `genuine` (N,) is as in `PairChunk`.
    `name` stands for the pairs in `identity`.
    """

    def __init__(
        self,
        probe: NDArray[Any],
        reference: NDArray[Any],
        genuine: NDArray[Any],
        *,
        name: str,
        pairs_per_chunk: int = 512,
    ) -> None:
        self.probe, self.reference, self.genuine = probe, reference, genuine
        self._size = pairs_per_chunk
        self.number_of_chunks = -(-len(self) // pairs_per_chunk)
        self.probes: Sequence[int] = np.unique(probe).tolist()
        self.references: Sequence[int] = np.unique(reference).tolist()
        content = np.stack([probe, reference, genuine])
        digest = hashlib.sha256(content.tobytes()).hexdigest()
        self.identity = f"{name} {digest} by {pairs_per_chunk}"

    def __len__(self) -> int:
        return len(self.probe)

    def chunks(self, start: int = 0) -> Iterator[PairChunk]:
        """Yield the pairs, as `Plan` says."""
        for k in range(start * self._size, len(self), self._size):
            part = slice(k, k + self._size)
            sides = self.probe[part].astype(np.int32), self.reference[part].astype(np.int32)
            yield PairChunk(*sides, self.genuine[part].astype(np.int8))


def listed_pairs(
    path: str | os.PathLike[str], probes: PrintNames, references: PrintNames, **how: Any
) -> GivenPairs:
    """Return the pairs of a list; `probes` and `references` are the names of the prints.

    Raises a `ScoringError` if the list cannot be read, is empty, or names a print that is not
    there.
    """
    # 9 bytes a pair: less than the rows of the output
    numbers, genuine = array("i"), array("b")
    for row in iterate_pairs(path):
        sides = ((PROBE, probes, row.probe), (REFERENCE, references, row.reference))
        for side, names, name in sides:
            number = names.find(name)
            if number is None:
                raise _list_error(path, row.line, f"there is no {side} {name!r}")
            numbers.append(number)
        genuine.append(-1 if row.genuine is None else row.genuine)
    if not numbers:
        raise ScoringError("the list holds no pairs", path=path, code="empty")
    probe, reference = np.array(numbers, np.int32).reshape(-1, 2).T
    return GivenPairs(probe, reference, np.array(genuine, np.int8), name="listed", **how)


def find_identical_pairs(
    plan: Plan,
    probes: Mapping[int, StoredTemplate],
    references: Mapping[int, StoredTemplate],
    most: int,
) -> tuple[int, list[tuple[int, int]]]:
    """Return how many pairs of a plan have the same digest on both sides, and the first of them.

    `probes` and `references` are the prints by number.
    """
    kinds = {one.digest: k for k, one in enumerate(probes.values()) if one.digest}
    if kinds.keys().isdisjoint(one.digest for one in references.values()):
        return 0, []  # without a look at the pairs, which may be very many
    size = 1 + max(max(side, default=0) for side in (plan.probes, plan.references))
    of_probe, of_reference = np.full(size, -1), np.full(size, -2)
    for of_side, prints in ((of_probe, probes), (of_reference, references)):
        for number, one in prints.items():
            of_side[number] = kinds.get(one.digest, of_side[number])
    found, first = 0, list[tuple[int, int]]()
    for chunk in plan.chunks():
        same = np.flatnonzero(of_probe[chunk.probe] == of_reference[chunk.reference])
        found += len(same)
        for k in same[: most - len(first)].tolist():
            first.append((int(chunk.probe[k]), int(chunk.reference[k])))
    return found, first


def _span(number: int, size: int, end: int) -> NDArray[np.int32]:
    return np.arange(number * size, min((number + 1) * size, end), dtype=np.int32)
