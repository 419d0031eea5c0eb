"""The rows of `fpmatch score`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from fpmatch.evaluation.score_file import csv_lines, failure_reason

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.evaluation.batch.plan import PairChunk
    from fpmatch.matching.calibration import Calibration


class SideRows(NamedTuple):
    """Names and fingers of the prints of one side, and why some have no template."""

    names: Sequence[str]
    fingers: Sequence[str]
    failures: Mapping[int, str]


@dataclass(frozen=True, slots=True)
class RowWriter:
    """Write pairs and their similarities as rows of `fpmatch.evaluation.score_file.COLUMNS`.

    Genuine pairs are known only if both sides are the `same` prints. Without a calibration, scores
    are left empty. With a `threshold`, rows of lower scores are left out, but not those of prints
    without a template, whose score is not known.
    """

    matcher: str
    database: str
    probes: SideRows
    references: SideRows
    same: bool
    calibration: Calibration | None
    threshold: float | None

    def lines(self, chunk: PairChunk, similarity: NDArray[np.float64]) -> tuple[bytes, int, int]:
        """Return the lines of some pairs, their number, and the number of pairs without a score.

        `similarity` is not a number where a print has no template.
        """
        failed = np.isnan(similarity)
        score = np.full(len(chunk), np.nan)
        if self.calibration is not None:
            score = self.calibration.scores(similarity)
        kept = np.arange(len(chunk))
        if self.threshold is not None:
            kept = np.flatnonzero(failed | (score >= self.threshold))
        columns = (chunk.probe, chunk.reference, similarity, score)
        rows = map(self._row, *(column[kept].tolist() for column in columns))
        return csv_lines(rows), len(kept), int(failed.sum())

    def _row(self, i: int, j: int, similarity: float, score: float) -> tuple[object, ...]:
        probes, references = self.probes, self.references
        genuine = int(probes.fingers[i] == references.fingers[j]) if self.same else ""
        reason = ""
        if math.isnan(similarity):
            reason = failure_reason(probes.failures.get(i, ""), references.failures.get(j, ""))
        names = probes.names[i], references.names[j]
        numbers = ["" if math.isnan(value) else value for value in (similarity, score)]
        return (self.matcher, self.database, *names, genuine, *numbers, reason)
