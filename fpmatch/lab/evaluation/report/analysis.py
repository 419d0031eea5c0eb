"""Analysis of an evaluation: rates, their intervals, and the comparison with other runs.

`Report` is the value that is written as text, JSON and page.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch.gallery.batch.decision import calibration_of
from fpmatch.lab.evaluation.rates.bootstrap import DEFAULT_BOOTSTRAP
from fpmatch.lab.evaluation.rates.run_comparison import compare_runs, have_common_pairs
from fpmatch.lab.evaluation.rates.scores import choose_matcher
from fpmatch.lab.evaluation.report.operating_points import operating_points, rate_intervals
from fpmatch.lab.evaluation.report.rate_text import (
    INTERVAL_TITLES,
    RATE_TITLES,
    bounds_note,
    change_limits,
    decisions_sentence,
    defined_rates,
    interval_table,
    limits,
    percent,
    points,
    rate_cells,
)
from fpmatch.lab.evaluation.report.results import scores_of
from fpmatch.printable import text_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from fpmatch.lab.evaluation.rates.intervals import ExactBound
    from fpmatch.lab.evaluation.rates.run_comparison import ChangedPair, RunComparison
    from fpmatch.lab.evaluation.rates.scores_set import ScoresSet
    from fpmatch.lab.evaluation.report.operating_points import OperatingPoint, ReportIntervals
    from fpmatch.lab.evaluation.report.results import RatesReport

_PAIRS_NAMED: Final = 5


@dataclass(frozen=True, slots=True)
class Analysis:
    """One matcher's evaluation, intervals of its rates, and the comparison with a baseline.

    `points` are the FNMR at chosen FMRs.
    """

    report: RatesReport
    intervals: ReportIntervals | None = None
    baseline: RunComparison | None = None
    baseline_name: str = ""
    points: tuple[OperatingPoint, ...] = ()

    @property
    def distinct_points(self) -> Sequence[OperatingPoint]:
        """The points without those of all scores pooled where there is one database."""
        return self.points[: len(self.points) // 2] if len(self.report.sets) == 1 else self.points

    def as_json(self) -> dict[str, Any]:
        """Return everything as JSON values."""
        beside = {"intervals": self.intervals, "baseline": self.baseline}
        known: dict[str, Any] = {
            name: part.as_json() for name, part in beside.items() if part is not None
        }
        if self.points:
            known["fnmr_at_fmr"] = list(map(asdict, self.points))
        return {**self.report.as_json(), **known}

    def as_text(self) -> str:
        """Return everything as tables of text."""
        return Report((self,)).as_text()

    def tables(self) -> str:
        """Return the tables without the note on what bounds of intervals are."""
        parts = [self.report.as_text()]
        if self.intervals is not None:
            parts.append(_format_intervals(self.report, self.intervals))
        if self.points:
            parts.append(_format_points(self))
        if self.baseline is not None:
            parts.append(format_comparison(self.baseline, self.baseline_name))
        return "\n\n".join(parts)


def analyse(
    report: RatesReport,
    *,
    bootstrap: int = DEFAULT_BOOTSTRAP,
    seed: int = 0,
    fmrs: Sequence[float] = (),
    baseline: Sequence[ScoresSet] | None = None,
    baseline_name: str = "the baseline",
) -> Analysis:
    """Analyse an evaluation.

    `bootstrap` is the number of replicates for the 95 % intervals (0: no intervals). `baseline` is
    an earlier run: its comparisons by the same matcher, or by its only one, are compared. `fmrs`
    are false match rates at which the FNMR is reported.
    """
    comparison = None
    if baseline is not None:
        earlier = list(baseline)
        if len({one.matcher for one in earlier}) > 1:
            earlier = choose_matcher(earlier, report.matcher, baseline_name)
        if len(earlier) == len(report.sets) == 1 and earlier[0].name == Path(baseline_name).stem:
            earlier = [replace(earlier[0], name=report.sets[0].name)]  # named after its file only
        comparison = compare_runs(earlier, scores_of(report), bootstrap=bootstrap, seed=seed)
    intervals = rate_intervals(report, bootstrap=bootstrap, seed=seed) if bootstrap else None
    points = operating_points(report, fmrs, bootstrap=bootstrap, seed=seed)
    return Analysis(report, intervals, comparison, baseline_name, tuple(points))


@dataclass(frozen=True, slots=True)
class Report:
    """The report of a run: analyses, one a matcher, and the first compared with each other one.

    It is written as text, as JSON, and as a page by `fpmatch.lab.evaluation.report.page`.
    """

    analyses: tuple[Analysis, ...]
    comparisons: tuple[RunComparison, ...] = ()

    @classmethod
    def of(
        cls,
        results: Sequence[RatesReport],
        *,
        bootstrap: int = DEFAULT_BOOTSTRAP,
        seed: int = 0,
        **options: Any,
    ) -> Report:
        """Analyse evaluations as `analyse` does, and compare the first with the others.

        Matchers without pairs in common with it, or without names of prints, are not compared, and
        none where a kind of pair is missing.
        """
        draws: dict[str, Any] = {"bootstrap": bootstrap, "seed": seed}
        analyses = tuple(analyse(one, **draws, **options) for one in results)
        if results[0].pooled.eer is None:
            return cls(analyses)
        first, *others = map(scores_of, results)
        return cls(
            analyses,
            tuple(
                compare_runs(first, other, **draws)
                for other in others
                if have_common_pairs(first, other)
            ),
        )

    def as_json(self) -> dict[str, Any]:
        """Return the report as one JSON object."""
        each = [{"matcher": one.report.matcher, **one.as_json()} for one in self.analyses]
        if len(each) == 1:
            return each[0]
        return {
            "matchers": each,
            "against_first": [comparison.as_json() for comparison in self.comparisons],
        }

    def as_text(self) -> str:
        """Return the report as tables; several matchers are side by side at the end."""
        first = self.analyses[0]
        parts = [first.tables()]
        if len(self.analyses) > 1 or ":" in first.report.matcher:  # which states parameters
            parts = [f"matcher {one.report.matcher}\n{one.tables()}" for one in self.analyses]
        if len(self.analyses) > 1:
            parts.append(_format_matchers([one.report for one in self.analyses]))
            parts += [format_comparison(one, first.report.matcher) for one in self.comparisons]
        return "\n\n".join(filter(None, [*parts, self.note_on_bounds]))

    @property
    def note_on_bounds(self) -> str:
        """What the limits of intervals are that are not of the bootstrap; "" without any."""
        return bounds_note(self._bounds())

    def _bounds(self) -> Iterator[ExactBound | None]:
        """Yield the bases of all intervals, None those of the bootstrap."""
        for one in self.analyses:
            if one.intervals is not None:
                for rates in (*one.intervals.sets, one.intervals.mean, one.intervals.pooled):
                    yield from rates.bounds.values()
            yield from (point.bound for point in one.points)
        baselines = (one.baseline for one in self.analyses if one.baseline)
        for comparison in (*self.comparisons, *baselines):
            yield from (d.bound for _, differences in comparison.shown() for d in differences)


def _format_matchers(reports: Sequence[RatesReport]) -> str:
    """Return a line a matcher: of several databases the mean EER, and the rates of all scores."""
    names = defined_rates(report.pooled for report in reports)
    several = len(reports[0].sets) > 1
    mean, pooled = (["mean EER"], "pooled ") if several else ([], "")
    head = ("side by side", *mean, *(pooled + RATE_TITLES[n] for n in names), "rank-1")
    rows = (
        (
            *(r.matcher, *[percent(r.mean.eer)] * several),
            *(*rate_cells(r.pooled, names), percent(r.rank_one)),
        )
        for r in reports
    )
    return text_table([head, *rows])


def _format_intervals(report: RatesReport, intervals: ReportIntervals) -> str:
    """Return the lines of `RatesReport.as_text` with the intervals of the rates that have one."""
    rows = [(row.name, one) for row, one in zip(report.sets, intervals.sets, strict=True)]
    if len(rows) > 1:
        rows += [("mean", intervals.mean), ("pooled", intervals.pooled)]
    names = [n for n in INTERVAL_TITLES if any(getattr(one, n) is not None for _, one in rows)]
    cells = [(title, [one.of(name) for name in names]) for title, one in rows]
    known = all(row.scores.trials.fingers for row in report.sets)
    titles = [INTERVAL_TITLES[name] for name in names]
    return interval_table(titles, cells, "fingers" if known else "comparisons")


def _format_points(analysis: Analysis) -> str:
    """Return a line a database and FMR: the FNMR, its interval, and the threshold."""
    calibration = calibration_of(analysis.report.matcher)
    rows = [("FNMR at FMR", "", "FNMR", "95 % interval", "threshold", "score")]
    for p in analysis.distinct_points:
        threshold, score = "-", "-"
        if p.threshold is not None:
            threshold = f"{p.threshold:.6g}"
            score = f"{calibration.score(p.threshold):.1f}" if calibration else ""
        at = f"{100 * p.fmr:.6g} %", percent(p.fnmr), limits(p.interval, p.bound)
        rows.append((p.name, *at, threshold, score))
    return text_table(rows if calibration else [row[:-1] for row in rows])


def format_comparison(comparison: RunComparison, name: str) -> str:
    """Return the rates before, in the run `name`, and now, and the decisions that changed.

    The table has the EER of each database, then all rates of mean and pooled scores; of one
    database all its rates.
    """
    c = comparison
    by = f", by matcher {c.before}" if c.before not in {"", c.now, name} else ""
    lines = [
        f"{c.now} compared with {name}{by}: {c.pooled.pairs:,} pairs in both, "
        f"{c.identical:,} with the same similarity"
    ]
    cells = [
        (
            *(f"{one.name} {RATE_TITLES[d.rate]}", f"{one.pairs:,}"),
            *(percent(d.before), percent(d.now), points(d.now - d.before)),
            *(change_limits(d), d.verdict),
        )
        for one, differences in c.shown()
        for d in differences
    ]
    lines.append(text_table([(" ", "pairs", *c.titles(), "points", "95 % interval", ""), *cells]))
    if c.only_before or c.only_now:
        lines.append(
            f"left out: {c.only_before:,} pairs that only the earlier run compared, "
            f"{c.only_now:,} that only this one did"
        )
    if c.decisions is not None:
        lines.append(decisions_sentence(c.decisions))
        lines += _named("now matching", c.decisions.gained)
        lines += _named("no longer", c.decisions.lost)
    return "\n".join(lines)


def _named(label: str, pairs: Sequence[ChangedPair]) -> list[str]:
    lines = [f"  {label}: {p.set} {p.probe} {p.reference}" for p in pairs[:_PAIRS_NAMED]]
    rest = len(pairs) - _PAIRS_NAMED
    return [*lines, f"  {label}: {rest} more"] if rest > 0 else lines
