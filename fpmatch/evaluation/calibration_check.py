"""Whether a calibration keeps its word: how often impostors reach the scores that it gives.

A score of 20 says that one impostor comparison in a hundred reaches it, 30 one in a thousand. On
prints that the calibration was not fitted to, the share that does shows what that is worth.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.evaluation.comparison import NO_TEMPLATE
from fpmatch.matching.calibration import load_calibration, score_to_fmr
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.prepared_many import PreparedMany

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.evaluation.extraction import ExtractedSet
    from fpmatch.evaluation.report import EvaluationReport, SetResult
    from fpmatch.matching.calibration import Calibration

SCORES: Final = (20.0, 30.0, 40.0)
"""The scores that are looked at: one false match in 100, in 1,000, and in 10,000."""
LARGEST_FACTOR: Final = 2.0
"""By which the share found may differ from the share promised, either way."""


@dataclass(frozen=True, slots=True)
class CalibrationCheck:
    """Hold how many impostor comparisons of a database reach each of `SCORES`.

    Parameters
    ----------
    name : str
        The database's.
    impostors : int
        Impostor comparisons, without those that lack a template.
    reached : tuple of int
        How many of them reach each score or more.
    """

    name: str
    impostors: int
    reached: tuple[int, ...]

    @property
    def shares(self) -> tuple[float, ...]:
        """The share that reaches each score; 0 where there are no comparisons."""
        return tuple(n / max(self.impostors, 1) for n in self.reached)

    @property
    def factors(self) -> tuple[float, ...]:
        """How many times the share promised each of them is."""
        return tuple(s / score_to_fmr(at) for s, at in zip(self.shares, SCORES, strict=True))

    @property
    def kept(self) -> tuple[bool, ...]:
        """Whether each factor lies within `LARGEST_FACTOR`, either way."""
        return tuple(1 / LARGEST_FACTOR <= f <= LARGEST_FACTOR for f in self.factors)

    def as_json(self) -> dict[str, Any]:
        """Return name, number of comparisons, and a row a score."""
        columns = zip(SCORES, self.reached, self.shares, self.factors, strict=True)
        return {
            "name": self.name,
            "impostors": self.impostors,
            "scores": [
                {"score": at, "reached": n, "share": round(s, 7), "factor": round(f, 3)}
                for at, n, s, f in columns
            ],
        }


def check_calibration(
    report: EvaluationReport, calibration: Calibration | None = None
) -> list[CalibrationCheck]:
    """Count the impostors of an evaluation that reach the scores.

    Parameters
    ----------
    report : EvaluationReport
        The evaluation.
    calibration : Calibration, optional
        What gives the scores (default: the package's for the report's matcher).

    Returns
    -------
    list of CalibrationCheck
        One for each database, in order, and a last one, "all", where there are several.

    Raises
    ------
    MatcherError
        If the package has no calibration for the matcher.
    """
    used = calibration or load_calibration(report.matcher)
    checks = [_check(row, used) for row in report.sets]
    if len(checks) == 1:
        return checks
    reached = np.sum([check.reached for check in checks], axis=0).tolist()
    return [
        *checks,
        CalibrationCheck("all", sum(check.impostors for check in checks), tuple(reached)),
    ]


def check_among(
    sets: Sequence[ExtractedSet], name: str, workers: int | None = None
) -> CalibrationCheck:
    """Count the impostors among all impressions of all databases that reach the scores.

    Fingers of different databases are taken for different ones, so that a few databases make very
    many impostor comparisons. The default matcher compares.

    Parameters
    ----------
    sets : sequence of ExtractedSet
        The databases.
    name : str
        What to call them together.
    workers : int, optional
        Threads to use (default: one a core).

    Returns
    -------
    CalibrationCheck
        One for all.
    """
    templates, finger = [], []
    for number, one in enumerate(sets):
        for impression, found in zip(one.dataset.impressions, one.extractions, strict=True):
            if found.template is not None:
                templates.append(MATCHER.prepare(found.template))
                finger.append((number, impression.finger))
    many = PreparedMany.of(templates)
    label = np.unique(np.array(finger).reshape(-1, 2), axis=0, return_inverse=True)[1].ravel()
    calibration = load_calibration(MATCHER.name)

    def counted(k: int) -> tuple[int, ...]:
        similarity = MATCHER.similarities(templates[k], many, k + 1)
        scores = calibration.scores(similarity[label[k + 1 :] != label[k]])
        return (len(scores), *(int((scores >= at).sum()) for at in SCORES))

    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        counts = np.sum(list(pool.map(counted, range(len(templates)))), axis=0).tolist()
    return CalibrationCheck(name, counts[0], tuple(counts[1:]))


def format_calibration_checks(checks: Sequence[CalibrationCheck]) -> str:
    """Return a table: a row a database, for each score the share found and its factor.

    Examples
    --------
    >>> print(format_calibration_checks([CalibrationCheck("one", 20000, (240, 50, 1))]))
    database  impostors  from 20 on  times 1 %  from 30 on  times 0.1 %  from 40 on  times 0.01 %
    one           20000    1.2000 %       1.20    0.2500 %       2.50 !    0.0050 %          0.50
    """
    head = ["database", "impostors"]
    for score in SCORES:
        head += [f"from {score:g} on", f"times {100 * score_to_fmr(score):g} %"]
    rows = [head]
    for check in checks:
        row = [check.name, str(check.impostors)]
        for share, factor, kept in zip(check.shares, check.factors, check.kept, strict=True):
            row += [f"{100 * share:.4f} %", f"{factor:.2f}" + ("" if kept else " !")]
        rows.append(row)
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(
            cell.rjust(width) if column else cell.ljust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    )


def _check(row: SetResult, calibration: Calibration) -> CalibrationCheck:
    impostor = ~row.pairs.genuine & (row.outcomes["reason"] != NO_TEMPLATE)
    scores = calibration.scores(row.outcomes["similarity"][impostor])
    reached = tuple(int((scores >= at).sum()) for at in SCORES)
    return CalibrationCheck(row.name, int(impostor.sum()), reached)
