"""All that is said of an evaluation: rates, how sure they are, and what has changed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fpmatch.evaluation.interval_table import format_intervals
from fpmatch.evaluation.intervals import DEFAULT_RESAMPLES, rate_intervals
from fpmatch.evaluation.run_comparison import compare_runs
from fpmatch.evaluation.run_comparison_table import format_paired
from fpmatch.evaluation.scores_reader import choose_matcher, scores_of
from fpmatch.evaluation.table import format_matchers, format_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.evaluation.intervals import ReportIntervals
    from fpmatch.evaluation.report import EvaluationReport
    from fpmatch.evaluation.run_comparison_result import PairedComparison
    from fpmatch.evaluation.scores_reader import ScoresSet


@dataclass(frozen=True, slots=True)
class Analysis:
    """Hold one matcher's evaluation and what follows from it.

    Parameters
    ----------
    report : EvaluationReport
        The evaluation.
    intervals : ReportIntervals or None
        How sure its rates are; None where nobody asked.
    baseline : PairedComparison or None
        The comparison with an earlier run; None where there is none.
    baseline_name : str
        What the earlier run is called.
    """

    report: EvaluationReport
    intervals: ReportIntervals | None = None
    baseline: PairedComparison | None = None
    baseline_name: str = ""

    def as_json(self) -> dict[str, Any]:
        """Return everything as JSON values."""
        document = self.report.as_json()
        if self.intervals is not None:
            document["intervals"] = self.intervals.as_json()
        if self.baseline is not None:
            document["baseline"] = self.baseline.as_json()
        return document

    def as_text(self) -> str:
        """Return everything as tables, for people."""
        parts = [format_table(self.report)]
        if self.intervals is not None:
            parts.append(format_intervals(self.report, self.intervals))
        if self.baseline is not None:
            parts.append(format_paired(self.baseline, self.baseline_name))
        return "\n\n".join(parts)


def analyse(
    report: EvaluationReport,
    *,
    resamples: int = DEFAULT_RESAMPLES,
    seed: int = 0,
    baseline: Sequence[ScoresSet] | None = None,
    baseline_name: str = "the baseline",
) -> Analysis:
    """Analyse an evaluation.

    Parameters
    ----------
    report : EvaluationReport
        The evaluation.
    resamples, seed : int
        Draws of fingers for the 95 % intervals (0: no intervals), and what makes the draws.
    baseline : sequence of ScoresSet, optional
        An earlier run's comparisons, from `read_scores`: by the same matcher where the run has it,
        else by its only one.
    baseline_name : str
        What to call the earlier run.

    Returns
    -------
    Analysis
        The analysis.

    Raises
    ------
    DatasetError
        If the earlier run has no pairs, or no scores of the matcher, to compare with.
    """
    paired = None
    if baseline is not None:
        earlier = list(baseline)
        if len({one.matcher for one in earlier}) > 1:
            earlier = choose_matcher(earlier, report.matcher, baseline_name)
        paired = compare_runs(earlier, scores_of(report), resamples=resamples, seed=seed)
    intervals = rate_intervals(report, resamples=resamples, seed=seed) if resamples else None
    return Analysis(report, intervals, paired, baseline_name)


def compare_matchers(
    analyses: Sequence[Analysis], *, resamples: int = DEFAULT_RESAMPLES, seed: int = 0
) -> list[PairedComparison]:
    """Compare the first matcher's run, pair by pair, with each other's.

    Parameters
    ----------
    analyses : sequence of Analysis
        One a matcher, over the same databases.
    resamples, seed : int
        As for `analyse`.

    Returns
    -------
    list of PairedComparison
        With the first matcher as the earlier run, for the second, the third, …; none where there
        are no genuine or no impostor pairs.
    """
    if analyses[0].report.pooled.eer is None:
        return []
    first, *others = (scores_of(one.report) for one in analyses)
    return [compare_runs(first, other, resamples=resamples, seed=seed) for other in others]


def document_of(
    analyses: Sequence[Analysis], comparisons: Sequence[PairedComparison] = ()
) -> dict[str, Any]:
    """Return analyses as one JSON object: a single matcher's own, or a list under "matchers".

    Parameters
    ----------
    analyses : sequence of Analysis
        One a matcher.
    comparisons : sequence of PairedComparison
        Those of the first with the others.

    Returns
    -------
    dict
        JSON values.
    """
    if len(analyses) == 1:
        return analyses[0].as_json()
    return {
        "matchers": [{"matcher": one.report.matcher, **one.as_json()} for one in analyses],
        "against_first": [comparison.as_json() for comparison in comparisons],
    }


def text_of(analyses: Sequence[Analysis], comparisons: Sequence[PairedComparison] = ()) -> str:
    """Return analyses as tables; with several matchers, all side by side at the end.

    Parameters
    ----------
    analyses, comparisons
        As for `document_of`.

    Returns
    -------
    str
        The tables.
    """
    if len(analyses) == 1:
        return analyses[0].as_text()
    first = analyses[0].report.matcher
    return "\n\n".join(
        [
            *(f"matcher {one.report.matcher}\n{one.as_text()}" for one in analyses),
            format_matchers([one.report for one in analyses]),
            *(format_paired(comparison, first) for comparison in comparisons),
        ]
    )
