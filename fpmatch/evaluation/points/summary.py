"""What the results on random point sets come to, in a few lines."""

from __future__ import annotations

import math
from statistics import linear_regression, median
from typing import TYPE_CHECKING, Final

from fpmatch.evaluation.points.matchers import MATCHER_NAMES
from fpmatch.evaluation.points.places import places
from fpmatch.evaluation.points.published_results import PAPER_ROWS, TARGET_FACTORS
from fpmatch.pointset.random_sets import READINGS

if TYPE_CHECKING:
    from fpmatch.evaluation.points.places import Place
    from fpmatch.evaluation.points.results import BenchResults, PointCell
    from fpmatch.pointset.random_sets import PointModel

_FEWEST_SIZES: Final = 3
"""Sizes of sets from which on a power of growth is fitted."""


def summarise(results: BenchResults) -> list[str]:
    """Return a line a finding.

    Parameters
    ----------
    results : BenchResults
        The results.

    Returns
    -------
    list of str
        How much faster ours is than van Wamelen's, how its time compares with scipy's
        triangulations; average times, times on independent pairs, growth of the times with the
        sets, beside those that the paper gives; for each matcher and reading the worst recognition
        and the false matches; how far van Wamelen's matcher may search; what was not run.
    """
    lines = []
    for reading in READINGS:
        ratios = speed_ups(results, reading)
        if ratios:
            lines.append(
                f"ours over van-wamelen at n = 2m, {reading}: {geometric_mean(ratios):.1f} times "
                f"as fast (geometric mean of {len(ratios)} rows, {min(ratios):.1f} to "
                f"{max(ratios):.1f})"
            )
        lines += _over_triangulation(results, reading)
        lines += _averages(results, reading)
        lines += _independent(results, reading)
        lines += [line for name in MATCHER_NAMES for line in _growth(results, reading, name)]
    if results.cells:
        lines += _published()
    for reading in READINGS:
        for matcher in MATCHER_NAMES:
            lines += _answers(results, reading, matcher)
    return [*lines, *_bounds(results), *_not_run(results)]


def speed_ups(results: BenchResults, reading: PointModel, factor: int = 2) -> list[float]:
    """Return the time of van Wamelen's matcher over ours, where both ran.

    Parameters
    ----------
    results : BenchResults
        The results.
    reading : {"patch", "clutter"}
        The reading.
    factor : int
        Points of Q for each point of P.

    Returns
    -------
    list of float
        A ratio a row.
    """
    ratios = []
    for place in places([reading]):
        if place.factor == factor:
            ours, theirs = results.cell(place, "ours"), results.cell(place, "van-wamelen")
            if ours and theirs:
                ratios.append(theirs.time_ms / ours.time_ms)
    return ratios


def geometric_mean(values: list[float]) -> float:
    """Return the geometric mean of positive values.

    Examples
    --------
    >>> round(geometric_mean([2.0, 8.0]), 9)
    4.0
    """
    return math.exp(math.fsum(map(math.log, values)) / len(values))


def _over_triangulation(results: BenchResults, reading: PointModel) -> list[str]:
    """Return the range of our time over scipy's, for each ρ."""
    ratios: dict[float, list[float]] = {}
    for cell in results.cells:
        if (cell.matcher, cell.place.reading) == ("ours", reading):
            share = cell.time_ms / cell.scipy_delaunay_ms
            ratios.setdefault(cell.place.parameters.rho, []).append(share)
    if not ratios:
        return []
    words = [f"rho {rho:g}: {min(r):.2f} to {max(r):.2f}" for rho, r in sorted(ratios.items())]
    return [f"ours over scipy's two triangulations, {reading}: {', '.join(words)} times its time"]


def _averages(results: BenchResults, reading: PointModel) -> list[str]:
    """Return the mean over the rows at n = 2m of each matcher's average times."""
    words = []
    for matcher in MATCHER_NAMES:
        cells = [results.cell(place, matcher) for place in _at_2m(reading)]
        means = [cell.mean_ms for cell in cells if cell is not None and cell.mean_ms is not None]
        if len(means) == len(PAPER_ROWS):
            words.append(f"{matcher} {sum(means) / len(means):.3g} ms")
    return (
        [f"average time at n = 2m, {reading}, over all {len(PAPER_ROWS)} rows: {', '.join(words)}"]
        if words
        else []
    )


