"""Summary of the results on random point sets, in a few lines."""

from __future__ import annotations

import math
from itertools import product
from statistics import linear_regression, median
from typing import TYPE_CHECKING, Final

from research.points.conditions import PAPER_ROWS, TARGET_FACTORS, conditions
from research.points.matchers import MATCHER_NAMES
from research.points.random_sets import POINT_MODELS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from research.points.conditions import Condition
    from research.points.random_sets import PointModel
    from research.points.results import BenchResults

_FEWEST_SIZES: Final = 3  # of sets, from which on a power of growth is fitted


def summarise(results: BenchResults) -> list[str]:
    """Return the summary lines, first on times, then on answers."""
    lines = []
    for model in POINT_MODELS:
        if ratios := speed_ups(results, model):
            lines.append(
                f"triangles over van-wamelen at n = 2m, {model}: {geometric_mean(ratios):.1f} "
                f"times as fast (geometric mean of {len(ratios)} rows, {min(ratios):.1f} to "
                f"{max(ratios):.1f})"
            )
        lines += _over_triangulation(results, model)
        lines += _averages(results, model)
        lines += _independent(results, model)
        lines += [line for name in MATCHER_NAMES for line in _growth(results, model, name)]
    lines += _published() if results.cells else []
    for model, name in product(POINT_MODELS, MATCHER_NAMES):
        lines += _answers(results, model, name)
    return [*lines, *_bounds(results), *_not_run(results)]


def speed_ups(results: BenchResults, model: PointModel) -> list[float]:
    """Return, for each row that both ran, van Wamelen's time over the default matcher's."""
    pairs = (
        (results.cell(condition, "van-wamelen"), results.cell(condition, "triangles"))
        for condition in _at_2m(model)
    )
    return [
        baseline.time_ms / default.time_ms for baseline, default in pairs if baseline and default
    ]


def geometric_mean(values: list[float]) -> float:
    """Return the geometric mean of positive values."""
    return math.exp(math.fsum(map(math.log, values)) / len(values))


def _over_triangulation(results: BenchResults, model: PointModel) -> Iterator[str]:
    """Yield the range of the default matcher's time over scipy's, for each ρ."""
    ratios: dict[float, list[float]] = {}
    for cell in results.cells:
        if (cell.matcher, cell.condition.model) == ("triangles", model):
            share = cell.time_ms / cell.scipy_delaunay_ms
            ratios.setdefault(cell.condition.parameters.rho, []).append(share)
    if ratios:
        words = (f"rho {rho:g}: {min(r):.2f} to {max(r):.2f}" for rho, r in sorted(ratios.items()))
        ranges = ", ".join(words)
        yield f"triangles over scipy's two triangulations, {model}: {ranges} times its time"


def _averages(results: BenchResults, model: PointModel) -> Iterator[str]:
    """Yield the mean over the rows at n = 2m of each matcher's average times."""
    words = []
    for matcher in MATCHER_NAMES:
        cells = [results.cell(condition, matcher) for condition in _at_2m(model)]
        means = [cell.mean_ms for cell in cells if cell is not None and cell.mean_ms is not None]
        if len(means) == len(PAPER_ROWS):
            words.append(f"{matcher} {sum(means) / len(means):.3g} ms")
    if words:
        over = f"average time at n = 2m, {model}, over all {len(PAPER_ROWS)} rows"
        yield f"{over}: {', '.join(words)}"


def _independent(results: BenchResults, model: PointModel) -> Iterator[str]:
    """Compare times on independent pairs with those on genuine pairs and with the paper matcher."""
    every = [
        (default, results.cell(condition, "paper"))
        for condition in conditions([model])
        if (default := results.cell(condition, "triangles"))
    ]
    if every:
        ratios = [default.independent_time_ms / default.time_ms for default, _ in every]
        slower = [d.independent_time_ms > p.independent_time_ms for d, p in every if p]
        beside = f"; slower than the paper's method in {sum(slower)} of {len(slower)} cells"
        yield (
            f"triangles on independent pairs, {model}: {median(ratios):.1f} times the time of a "
            f"genuine pair (median of {len(ratios)} cells, {min(ratios):.1f} to {max(ratios):.1f})"
            f"{beside if slower else ''}"
        )


