"""The comparisons of one matcher on one database, from an evaluation or from a file of scores."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Numbers = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Trials:
    """The comparisons of one database: similarity and the two fingers, numbered from 0.

    `fingers` is 0 where the fingers are not known; `probe` and `reference` are then the same number
    in genuine comparisons, different ones in impostor comparisons, and mean nothing else.
    """

    similarity: NDArray[np.float64]
    probe: NDArray[np.intp]
    reference: NDArray[np.intp]
    fingers: int

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
    template; the similarity is then the lowest. `quality` (number of prints,): quality of each
    print, 0 to 100; NaN where it is not known. `overlap` (N,): overlap of the prints as placed, as
    a share of the smaller; NaN where it is not known. `distances`: whether the similarities are
    distances, taken negatively. `note`: how the file was understood, where that is not certain.
    """

    matcher: str
    name: str
    prints: tuple[str, ...]
    probe: NDArray[np.intp]
    reference: NDArray[np.intp]
    trials: Trials
    compared: NDArray[np.bool_]
    quality: Numbers | None = None
    overlap: Numbers | None = None
    distances: bool = False
    note: str = ""

    @property
    def impostors(self) -> Trials:
        """The comparisons of different fingers, without those of prints that have no template."""
        t, kept = self.trials, ~self.trials.genuine & self.compared
        return Trials(t.similarity[kept], t.probe[kept], t.reference[kept], t.fingers)

    @property
    def never_compared(self) -> list[str]:
        """Names of the prints none of whose comparisons has a score."""
        alive = np.zeros(len(self.prints), bool)
        if self.prints:
            alive[self.probe[self.compared]] = alive[self.reference[self.compared]] = True
        return [name for name, is_alive in zip(self.prints, alive, strict=True) if not is_alive]

    def split(self) -> tuple[Numbers, Numbers]:
        """Return the similarities of genuine and of impostor pairs."""
        genuine = self.trials.genuine
        return self.trials.similarity[genuine], self.trials.similarity[~genuine]


def unnamed_set(
    genuine: NDArray[np.float64],
    impostor: NDArray[np.float64],
    *,
    matcher: str = "",
    name: str = "scores",
    distances: bool = False,
) -> ScoresSet:
    """Return scores whose prints and fingers are not known; NaN where a comparison failed."""
    similarity = np.concatenate([genuine, impostor])
    kind = np.repeat(np.array([0, 1], np.intp), [genuine.size, impostor.size])
    trials = Trials(filled(similarity), np.zeros(kind.size, np.intp), kind, 0)
    nothing = np.empty(0, np.intp)
    compared = np.isfinite(similarity)
    return ScoresSet(matcher, name, (), nothing, nothing, trials, compared, distances=distances)


def filled(similarity: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return similarities with those of failed comparisons as low as any, and not above 0."""
    failed = np.isnan(similarity)
    lowest = min(0.0, float(similarity[~failed].min(initial=0.0)))
    return np.where(failed, lowest, similarity)
