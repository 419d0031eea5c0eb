"""Comparisons as a report: the rates of each database, their mean, and all scores pooled."""

from __future__ import annotations

import math
from dataclasses import astuple
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.evaluation.identification import identify_all
from fpmatch.evaluation.rates import Rates, error_rates
from fpmatch.evaluation.report import (
    EvaluationReport,
    RatesReport,
    SetRates,
    SetResult,
    split_scores,
)
from fpmatch.evaluation.scores_set import scores_of_set
from fpmatch.packed_template import minutiae_digest

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.evaluation.extraction import ExtractedSet
    from fpmatch.evaluation.protocol import Pairs
    from fpmatch.evaluation.scores_set import ScoresSet


def summarise_set(
    matcher: str, extracted: ExtractedSet, pairs: Pairs, outcomes: NDArray[np.void]
) -> SetResult:
    """Summarise the comparisons of one database."""
    cpu_us = outcomes["cpu_us"][np.isfinite(outcomes["cpu_us"])]
    scores = scores_of_set(matcher, extracted, pairs, outcomes)
    return SetResult(
        scores=scores,
        rates=error_rates(*scores.split()),
        identification=identify_all(scores),
        failures=tuple(extracted.failures),
        extract_ms=extracted.median_cpu_ms,
        match_us=float(np.median(cpu_us)) if cpu_us.size else math.nan,
        extracted=extracted,
        pairs=pairs,
        outcomes=outcomes,
        identical=_find_identical(extracted, pairs),
    )


def _find_identical(extracted: ExtractedSet, pairs: Pairs) -> tuple[int, ...]:
    """Return the pairs whose prints have the same frame and minutiae."""
    templates = [one.template for one in extracted.extractions]
    digests = [b"" if template is None else minutiae_digest(template) for template in templates]
    first: dict[bytes, int] = {}
    number = np.array([first.setdefault(d, k) if d else -1 for k, d in enumerate(digests)])
    same = (number[pairs.probe] == number[pairs.reference]) & (number[pairs.probe] >= 0)
    return tuple(np.flatnonzero(same).tolist())


def summarise(matcher: str, protocol: str, sets: Sequence[SetResult]) -> EvaluationReport:
    """Summarise the rows of all databases."""
    return EvaluationReport(matcher, protocol, tuple(sets), *_together(sets))


def summarise_scores(sets: Sequence[ScoresSet]) -> RatesReport:
    """Return the error rates of scores that one matcher gave, a row a database.

    Prints none of whose comparisons has a score count as failures to extract.
    """
    rows = tuple(
        SetRates(
            scores=scores,
            rates=error_rates(*scores.split()),
            identification=identify_all(scores),
            failures=tuple((Path(name), f"{name}: no score") for name in scores.never_compared),
            extract_ms=math.nan,
            match_us=math.nan,
        )
        for scores in sets
    )
    return RatesReport(sets[0].matcher, "", rows, *_together(rows))


def _together(sets: Sequence[SetRates]) -> tuple[Rates, Rates]:
    """Return the mean of the rates of all databases, and the rates of all their scores."""
    columns = zip(*(astuple(row.rates) for row in sets), strict=True)
    mean = Rates(*(None if None in column else float(np.mean(column)) for column in columns))
    return mean, error_rates(*split_scores(sets))
