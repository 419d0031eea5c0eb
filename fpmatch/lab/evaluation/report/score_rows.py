"""The comparisons of evaluations as rows of a file of scores."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fpmatch.base.output import atomic_write, check_writable
from fpmatch.errors import without_path
from fpmatch.gallery.batch.comparer import NO_TEMPLATE
from fpmatch.gallery.batch.decision import calibration_of, outcomes, rho_of
from fpmatch.gallery.batch.score_file import COLUMNS, DETAILS, csv_lines, failure_reason
from fpmatch.matching.result import MATCH

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Sequence

    from fpmatch.lab.evaluation.report.results import EvaluationReport, SetResult

_BEFORE_DETAILS = COLUMNS.index("reason")


def write_scores(path: str | os.PathLike[str], *reports: EvaluationReport) -> None:
    """Write all comparisons of evaluations, one a matcher, with `COLUMNS` and `DETAILS`.

    ``reason`` is empty where `fpmatch.verify` decides by default that the prints match. The file
    appears whole or not at all; an `OutputError` is raised if it cannot be written.
    """
    check_writable(path)
    with atomic_write(path) as stream:
        head = (*COLUMNS[:_BEFORE_DETAILS], *DETAILS, *COLUMNS[_BEFORE_DETAILS:])
        stream.write(csv_lines([head]))
        for report in reports:
            for row in report.sets:
                stream.write(csv_lines(_rows(row, report.matcher)))


def _rows(result: SetResult, matcher: str) -> Iterator[Sequence[object]]:
    impressions = result.extracted.dataset.impressions
    measured, pairs = result.outcomes, result.pairs
    failed, similarity = measured["reason"] == NO_TEMPLATE, measured["similarity"]
    calibration = calibration_of(matcher)
    score = calibration.scores(similarity) if calibration else np.full(len(pairs), np.nan)
    failures = [
        "" if e.template else without_path(e.reason, i.path) or NO_TEMPLATE
        for i, e in zip(impressions, result.extracted.extractions, strict=True)
    ]
    decision = outcomes(
        similarity, score, measured["reachable"], calibration=calibration, rho=rho_of(matcher)
    )
    why = np.where(decision == MATCH, "", measured["reason"])
    for k in np.flatnonzero(failed).tolist():
        why[k] = failure_reason(failures[pairs.probe[k]], failures[pairs.reference[k]])
    quality = ["" if e.quality is None else e.quality for e in result.extracted.extractions]
    columns = (
        *([impressions[i].name for i in side] for side in (pairs.probe, pairs.reference)),
        pairs.genuine.astype(int).tolist(),
        ["" if no else value for no, value in zip(failed, similarity.tolist(), strict=True)],
        ["" if no else _short(value) for no, value in zip(failed, score.tolist(), strict=True)],
        decision.tolist(),
        measured["pairs"].tolist(),
        *([_short(value) for value in measured[column].tolist()] for column in DETAILS[1:]),
        why.tolist(),
        *([quality[i] for i in side] for side in (pairs.probe, pairs.reference)),
    )
    for values in zip(*columns, strict=True):
        yield (matcher, result.name, *values)


def _short(value: float) -> str:
    """Return a measured value with six digits; "" where there is none."""
    return "" if np.isnan(value) else f"{value:.6g}"
