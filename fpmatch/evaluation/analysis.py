"""Analysis of an evaluation: rates, their intervals, and the comparison with other runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fpmatch.evaluation import tables
from fpmatch.evaluation.bootstrap import DEFAULT_BOOTSTRAP
from fpmatch.evaluation.intervals import rate_intervals
from fpmatch.evaluation.run_comparison import compare_runs
from fpmatch.evaluation.scores import choose_matcher
from fpmatch.evaluation.scores_set import scores_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.evaluation.intervals import ReportIntervals
    from fpmatch.evaluation.report import EvaluationReport
    from fpmatch.evaluation.run_comparison import RunComparison
    from fpmatch.evaluation.scores_set import ScoresSet


@dataclass(frozen=True, slots=True)
class Analysis:
    """Hold one matcher's evaluation, intervals of its rates, and the comparison with a baseline."""

    report: EvaluationReport
    intervals: ReportIntervals | None = None
    baseline: RunComparison | None = None
    baseline_name: str = ""

    def as_json(self) -> dict[str, Any]:
        """Return everything as JSON values."""
        beside = {"intervals": self.intervals, "baseline": self.baseline}
        known = {name: part.as_json() for name, part in beside.items() if part is not None}
        return {**self.report.as_json(), **known}

    def as_text(self) -> str:
        """Return everything as tables of text."""
        parts = [tables.format_report(self.report)]
        if self.intervals is not None:
            parts.append(tables.format_intervals(self.report, self.intervals))
        if self.baseline is not None:
            parts.append(tables.format_comparison(self.baseline, self.baseline_name))
        return "\n\n".join(parts)


def analyse(
    report: EvaluationReport,
    *,
    bootstrap: int = DEFAULT_BOOTSTRAP,
    seed: int = 0,
    baseline: Sequence[ScoresSet] | None = None,
    baseline_name: str = "the baseline",
) -> Analysis:
    """Analyse an evaluation.

    `bootstrap` is the number of replicates for the 95 % intervals (0: no intervals). `baseline` is
    an earlier run: its comparisons by the same matcher, or by its only one, are compared.
    """
    comparison = None
    if baseline is not None:
        earlier = list(baseline)
        if len({one.matcher for one in earlier}) > 1:
            earlier = choose_matcher(earlier, report.matcher, baseline_name)
        comparison = compare_runs(earlier, scores_of(report), bootstrap=bootstrap, seed=seed)
    intervals = rate_intervals(report, bootstrap=bootstrap, seed=seed) if bootstrap else None
    return Analysis(report, intervals, comparison, baseline_name)


def compare_matchers(
    analyses: Sequence[Analysis], *, bootstrap: int = DEFAULT_BOOTSTRAP, seed: int = 0
) -> list[RunComparison]:
    """Compare the first matcher's run, as the earlier one, with that of each other matcher.

    The list is empty where a kind of pair is missing.
    """
    if analyses[0].report.pooled.eer is None:
        return []
    first, *others = (scores_of(one.report) for one in analyses)
    return [compare_runs(first, other, bootstrap=bootstrap, seed=seed) for other in others]


def document_of(
    analyses: Sequence[Analysis], comparisons: Sequence[RunComparison] = ()
) -> dict[str, Any]:
    """Return analyses, one a matcher, and `compare_matchers` of them as one JSON object."""
    if len(analyses) == 1:
        return analyses[0].as_json()
    return {
        "matchers": [{"matcher": one.report.matcher, **one.as_json()} for one in analyses],
        "against_first": [comparison.as_json() for comparison in comparisons],
    }


def text_of(analyses: Sequence[Analysis], comparisons: Sequence[RunComparison] = ()) -> str:
    """Return the same as tables; several matchers are side by side at the end."""
    if len(analyses) == 1:
        return analyses[0].as_text()
    first = analyses[0].report.matcher
    return "\n\n".join(
        [
            *(f"matcher {one.report.matcher}\n{one.as_text()}" for one in analyses),
            tables.format_matchers([one.report for one in analyses]),
            *(tables.format_comparison(comparison, first) for comparison in comparisons),
        ]
    )
