"""The prints of a database, and the genuine and the impostor pairs of them that are compared.

A protocol or a list chooses the pairs.

References
----------
Maio, Maltoni, Cappelli, Wayman, Jain, "FVC2002: Second Fingerprint Verification Competition",
ICPR 2002, for the "fvc" protocol.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import DatasetError, unknown_name
from fpmatch.gallery.batch.pair_list import list_error, number_pairs, print_names
from fpmatch.gallery.batch.plan import PairChunk
from fpmatch.gallery.listing.csv_rows import csv_cell
from fpmatch.gallery.listing.folders import natural_key
from fpmatch.lab.evaluation.rates.scores import finger_in_name

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.gallery.batch.pair_list import PairList

PROTOCOLS: Final = ("extended", "fvc")
_BAND: Final = 256  # references that are compared with all probes before the next
_LEAST_CHUNK, _MOST_CHUNK = 512, 4096  # pairs


@dataclass(frozen=True, slots=True, order=True)
class Impression:
    """The file of one print, its finger, and which impression of the finger it is.

    In a database the fingers are all numbers, as in FVC's names, or all names, or all "": not
    known. `name` is the print's in the database, by default the file's, as `csv_cell` makes it;
    `dpi` its own resolution, where a list states it; and `entry` its number in a gallery.
    """

    finger: int | str
    number: int
    path: Path
    name: str = ""
    dpi: float | None = None
    entry: int | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", csv_cell(self.name or self.path.name))


def finger_numbers(impressions: Sequence[Impression]) -> NDArray[np.intp]:
    """Return the fingers of impressions, numbered from 0 by number or name."""
    fingers = [one.finger for one in impressions]
    order = {f: k for k, f in enumerate(sorted(set(fingers), key=lambda f: natural_key(str(f))))}
    return np.array([order[finger] for finger in fingers], np.intp)


@dataclass(frozen=True, slots=True, eq=False)
class Pairs:
    """The pairs to compare, as indices into a database's impressions.

    `probe`, `reference` (N,): indices of the two impressions of each pair; of a protocol, probe <
    reference. `genuine` (N,): whether both show the same finger.
    """

    probe: NDArray[np.intp]
    reference: NDArray[np.intp]
    genuine: NDArray[np.bool_]

    def __len__(self) -> int:
        return int(self.probe.size)


class PairPlan:
    """Pairs in chunks, as `fpmatch.gallery.batch.plan.Plan` describes."""

    def __init__(self, pairs: Pairs) -> None:
        self._pairs = pairs
        self._size = min(max(len(pairs) // 64, _LEAST_CHUNK), _MOST_CHUNK)
        self.number_of_chunks = -(-len(pairs) // self._size)
        self.probes: Sequence[int] = np.unique(pairs.probe).tolist()
        self.references: Sequence[int] = np.unique(pairs.reference).tolist()
        content = np.stack([pairs.probe, pairs.reference, pairs.genuine])
        self.identity = f"{hashlib.sha256(content.tobytes()).hexdigest()} by {self._size}"

    def __len__(self) -> int:
        return len(self._pairs)

    def chunks(self, start: int = 0) -> Iterator[PairChunk]:
        """Yield the pairs, as `Plan` says."""
        p = self._pairs
        for k in range(start * self._size, len(p), self._size):
            part = slice(k, k + self._size)
            sides = p.probe[part].astype(np.int32), p.reference[part].astype(np.int32)
            yield PairChunk(*sides, p.genuine[part].astype(np.int8))


def choose_pairs(impressions: Sequence[Impression], protocol: str = "extended") -> Pairs:
    """Choose the pairs that a protocol compares.

    Both protocols take every unordered pair of impressions of one finger as genuine. As impostor
    pairs, "extended" takes all unordered pairs of impressions of different fingers, "fvc" only
    those of the fingers' first impressions (their lowest numbers). `impressions`: a database's
    impressions. `protocol`: "extended" or "fvc". Every probe is paired with the first 256
    references, then with the next. Raises a `DatasetError` if the protocol is unknown.

    Examples
    --------
    >>> from pathlib import Path
    >>> from fpmatch.lab.evaluation.databases.protocol import PROTOCOLS, Impression, choose_pairs
    >>> prints = [Impression(f, n, Path(f"{f}_{n}.tif")) for f in (1, 2) for n in (1, 2)]
    >>> extended, fvc = (choose_pairs(prints, name) for name in PROTOCOLS)
    >>> [(int(p.genuine.sum()), int((~p.genuine).sum())) for p in (extended, fvc)]
    [(2, 4), (2, 1)]
    """
    if protocol not in PROTOCOLS:
        raise DatasetError(unknown_name("protocol", protocol, PROTOCOLS))
    finger = finger_numbers(impressions)
    probe, reference = np.triu_indices(len(impressions), k=1)
    order = np.argsort(reference // _BAND, kind="stable")
    probe, reference = probe[order], reference[order]
    genuine = finger[probe] == finger[reference]
    if protocol == "fvc":
        lowest = {i.finger: i.number for i in sorted(impressions, key=lambda i: -i.number)}
        first = np.array([i.number == lowest[i.finger] for i in impressions], dtype=bool)
        chosen = genuine | (first[probe] & first[reference])
        probe, reference, genuine = probe[chosen], reference[chosen], genuine[chosen]
    return Pairs(probe, reference, genuine)


def listed_impressions(
    impressions: Sequence[Impression], listed: PairList, place: str | os.PathLike[str]
) -> tuple[tuple[Impression, ...], Pairs]:
    """Return the prints of the database at `place` that are listed, and their pairs, each once.

    A pair is the same in either order. Of a list that is labelled, the fingers are known if the
    prints are named FFF_M and no label contradicts that. Raises a `ScoringError` for an unknown
    print, a print with itself, or labels that contradict each other.
    """
    names = print_names(place, [one.name for one in impressions])
    numbered = number_pairs(listed.path, listed.rows, names, names)
    i, j = numbered.prints.astype(np.intp).T
    if (same := np.flatnonzero(i == j)).size:
        row = listed.rows[same[0]]
        raise list_error(listed.path, row.line, f"{row.probe} is compared with itself")
    keys = np.minimum(i, j) * len(impressions) + np.maximum(i, j)
    _, first, again = np.unique(keys, return_index=True, return_inverse=True)
    genuine = numbered.genuine == 1
    if not listed.labelled:
        finger = finger_numbers(impressions)
        genuine = finger[i] == finger[j]
    if (wrong := np.flatnonzero(genuine != genuine[first[again]])).size:
        row, earlier = (listed.rows[k] for k in (wrong[0], first[again[wrong[0]]]))
        why = f"{row.probe} and {row.reference} are labelled otherwise on line {earlier.line}"
        raise list_error(listed.path, row.line, f"column genuine: {why}")
    kept = np.sort(first)
    prints, numbers = np.unique(np.stack([i[kept], j[kept]]), return_inverse=True)
    probe, reference = numbers.reshape(2, -1).astype(np.intp)
    pairs = Pairs(probe, reference, genuine[kept])
    chosen = [impressions[n] for n in prints.tolist()]
    if listed.labelled:
        finger_of = finger_in_name()
        named = [finger_of(one.path.name) or "" for one in chosen]
        by_name = np.array([named[a] == named[b] for a, b in zip(probe, reference, strict=True)])
        known = all(named) and np.array_equal(by_name, pairs.genuine)
        of_prints = zip(chosen, named, strict=True)
        chosen = [replace(one, finger=name if known else "") for one, name in of_prints]
    return tuple(chosen), pairs
