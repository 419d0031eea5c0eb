"""A comparison of two runs as text, for people."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.evaluation.table import RATE_TITLES, percent
from fpmatch.text_table import text_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.evaluation.run_comparison_result import (
        ChangedPair,
        DecisionChange,
        PairedComparison,
        PairedSet,
        RateDifference,
    )

_MOST_NAMED: Final = 5
_HEAD: Final = ("points", "95 % interval", "")


def format_paired(comparison: PairedComparison, name: str) -> str:
    """Return the rates before and now, and the decisions that changed.

    Parameters
    ----------
    comparison : PairedComparison
        The comparison.
    name : str
        What the earlier run is called.

    Returns
    -------
    str
        A table: EER of each database, then all rates of mean and pooled scores; below it the
        decisions on genuine pairs.
    """
    c = comparison
    by = f", by matcher {c.before}" if c.before not in {"", c.now, name} else ""
    lines = [
        f"{c.now} compared with {name}{by}: {c.pooled.pairs:,} pairs in both, "
        f"{c.alike:,} with the same similarity"
    ]
    cells: list[Sequence[str]] = [(" ", "pairs", *c.titles(), *_HEAD)]
    for one in c.sets:
        cells += _rows(one, one.changes[:1])
    for one in (c.mean, c.pooled):
        cells += _rows(one, one.changes)
    lines.append(text_table(cells))
    if c.only_before or c.only_now:
        lines.append(
            f"left out: {c.only_before:,} pairs that only the earlier run compared, "
            f"{c.only_now:,} that only this one did"
        )
    if c.decisions is not None:
        lines += _decision_lines(c.decisions)
    return "\n".join(lines)


def _rows(one: PairedSet, changes: Sequence[RateDifference]) -> list[Sequence[str]]:
    return [
        (
            f"{one.name} {RATE_TITLES[change.rate]}",
            f"{one.pairs:,}",
            percent(change.before),
            percent(change.now),
            points(change.now - change.before),
            _interval(change),
            change.verdict,
        )
        for change in changes
    ]


def points(difference: float) -> str:
    """Write a difference of rates in points of percent.

    Examples
    --------
    >>> points(-0.00123), points(0.0)
    ('-0.12', '+0.00')
    """
    return f"{100 * difference:+.2f}"


def _interval(change: RateDifference) -> str:
    if change.interval is None:
        return "-"
    return f"{points(change.interval.low)} to {points(change.interval.high)}"


def _decision_lines(decisions: DecisionChange) -> list[str]:
    return [
        decisions.in_words(),
        *_named("now matching", decisions.gained),
        *_named("no longer", decisions.lost),
    ]


def _named(label: str, pairs: Sequence[ChangedPair]) -> list[str]:
    rest = len(pairs) - _MOST_NAMED
    return [
        *(f"  {label}: {p.set_name} {p.probe} {p.reference}" for p in pairs[:_MOST_NAMED]),
        *([f"  {label}: {rest} more"] if rest > 0 else []),
    ]
