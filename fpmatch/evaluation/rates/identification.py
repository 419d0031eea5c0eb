"""Identification: the rank of a print's own finger in a search among all fingers.

The protocol, within one database: each impression whose finger has another is a probe. It is
searched among all other impressions of the database; a finger's similarity to the probe is the
highest of its impressions'. The rank of the probe's own finger is 1 plus the number of other
fingers at least as similar, so a tie counts against it, and a probe without template ranks last.

References
----------
ISO/IEC 19795-1, "Biometric performance testing and reporting", for the cumulative match
characteristic.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.evaluation.rates.scores_set import ScoresSet


@dataclass(frozen=True, slots=True, eq=False)
class Identification:
    """The results of searching each probe of a database, in the impressions' order.

    `rank` holds the ranks of the probes' own fingers among `fingers`, from 1 on, and `finger` these
    fingers as indices into the database's.
    """

    fingers: int
    rank: NDArray[np.intp]
    finger: NDArray[np.intp]

    @property
    def rank_one(self) -> float:
        """Share of the probes whose own finger comes first."""
        return float(np.mean(self.rank == 1))

    def match_characteristic(self) -> NDArray[np.float64]:
        """Return the CMC: the share of the probes with rank at most 1, 2, … `fingers`."""
        counts = np.bincount(self.rank, minlength=self.fingers + 1)[1:]
        return np.cumsum(counts) / self.rank.size


def identify_all(scores: ScoresSet) -> Identification | None:
    """Search each impression of a database among all others, by the similarities of all pairs.

    The result is None where not all pairs were compared (protocol "fvc"), each once, or where there
    are not two fingers, one of them with two impressions.
    """
    count, pairs = len(scores.prints), scores.probe.size
    if not count or pairs != count * (count - 1) // 2:
        return None
    fingers = np.zeros(count, np.intp)
    fingers[scores.probe] = scores.trials.probe
    fingers[scores.reference] = scores.trials.reference
    order = np.argsort(fingers, kind="stable")
    _, starts, finger, sizes = np.unique(
        fingers[order], return_index=True, return_inverse=True, return_counts=True
    )
    probes = np.flatnonzero(sizes[finger] > 1)
    if sizes.size < 2 or not probes.size:
        return None
    table = np.full((count, count), -np.inf)
    similarity = scores.trials.similarity
    table[scores.probe, scores.reference] = table[scores.reference, scores.probe] = similarity
    best = np.maximum.reduceat(table[np.ix_(order, order)], starts, axis=1)[probes]
    own = best[np.arange(probes.size), finger[probes]]
    rank = np.count_nonzero(best >= own[:, np.newaxis], axis=1)  # the own finger is one of them
    as_given = np.argsort(order[probes])
    return Identification(int(sizes.size), rank[as_given], finger[probes][as_given])
