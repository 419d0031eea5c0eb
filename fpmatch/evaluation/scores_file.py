"""Write every comparison of an evaluation to a CSV file; `scores_reader` reads it."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.evaluation.decision import decide
from fpmatch.matching.calibration import calibrated_matchers, load_calibration
from fpmatch.output import atomic_write, check_writable

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator

    from fpmatch.evaluation.report import EvaluationReport, SetResult

_GEOMETRY: Final = ("scale", "rotation_deg", "tx", "ty", "rms_px", "agreement", "overlap")
COLUMNS: Final = (
    *("matcher", "set", "probe", "reference", "genuine", "similarity", "score", "pairs"),
    *_GEOMETRY,
    "reason",
)


def write_scores(path: str | os.PathLike[str], *reports: EvaluationReport) -> None:
    """Write a row a comparison, by matcher, set and pair, with the columns `COLUMNS`.

    `genuine` is 1 or 0; values that do not exist (the transform of a pair without one, the score
    of a matcher without calibration) are left empty, and so is `reason` where `fpmatch.verify` says
    match by default. The file appears whole or not at all.

    Parameters
    ----------
    path : path
        The file, replaced where it exists.
    *reports : EvaluationReport
        The evaluations, one a matcher.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    check_writable(path)
    with atomic_write(path) as binary, io.TextIOWrapper(binary, "utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        for report in reports:
            for row in report.sets:
                writer.writerows(_rows(row, report.matcher))


def _rows(result: SetResult, matcher: str) -> Iterator[list[object]]:
    names = [i.path.name for i in result.extracted.dataset.impressions]
    outcomes, pairs = result.outcomes, result.pairs
    score = np.full(len(pairs), np.nan)
    if matcher in calibrated_matchers():
        score = load_calibration(matcher).scores(outcomes["similarity"])
    geometry = [[_short(v) for v in outcomes[column].tolist()] for column in _GEOMETRY]
    columns = (
        [names[i] for i in pairs.probe],
        [names[i] for i in pairs.reference],
        pairs.genuine.astype(int).tolist(),
        outcomes["similarity"].tolist(),
        [_short(v) for v in score.tolist()],
        outcomes["pairs"].tolist(),
        *geometry,
        np.where(decide(matcher, outcomes["similarity"]), "", outcomes["reason"]).tolist(),
    )
    for values in zip(*columns, strict=True):
        yield [matcher, result.name, *values]


def _short(value: float) -> str:
    """Return a measured value with six digits; "" where there is none."""
    return "" if np.isnan(value) else f"{value:.6g}"
