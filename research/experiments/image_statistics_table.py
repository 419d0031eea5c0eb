"""Figures of prints as tables, for people: one a name, databases side by side."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from fpmatch.errors import DatasetError
from research.experiments.image_statistics import SHARES, STATISTICS, share_outside, span

if TYPE_CHECKING:
    from collections.abc import Sequence

    from research.experiments.image_statistics import DatabaseStatistics

    Cells = tuple[str, ...]

TITLES: Final = {
    "period_px": ("ridge period, px at 500 dpi", 2),
    "area_mm2": ("foreground, mm²", 0),
    "minutiae_per_mm2": ("minutiae a mm²", 3),
    "mean": ("mean grey", 0),
    "contrast": ("contrast (std of grey)", 1),
    "ridge_contrast": ("contrast in the foreground", 1),
    "foreground": ("foreground, share", 2),
}
"""What each name is called, and its decimals."""
_UNDEFINED: Final = "-"


def format_statistics(
    sets: Sequence[DatabaseStatistics], against: Sequence[DatabaseStatistics] = ()
) -> str:
    """Return a table a name: a row a database, a column a quantile.

    Parameters
    ----------
    sets : sequence of DatabaseStatistics
        The databases.
    against : sequence of DatabaseStatistics
        Others to hold them against: they follow in the same tables, then what they span, and of
        each of `sets` the share of prints that lie outside of it.

    Returns
    -------
    str
        Lines of equal columns.

    Raises
    ------
    DatasetError
        If there is no database.
    """
    if not sets:
        raise DatasetError("no database given")
    return "\n\n".join(_block(name, sets, against) for name in STATISTICS)


def statistics_as_json(
    sets: Sequence[DatabaseStatistics], against: Sequence[DatabaseStatistics] = ()
) -> dict[str, Any]:
    """Return the same figures as a document for JSON."""
    return {
        "shares": list(SHARES),
        "sets": [
            {
                **s.as_json(),
                "outside": {f: round(share_outside(s, against, f), 4) for f in STATISTICS},
            }
            if against
            else s.as_json()
            for s in sets
        ],
        "against": [s.as_json() for s in against],
    }


def _block(
    name: str, sets: Sequence[DatabaseStatistics], against: Sequence[DatabaseStatistics]
) -> str:
    title, digits = TITLES[name]
    head = (title, *(f"{100 * share:.0f} %" for share in SHARES))
    rows = [(s.name, *(_number(q, digits) for q in s.quantiles(name))) for s in sets]
    if against:
        head = (*head, "outside")
        rows = [
            (*row, _percent(share_outside(s, against, name)))
            for row, s in zip(rows, sets, strict=True)
        ]
        for other in against:
            rows.append((other.name, *(_number(q, digits) for q in other.quantiles(name)), ""))
        low, high = (_number(limit, digits) for limit in span(against, name))
        rows.append(("they span", low, "", "", "", high, ""))
    return _as_text([head, *rows])


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else _UNDEFINED


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if math.isfinite(share) else _UNDEFINED


def _as_text(rows: list[Cells]) -> str:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = (
        "  ".join(
            cell.rjust(width) if column else cell.ljust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    )
    return "\n".join(line.rstrip() for line in lines)
