"""Tables of the page on the quality of prints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fpmatch.lab.evaluation.rates.error_rates import POOLED
from fpmatch.printable import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping


def format_quality(results: Mapping[str, Any]) -> str:
    """Return the tables in Markdown, of each part what `curves_as_json` returned.

    They are the false non-match rates where the worst prints are discarded, and the quality of the
    prints.
    """
    return "\n\n".join(discard_tables(part) for part in results.values())


def discard_tables(results: Mapping[str, Any]) -> str:
    """Return the tables of one part."""
    head = ["discarded", *(f"{100 * share:.0f} %" for share in results["shares"])]
    rows = [
        [row["name"], *(_rate(*pair) for pair in zip(row["lost"], row["genuine"], strict=True))]
        for row in results["sets"]
    ]
    rows += [
        [f"{row['name']}: quality at least", *map(str, row["below"])]
        for row in results["sets"]
        if row["name"] == POOLED
    ]
    names = list(dict.fromkeys(name for row in results["sets"] for name in row["reasons"]))
    prints = [["", "prints", "quality: 5 %", "median", "95 %", *names]]
    for row in results["sets"]:
        counts = [str(row["reasons"].get(name, 0)) for name in names]
        quantiles = [f"{value:.0f}" for value in row["quality"]]
        prints.append([row["name"], str(row["prints"]), *quantiles, *counts])
    return f"{markdown_table([head, *rows])}\n\n{markdown_table(prints)}"


def _rate(lost: int, genuine: int) -> str:
    return f"{100 * lost / max(1, genuine):.2f} % ({lost} of {genuine:,})"