def _independent(results: BenchResults, reading: PointModel) -> list[str]:
    """Return how long ours takes to say no, beside its yes and beside the literal method's no."""
    ratios, slower, both = [], 0, 0
    for place in places([reading]):
        ours, literal = results.cell(place, "ours"), results.cell(place, "paper")
        if ours is not None:
            ratios.append(ours.independent_time_ms / ours.time_ms)
        if ours is not None and literal is not None:
            both += 1
            slower += ours.independent_time_ms > literal.independent_time_ms
    if not ratios:
        return []
    line = (
        f"ours on independent pairs, {reading}: {median(ratios):.1f} times the time of a genuine "
        f"pair (median of {len(ratios)} cells, {min(ratios):.1f} to {max(ratios):.1f})"
    )
    return [f"{line}; slower than the literal method in {slower} of {both} cells" if both else line]


def _growth(results: BenchResults, reading: PointModel, matcher: str) -> list[str]:
    """Return the powers of m with which a matcher's time grows at n = 2m, for each ρ."""
    times: dict[float, list[tuple[int, float]]] = {}
    for place in _at_2m(reading):
        cell = results.cell(place, matcher)
        if cell is not None:
            times.setdefault(place.parameters.rho, []).append((place.m, cell.time_ms))
    powers = _powers(times)
    return [f"{matcher}, {reading}, n = 2m: time grows as {powers}"] if powers else []


def _published() -> list[str]:
    """Return the same of the paper's two tables, and how far each depends on ρ."""
    lines = []
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
        lines.append(
            f"the paper's {name}, n = 2m: {1e3 * average:.4g} ms on average; time grows as "
            f"{_powers(times)}; at one m and n the times for different rho differ by a factor of "
            f"{spread:.3g} at most"
        )
    return lines


def _powers(times: dict[float, list[tuple[int, float]]]) -> str:
    """Return the powers of m that fit times best, by ρ; from three sizes on."""
    return ", ".join(
        f"m^{_power(rows):.2f} (rho {rho:g})"
        for rho, rows in sorted(times.items())
        if len(rows) >= _FEWEST_SIZES
    )


def _power(rows: list[tuple[int, float]]) -> float:
    """Return the slope of the least-squares line through log time over log m."""
    x, y = ([math.log(value) for value in column] for column in zip(*rows, strict=True))
    return linear_regression(x, y).slope


def _at_2m(reading: PointModel) -> list[Place]:
    return [place for place in places([reading]) if place.factor == TARGET_FACTORS[0]]


def _answers(results: BenchResults, reading: PointModel, matcher: str) -> list[str]:
    cells = [c for c in results.cells if (c.matcher, c.place.reading) == (matcher, reading)]
    if not cells:
        return []
    worst = min(cells, key=lambda cell: cell.recognised)
    right, trials = sum(c.right for c in cells), sum(c.trials for c in cells)
    false, independent = (
        sum(c.false_matches for c in cells),
        sum(c.independent_trials for c in cells),
    )
    stopped = sum(cell.stopped for cell in cells)
    return [
        f"{matcher}, {reading}: recognised {right:,} of {trials:,}, at worst {worst.right} of "
        f"{worst.trials} ({_shortly(worst)}); false matches {false:,} of {independent:,}"
        + (f"; stopped for taking too long {stopped}" if stopped else "")
    ]


def _shortly(cell: PointCell) -> str:
    return f"rho {cell.place.parameters.rho:g}, m {cell.place.m}, n {cell.place.n}"


def _not_run(results: BenchResults) -> list[str]:
    lines = []
    for reading in READINGS:
        for matcher in MATCHER_NAMES:
            count = sum(
                (cell.matcher, cell.place.reading) == (matcher, reading) for cell in results.skipped
            )
            if count:
                lines.append(
                    f"{matcher}, {reading}: {count} cells not run, for a match there or on "
                    f"smaller sets takes over {results.settings['budget_s']:g} s"
                )
    return lines


def _bounds(results: BenchResults) -> list[str]:
    """Return after how much work van Wamelen's matcher gave up, where that is known."""
    looks = [results.settings.get(f"{kind}_looks") for kind in ("genuine", "independent")]
    if None in looks or not any(cell.matcher == "van-wamelen" for cell in results.cells):
        return []
    return [
        f"van-wamelen gave up, without a match, after {looks[0]:,} looks at points on a genuine "
        f"pair and {looks[1]:,} on an independent one"
    ]
