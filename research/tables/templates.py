"""Tables of the page on synthetic prints: templates made without images."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from fpmatch.lab.evaluation.report.rate_text import percent
from fpmatch.printable import markdown_table
from research.experiments.template_statistics import RATES, TITLES

if TYPE_CHECKING:
    from collections.abc import Mapping

_EXTREMES: Final = (0, 2, 4)  # of the quantiles: 5, 50 and 95 %


def format_templates(results: Mapping[str, Any]) -> str:
    """Return the tables in Markdown: minutiae and mates, then non-mates."""
    groups = results["groups"]
    rows = [["", *(group["name"] for group in groups)]]
    rows.append(["prints", *(str(group["prints"]) for group in groups)])
    for name, (title, digits) in TITLES.items():
        cells = []
        for group in groups:
            found = group["quantiles"].get(name)
            low, middle, high = (found[k] for k in _EXTREMES) if found else (0.0, 0.0, 0.0)
            shown = f"{middle:.{digits}f} ({low:.{digits}f}–{high:.{digits}f})"
            cells.append(shown if found else "-")
        rows.append([title, *cells])
    return f"{markdown_table(rows)}\n\n{_non_mates(results)}"


def _non_mates(results: Mapping[str, Any]) -> str:
    head = ["real probes with prints that are", "pairs"]
    head += ["similarity, median", "99 %", "99.9 %", "prefilter, median", "99 %", "99.9 %"]
    head += [f"FMR where that of real ones is {percent(rate)}" for rate in RATES]
    rows = [head]
    for r in results["non_mates"]:
        scores = [f"{r[name][k]:.2f}" for name in ("similarity", "prefilter") for k in (0, 2, 3)]
        rates = [f"{100 * rate:.3f} %" for rate in r["fmr"]]
        rows.append([r["gallery"], f"{r['pairs']:,}", *scores, *rates])
    return markdown_table(rows)