def _growth(results: BenchResults, model: PointModel, matcher: str) -> Iterator[str]:
    """Yield the powers of m with which a matcher's time grows at n = 2m, for each ρ."""
    times: dict[float, list[tuple[int, float]]] = {}
    for condition in _at_2m(model):
        if cell := results.cell(condition, matcher):
            times.setdefault(condition.parameters.rho, []).append((condition.m, cell.time_ms))
    if powers := _powers(times):
        yield f"{matcher}, {model}, n = 2m: time grows as {powers}"


def _published() -> Iterator[str]:
    """Yield the same of the paper's two tables, and how far each depends on ρ."""
    for name, published in (
        ("Table 1", [row.van_wamelen_s for row in PAPER_ROWS]),
        ("Table 2", [row.unit_circle_s for row in PAPER_ROWS]),
    ):
        times: dict[float, list[tuple[int, float]]] = {}
        at_size: dict[tuple[int, int], list[float]] = {}
        for row, columns in zip(PAPER_ROWS, published, strict=True):
            times.setdefault(row.rho, []).append((row.m, columns[0]))
            for factor, seconds in zip(TARGET_FACTORS, columns, strict=True):
                at_size.setdefault((row.m, factor), []).append(seconds)
        average = sum(columns[0] for columns in published) / len(PAPER_ROWS)
        spread = max(max(t) / min(t) for t in at_size.values())
        yield (
            f"the paper's {name}, n = 2m: {1e3 * average:.4g} ms on average; time grows as "
            f"{_powers(times)}; at one m and n the times for different rho differ by a factor of "
            f"{spread:.3g} at most"
        )


def _powers(times: dict[float, list[tuple[int, float]]]) -> str:
    """Return the powers of m that fit times best, by ρ; from three sizes on."""

    def power(rows: list[tuple[int, float]]) -> float:
        """Return the slope of the least-squares line through log time over log m."""
        x, y = ([math.log(value) for value in column] for column in zip(*rows, strict=True))
        return linear_regression(x, y).slope

    fitted = ((rho, rows) for rho, rows in sorted(times.items()) if len(rows) >= _FEWEST_SIZES)
    return ", ".join(f"m^{power(rows):.2f} (rho {rho:g})" for rho, rows in fitted)


def _at_2m(model: PointModel) -> list[Condition]:
    return [condition for condition in conditions([model]) if condition.factor == TARGET_FACTORS[0]]


def _answers(results: BenchResults, model: PointModel, matcher: str) -> Iterator[str]:
    """Yield what a matcher recognised, its worst condition and its false positives."""
    cells = [c for c in results.cells if (c.matcher, c.condition.model) == (matcher, model)]
    if cells:
        worst = min(cells, key=lambda cell: cell.true_positive_rate)
        at = worst.condition
        recognised, trials = sum(c.true_positives for c in cells), sum(c.trials for c in cells)
        false = sum(c.false_positives for c in cells)
        independent = sum(c.independent_trials for c in cells)
        stopped = sum(cell.stopped for cell in cells)
        yield (
            f"{matcher}, {model}: recognised {recognised:,} of {trials:,}, at worst "
            f"{worst.true_positives} of {worst.trials} (rho {at.parameters.rho:g}, m {at.m}, "
            f"n {at.n}); false positives {false:,} of {independent:,}"
        ) + (f"; stopped for taking too long {stopped}" if stopped else "")


def _bounds(results: BenchResults) -> Iterator[str]:
    """Yield the bounds of van Wamelen's search, where they are known."""
    steps = [results.settings.get(f"{kind}_steps") for kind in ("genuine", "independent")]
    if None not in steps and any(cell.matcher == "van-wamelen" for cell in results.cells):
        yield (
            f"van-wamelen gave up, without a match, after {steps[0]:,} points and cells visited on "
            f"a genuine pair and {steps[1]:,} on an independent one"
        )


def _not_run(results: BenchResults) -> Iterator[str]:
    keys = [(cell.condition.model, cell.matcher) for cell in results.skipped]
    for model, matcher in product(POINT_MODELS, MATCHER_NAMES):
        if count := keys.count((model, matcher)):
            yield (
                f"{matcher}, {model}: {count} cells not run, for a match there or on smaller sets "
                f"takes over {results.settings['budget_s']:g} s"
            )
