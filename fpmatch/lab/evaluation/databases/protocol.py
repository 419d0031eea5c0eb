"""The prints of a database, and the genuine and the impostor pairs of them that are compared.

A protocol or a list chooses the pairs.

References
----------
Maio, Maltoni, Cappelli, Wayman, Jain, "FVC2002: Second Fingerprint Verification Competition",
ICPR 2002, for the "fvc" protocol.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import DatasetError, unknown_name
from fpmatch.gallery.batch.pair_list import list_error, number_pairs, print_names
from fpmatch.gallery.listing.csv_rows import csv_cell
from fpmatch.gallery.listing.folders import natural_key

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.gallery.batch.pair_list import PairList

PROTOCOLS: Final = ("extended", "fvc")


@dataclass(frozen=True, slots=True, order=True)
class Impression:
    """The file of one print, its finger, and which impression of the finger it is.

    In a database the fingers are all numbers, as in FVC's names, or all names. `name` is the
    print's in the database, by default the file's, as `csv_cell` makes it; `dpi` its own
    resolution, where a list states it; and `entry` its number in a gallery.
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


def choose_pairs(impressions: Sequence[Impression], protocol: str = "extended") -> Pairs:
    """Choose the pairs that a protocol compares.

    Both protocols take every unordered pair of impressions of one finger as genuine. As impostor
    pairs, "extended" takes all unordered pairs of impressions of different fingers, "fvc" only
    those of the fingers' first impressions (their lowest numbers). `impressions`: a database's
    impressions. `protocol`: "extended" or "fvc". Raises a `DatasetError` if the protocol is
    unknown.

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

    A pair is the same in either order. Of a list that is labelled, prints joined by genuine pairs
    become one finger. Raises a `ScoringError` for an unknown print, a print with itself, or labels
    that contradict each other.
    """
    names = print_names(place, [one.name for one in impressions])
    numbered = number_pairs(listed.path, listed.rows, names, names)
    i, j = numbered.prints.astype(np.intp).T
    if (same := np.flatnonzero(i == j)).size:
        row = listed.rows[same[0]]
        raise list_error(listed.path, row.line, f"{row.probe} is compared with itself")
    if listed.labelled:
        mated = numbered.prints[numbered.genuine == 1].tolist()
        impressions = _with_fingers(impressions, _joined(len(impressions), mated))
    finger = finger_numbers(impressions)
    genuine = finger[i] == finger[j]
    wrong = np.flatnonzero(genuine & (numbered.genuine == 0))
    if wrong.size:
        row = listed.rows[wrong[0]]
        why = f"genuine is 0, but other rows make {row.probe} and {row.reference} one finger"
        raise list_error(listed.path, row.line, f"column genuine: {why}")
    keys = np.minimum(i, j) * len(finger) + np.maximum(i, j)
    kept = np.sort(np.unique(keys, return_index=True)[1])
    prints, numbers = np.unique(np.stack([i[kept], j[kept]]), return_inverse=True)
    probe, reference = numbers.reshape(2, -1).astype(np.intp)
    chosen = tuple(impressions[n] for n in prints.tolist())
    return chosen, Pairs(probe, reference, genuine[kept])


def _joined(count: int, mated: Sequence[Sequence[int]]) -> list[int]:
    """Return for each print the first one to which genuine pairs join it."""
    first = list(range(count))

    def root(n: int) -> int:
        while first[n] != n:
            first[n] = first[first[n]]
            n = first[n]
        return n

    for i, j in mated:
        one, other = sorted((root(i), root(j)))
        first[other] = one
    return [root(n) for n in range(count)]


def _with_fingers(impressions: Sequence[Impression], first: Sequence[int]) -> list[Impression]:
    """Return prints whose fingers have the names of their first prints."""
    count: Counter[int] = Counter()
    named = []
    for one, n in zip(impressions, first, strict=True):
        count[n] += 1
        named.append(replace(one, finger=impressions[n].name, number=count[n]))
    return named
