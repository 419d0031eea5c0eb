"""The pairs that `fpmatch score` compares: their order and chunks."""

from __future__ import annotations

import csv
import hashlib
from array import array
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, Protocol

import numpy as np

from fpmatch.errors import ScoringError
from fpmatch.output import reason

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

PROBE: Final = "probe"
REFERENCE: Final = "reference"


@dataclass(frozen=True, slots=True, eq=False)
class PairChunk:
    """Hold some pairs, as numbers of prints of the two sides; shape (N,) each."""

    probe: NDArray[np.int32]
    reference: NDArray[np.int32]

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


class ListedPairs:
    """The pairs of a list, in its order.

    The list is a CSV file with the columns ``probe`` and ``reference`` among others; or, without a
    first line that names these, with probe and reference as the first two. They contain names of
    prints, with or without extension. Raises a `ScoringError` if the list cannot be read, is empty,
    or names a print that is not there.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        probes: Sequence[str],
        references: Sequence[str],
        *,
        pairs_per_chunk: int = 512,
    ) -> None:
        self._size = pairs_per_chunk
        # 8 bytes a pair: less than the rows of the output
        numbers = array("i")
        known = _numbers_by_name(probes), _numbers_by_name(references)
        for line, names in _read_pairs(Path(path)):
            for side, name, number_of in zip((PROBE, REFERENCE), names, known, strict=True):
                if name not in number_of:
                    raise ScoringError(f"{path}: line {line}: there is no {side} {name!r}")
                numbers.append(number_of[name])
        if not numbers:
            raise ScoringError(f"{path}: the list holds no pairs")
        self._pairs = np.array(numbers, dtype=np.int32).reshape(-1, 2)
        self.number_of_chunks = -(-len(self._pairs) // pairs_per_chunk)
        self.probes: Sequence[int] = np.unique(self._pairs[:, 0]).tolist()
        self.references: Sequence[int] = np.unique(self._pairs[:, 1]).tolist()
        digest = hashlib.sha256(self._pairs.tobytes()).hexdigest()
        self.identity = f"listed {digest} by {pairs_per_chunk}"

    def __len__(self) -> int:
        return len(self._pairs)

    def chunks(self, start: int = 0) -> Iterator[PairChunk]:
        """Yield the pairs, as `Plan` says."""
        for k in range(start * self._size, len(self._pairs), self._size):
            probe, reference = self._pairs[k : k + self._size].T
            yield PairChunk(probe, reference)


def _span(number: int, size: int, end: int) -> NDArray[np.int32]:
    return np.arange(number * size, min((number + 1) * size, end), dtype=np.int32)


def _numbers_by_name(names: Sequence[str]) -> dict[str, int]:
    """Return the numbers of prints by name, and by name without extension where it is unique."""
    stems = [Path(name).stem for name in names]
    times = Counter(stems)
    by_stem = {stem: n for n, stem in enumerate(stems) if times[stem] == 1}
    return by_stem | {name: n for n, name in enumerate(names)}


def _read_pairs(path: Path) -> Iterator[tuple[int, tuple[str, str]]]:
    """Yield the line number and the names of probe and reference of each pair of a list."""
    columns = (0, 1)
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            reader = csv.reader(stream)
            for number, row in enumerate(reader):
                cells = [cell.strip() for cell in row]
                if number == 0 and {PROBE, REFERENCE} <= set(cells):
                    columns = (cells.index(PROBE), cells.index(REFERENCE))
                elif any(cells):
                    line = reader.line_num
                    if len(cells) <= max(columns):
                        raise ScoringError(f"{path}: line {line}: expected a probe and a reference")
                    yield line, (cells[columns[0]], cells[columns[1]])
    except OSError as error:
        raise ScoringError(f"{path}: cannot be read: {reason(error)}") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise ScoringError(f"{path}: not a CSV file of pairs") from error
