"""Protocols: the genuine and the impostor pairs of a database that are compared.

References
----------
Maio, Maltoni, Cappelli, Wayman, Jain, "FVC2002: Second Fingerprint Verification Competition",
ICPR 2002, for the "fvc" protocol.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import DatasetError, unknown_name
from fpmatch.lab.evaluation.impression import finger_numbers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.impression import Impression

PROTOCOLS: Final = ("extended", "fvc")


@dataclass(frozen=True, slots=True, eq=False)
class Pairs:
    """The pairs to compare, as indices into a database's impressions.

    Parameters
    ----------
    probe, reference : ndarray of intp, shape (N,)
        Indices of the two impressions of each pair; of a protocol, probe < reference.
    genuine : ndarray of bool, shape (N,)
        Whether both show the same finger.
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
    those of the fingers' first impressions (their lowest numbers).

    Parameters
    ----------
    impressions : sequence of Impression
        A database's impressions.
    protocol : str
        "extended" or "fvc".

    Raises
    ------
    DatasetError
        If the protocol is unknown.

    Examples
    --------
    >>> from pathlib import Path
    >>> from fpmatch.lab.evaluation.impression import Impression
    >>> from fpmatch.lab.evaluation.protocol import PROTOCOLS, choose_pairs
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
