"""The genuine and impostor pairs of the prints of a database that a protocol compares.

References
----------
Maio, Maltoni, Cappelli, Wayman, Jain, "FVC2002: Second Fingerprint Verification Competition",
ICPR 2002, for the "fvc" protocol.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import DatasetError, unknown_name
from fpmatch.gallery.batch.plan import PairChunk
from fpmatch.gallery.listing.csv_rows import csv_cell

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from numpy.typing import NDArray


PROTOCOLS: Final = ("extended", "fvc")
_BAND: Final = 256  # references that are compared with all probes before the next
_LEAST_CHUNK, _MOST_CHUNK = 512, 4096  # pairs


@dataclass(frozen=True, slots=True, order=True)
class Impression:
    """The file of one print, its finger, and which impression of the finger it is.

    In a database the fingers are all numbers, as in FVC's names, or all names. `name` is the
    print's in the database, by default the file's, as `csv_cell` makes it; `dpi` its own
    resolution, where a manifest states it; and `entry` its number in a gallery.
    """

    finger: int | str
    number: int
    path: Path
    name: str = ""
    dpi: float | None = None
    entry: int | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", csv_cell(self.name or self.path.name))


class Pairs:
    """The pairs to compare, as indices into a database's impressions: a plan for `score`.

    `probe`, `reference` (N,): indices of the two impressions of each pair, probe < reference.
    `genuine` (N,): whether both show the same finger. See `fpmatch.gallery.batch.plan.Plan`.
    """

    def __init__(
        self, probe: NDArray[np.intp], reference: NDArray[np.intp], genuine: NDArray[np.bool_]
    ) -> None:
        self.probe, self.reference, self.genuine = probe, reference, genuine
        self._size = min(max(len(self) // 64, _LEAST_CHUNK), _MOST_CHUNK)
        self.number_of_chunks = -(-len(self) // self._size)
        self.probes: Sequence[int] = np.unique(probe).tolist()
        self.references: Sequence[int] = np.unique(reference).tolist()
        content = np.stack([probe, reference, genuine])
        self.identity = f"{hashlib.sha256(content.tobytes()).hexdigest()} by {self._size}"

    def __len__(self) -> int:
        return int(self.probe.size)

    def chunks(self, start: int = 0) -> Iterator[PairChunk]:
        """Yield the pairs in their order, from chunk number `start` on."""
        for k in range(start * self._size, len(self), self._size):
            part = slice(k, k + self._size)
            sides = self.probe[part].astype(np.int32), self.reference[part].astype(np.int32)
            yield PairChunk(*sides, self.genuine[part].astype(np.int8))


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
    _, finger = np.unique([str(one.finger) for one in impressions], return_inverse=True)
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
