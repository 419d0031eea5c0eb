"""What the results on random point sets come to, in a few lines."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from fpmatch.evaluation.points.matchers import MATCHER_NAMES
from fpmatch.evaluation.points.places import places
from fpmatch.pointset.random_sets import READINGS

if TYPE_CHECKING:
    from fpmatch.evaluation.points.results import BenchResults, PointCell
    from fpmatch.pointset.random_sets import Reading


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
        triangulations; for each matcher and reading the worst recognition and the false matches;
        how far van Wamelen's matcher may search; what was not run.
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
    for reading in READINGS:
        for matcher in MATCHER_NAMES:
            lines += _answers(results, reading, matcher)
    return [*lines, *_bounds(results), *_not_run(results)]


def speed_ups(results: BenchResults, reading: Reading, factor: int = 2) -> list[float]:
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


def _over_triangulation(results: BenchResults, reading: Reading) -> list[str]:
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


def _answers(results: BenchResults, reading: Reading, matcher: str) -> list[str]:
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
