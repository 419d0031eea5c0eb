"""The tail of a calibration, measured on pairs of synthetic templates in a large gallery.

A calibration keeps its own knots up to the score `KEPT`. From `MEASURED` on it follows the kind of
pairs (with ridges, minutiae alone) that reaches a similarity most often, where at least `MIN_ABOVE`
do; between the two scores it is a straight line, which states more false matches than there are.
Beyond, a generalised Pareto tail begins as the pairs do. Its shape is the largest that calibrations
have: synthetic fingers do not support an FMR of 1 in 10 billion.
``python -m research train tail`` measures the pairs. Those that are kept were chosen by a search,
whose loss they state.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from scipy.optimize import brentq

from fpmatch.errors import DatasetError
from fpmatch.lab.evaluation.calibrate import MAX_SHAPE, MIN_ABOVE

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from fpmatch.matching.calibration import Calibration

KEPT: Final = 40.0
MEASURED: Final = 60.0
STEP: Final = 0.1  # of similarity, between knots
LEAST_COMPARED: Final = 20  # pairs that measure which share of them a search compares


@dataclass(frozen=True, slots=True, eq=False)
class ImpostorKind:
    """The highest similarities of pairs of different fingers, of one kind.

    Where a search chose the pairs, `compared` are the highest similarities of pairs that were all
    compared, and `searched` of those among them that the search compares, too.
    """

    name: str
    pairs: int
    similarity: NDArray[np.float64]
    compared: NDArray[np.float64]
    searched: NDArray[np.float64]

    @classmethod
    def of_json(cls, entry: Mapping[str, Any]) -> ImpostorKind:
        """Return the kind in an entry of a file of results."""
        high = (np.array(entry.get(k, ()), float) for k in ("similarity", "compared", "searched"))
        return cls(entry["name"], entry["pairs"], *high)

    def above(self, similarity: float) -> int:
        """Return how many pairs reach a similarity."""
        return int((self.similarity >= similarity).sum())

    def compares(self, similarity: float) -> float:
        """Return the share of the pairs above a similarity that the search compares.

        Above the similarity that `LEAST_COMPARED` of all compared pairs reach, it is that of these.
        """
        if len(self.compared) < LEAST_COMPARED:
            return 1.0
        start = min(similarity, np.sort(self.compared)[-LEAST_COMPARED])
        return float((self.searched >= start).sum() / (self.compared >= start).sum())

    def fmr(self, similarity: float) -> float:
        """Return the share of the pairs that reach a similarity, with those that a search loses."""
        return self.above(similarity) / self.pairs / self.compares(similarity)


def kinds_of(results: Mapping[str, Any]) -> list[ImpostorKind]:
    """Return the kinds in a file of results."""
    return [ImpostorKind.of_json(entry) for entry in results["kinds"]]


def similarity_of(calibration: Calibration, score: float) -> float:
    """Return the similarity at which a score is reached."""
    return float(brentq(lambda similarity: calibration.score(similarity) - score, 0.0, 1000.0))


def with_tail(calibration: Calibration, results: Mapping[str, Any]) -> Calibration:
    """Return a calibration with high knots and a tail of the searches of a gallery."""
    kinds = kinds_of(results)
    origin = calibration.provenance
    below = sum(score < KEPT for _, score in calibration.knots)
    kept = origin["tail_from"] if origin.get("tail") else calibration.knots[: below + 1][-1][1]
    own = [knot for knot in calibration.knots if knot[1] <= kept]
    last = own[-1][0]
    knots = list(own)
    for x in np.arange(np.ceil(last / STEP) * STEP, 100.0, STEP).round(3).tolist():
        fmr = max((k.fmr(x) for k in kinds if k.above(x) >= MIN_ABOVE), default=0.0)
        score = round(-10.0 * float(np.log10(fmr)), 6) if fmr else 0.0
        if x > knots[-1][0] and score > max(knots[-1][1], MEASURED):
            knots.append((x, score))
    if len(knots) == len(own):
        raise DatasetError("tail: too few pairs lie above the calibration's own knots")
    scale = _tail_scale(knots[-1][0], kinds)
    tail = "; ".join(f"{kind.pairs} pairs, {kind.name}" for kind in kinds)
    origin = {**origin, "tail": tail, "tail_from": kept}
    return replace(
        calibration, knots=tuple(knots), tail_scale=scale, tail_shape=MAX_SHAPE, provenance=origin
    )


def _tail_scale(last: float, kinds: list[ImpostorKind]) -> float:
    """Return the scale above the last knot, of the kind whose pairs fall slowest.

    With it and the shape `MAX_SHAPE` the mean excess is that of the pairs.
    """
    above = [kind.similarity[kind.similarity >= last] - last for kind in kinds]
    means = [float(excess.mean()) for excess in above if len(excess) >= MIN_ABOVE]
    return round(max(means) * (1.0 - MAX_SHAPE), 6)
