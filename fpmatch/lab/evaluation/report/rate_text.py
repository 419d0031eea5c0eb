"""Error rates, their intervals and times as text: for tables in a terminal and on pages."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from fpmatch.printable import text_table

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from fpmatch.lab.evaluation.rates.error_rates import Rates
    from fpmatch.lab.evaluation.rates.intervals import ExactBound, Interval
    from fpmatch.lab.evaluation.rates.run_comparison import DecisionChange, RateDifference

RATE_TITLES: Final = {
    "eer": "EER",
    "fmr100": "FMR100",
    "fmr1000": "FMR1000",
    "fmr10000": "FMR10000",
    "zero_fmr": "ZeroFMR",
    "zero_fnmr": "ZeroFNMR",
}
INTERVAL_TITLES: Final = {
    **{name: RATE_TITLES[name] for name in ("eer", "fmr100", "fmr1000", "fmr10000")},
    "rank_one": "rank-1",
}
_UNITS: Final = {
    "finger": "fingers",
    "subject": "subjects",
    "pair of fingers": "for the EER disjoint pairs of fingers",
    "comparison": "comparisons as if independent",
}
_LEAST_P: Final = 0.0001


def percent(rate: float | None) -> str:
    """Write a rate in percent, "-" where there is none."""
    return "-" if rate is None else f"{100 * rate:.2f} %"


def duration(value: float, digits: int, unit: str) -> str:
    """Write a time, "-" where nothing was timed."""
    return f"{value:.{digits}f} {unit}" if math.isfinite(value) else "-"


def decidability(rates: Rates) -> str:
    """Write d', "-" where there is none."""
    return "-" if rates.d_prime is None else f"{rates.d_prime:.2f}"


def rate_cells(rates: Rates, names: Sequence[str]) -> list[str]:
    """Write the rates of these names in percent."""
    return [percent(getattr(rates, name)) for name in names]


def defined_rates(rates: Iterable[Rates]) -> list[str]:
    """Return the names of the rates that are defined at least once."""
    every = list(rates)
    return [name for name in RATE_TITLES if any(getattr(r, name) is not None for r in every)]


def limits(interval: Interval | None, bound: ExactBound | None = None) -> str:
    """Write an interval in percent, "-" where there is none, and of a bound its trials.

    Examples
    --------
    >>> from fpmatch.lab.evaluation.rates.intervals import ExactBound, Interval
    >>> limits(Interval(0.01, 0.025)), limits(Interval(0.0, 0.2589), ExactBound("finger", 10))
    ('1.00 - 2.50 %', 'at most 25.89 % (0 of 10)')
    """
    if interval is None:
        return "-"
    if bound is None:
        return f"{100 * interval.low:.2f} - {100 * interval.high:.2f} %"
    if interval.low > 0:
        return f"at least {100 * interval.low:.2f} % ({bound.units} of {bound.units})"
    return f"at most {100 * interval.high:.2f} % (0 of {bound.units})"


def bounds_note(bounds: Iterable[ExactBound | None]) -> str:
    """Return the method of bounds and what they count, "" where there are no bounds."""
    units = {unit for one in bounds if one for unit in one.unit.split(" or ")}
    if not units:
        return ""
    counted = ", ".join(text for unit, text in _UNITS.items() if unit in units)
    return f"0 of n, n of n: 95 % bound by Clopper-Pearson, one-sided; n counts {counted}"


def points(difference: float) -> str:
    """Write a difference of rates in percentage points."""
    return f"{100 * difference:+.2f}"


def change_limits(difference: RateDifference) -> str:
    """Write the interval of a difference in percentage points, "-" where there is none."""
    interval, bound = difference.interval, difference.bound
    if interval is None:
        return "-"
    of = f" (0 of {bound.units})" if bound else ""
    return f"{points(interval.low)} to {points(interval.high)}{of}"


def interval_table(
    titles: Sequence[str],
    rows: Sequence[tuple[str, Sequence[tuple[Interval | None, ExactBound | None]]]],
    units: str,
) -> str:
    """Return the intervals of named rows as a table; without any, that there are too few `units`.

    Examples
    --------
    >>> from fpmatch.lab.evaluation.rates.intervals import Interval
    >>> print(interval_table(["EER"], [("DB1", [(Interval(0.01, 0.025), None)])], "fingers"))
    95 % intervals            EER
    DB1             1.00 - 2.50 %
    """
    cells = [(name, *(limits(*one) for one in row)) for name, row in rows]
    if all(cell == "-" for _, *row in cells for cell in row):
        return f"95 % intervals: none, there are too few {units}"
    return text_table([("95 % intervals", *titles), *cells])


def decisions_sentence(decisions: DecisionChange) -> str:
    """Return how many decisions changed, and the p-value of the change."""
    d = decisions
    counts = (
        f"at a false match rate of {100 * d.fmr:g} %, of {d.genuine:,} genuine pairs "
        f"{len(d.gained):,} match now and did not, {len(d.lost):,} did and do not"
    )
    if not d.gained and not d.lost:
        return counts
    p = f"= {d.mcnemar_p:.2g}" if d.mcnemar_p >= _LEAST_P else f"< {_LEAST_P:g}"
    return f"{counts} (McNemar's exact test: p {p})"
