"""Error rates and times as text."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from fpmatch.evaluation.rates import Rates

RATE_TITLES: Final = {
    "eer": "EER",
    "fmr100": "FMR100",
    "fmr1000": "FMR1000",
    "fmr10000": "FMR10000",
    "zero_fmr": "ZeroFMR",
    "zero_fnmr": "ZeroFNMR",
}


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
