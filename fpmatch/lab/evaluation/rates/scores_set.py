"""The comparisons of one matcher on one database, and the ranks of own fingers among all."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Numbers = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Trials:
    """The comparisons of one database, its `name`: similarity and the two fingers, from 0 on.

    `fingers` is 0 where the fingers are not known; `probe` and `reference` are then the same number
    in genuine comparisons, different ones in impostor comparisons, and mean nothing else.
    """

    similarity: NDArray[np.float64]
    probe: NDArray[np.intp]
    reference: NDArray[np.intp]
    fingers: int
    name: str = ""

    @classmethod
    def without_fingers(cls, similarity: Numbers, genuine: NDArray[np.bool_]) -> Trials:
        """Return comparisons of which it is only known whether they are genuine."""
        return cls(similarity, np.zeros(genuine.size, np.intp), (~genuine).astype(np.intp), 0)

    @property
    def genuine(self) -> NDArray[np.bool_]:
        """Whether both prints show the same finger."""
        return np.asarray(self.probe == self.reference)


@dataclass(frozen=True, slots=True, eq=False)
class ScoresSet:
    """The comparisons of one database by one matcher ("" where it is not known).

    `matcher`, `name`: the matcher and the database. `prints`: names of the images; empty where they
    are not known. `probe`, `reference` (N,): indices into `prints`; shape (0,) where the names are
    not known. `trials`: similarities and fingers. `compared` (N,): False where a side has no
    template; the similarity is then the lowest. `distances`: whether the similarities are
    distances, taken negatively.
    """

    matcher: str
    name: str
    prints: tuple[str, ...]
    probe: NDArray[np.intp]
    reference: NDArray[np.intp]
    trials: Trials
    compared: NDArray[np.bool_]
    distances: bool = False

    @property
    def impostors(self) -> Trials:
        """The comparisons of different fingers, without those of prints that have no template."""
        t, kept = self.trials, ~self.trials.genuine & self.compared
        return Trials(t.similarity[kept], t.probe[kept], t.reference[kept], t.fingers, self.name)

    @property
    def never_compared(self) -> list[str]:
        """Names of the prints none of whose comparisons has a score: failures to extract."""
        alive = np.zeros(len(self.prints), bool)
        if self.prints:
            alive[self.probe[self.compared]] = alive[self.reference[self.compared]] = True
        return [name for name, is_alive in zip(self.prints, alive, strict=True) if not is_alive]

    def split(self) -> tuple[Numbers, Numbers]:
        """Return the similarities of genuine and of impostor pairs."""
        genuine = self.trials.genuine
        return self.trials.similarity[genuine], self.trials.similarity[~genuine]


def unnamed_set(
    genuine: Numbers,
    impostor: Numbers,
    *,
    matcher: str = "",
    name: str = "scores",
    distances: bool = False,
) -> ScoresSet:
    """Return scores whose prints and fingers are not known; NaN where a comparison failed."""
    similarity = np.concatenate([genuine, impostor])
    kind = np.arange(similarity.size) < genuine.size
    trials = Trials.without_fingers(filled(similarity), kind)
    nothing = np.empty(0, np.intp)
    compared = np.isfinite(similarity)
    return ScoresSet(matcher, name, (), nothing, nothing, trials, compared, distances)


def filled(similarity: Numbers) -> Numbers:
    """Return similarities with those of failed comparisons as low as any, and not above 0."""
    failed = np.isnan(similarity)
    lowest = min(0.0, float(similarity[~failed].min(initial=0.0)))
    return np.where(failed, lowest, similarity)


def ranks_of(scores: ScoresSet) -> tuple[NDArray[np.intp], NDArray[np.intp]] | None:
    """Search each impression of a database among all others, by the similarities of all pairs.

    The result is the rank of each probe's own finger among all fingers, from 1 on, and that finger,
    in the impressions' order; a finger counts by its most similar impression. It is None where not
    all pairs were compared (protocol "fvc"), each once, the fingers are not known, or there are not
    two of them, one with two impressions.
    """
    count, pairs = len(scores.prints), scores.probe.size
    if not count or pairs != count * (count - 1) // 2 or not scores.trials.fingers:
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
    return rank[as_given], finger[probes][as_given]
