"""What each part of the default matcher is worth, as a table of text and of the documentation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from research.markdown import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

KINDS = ("with ridges", "minutiae alone")


def format_ablation(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return the table of an ablation.

    Parameters
    ----------
    rows : sequence of mapping
        A row for each variant, the base first, as ``benchmarks/ablation.py --json`` writes them.

    Returns
    -------
    str
        Markdown, a table for the templates with ridges and one for their minutiae alone; rates and
        differences in percent.
    """
    parts = []
    for kind in KINDS:
        head = [
            kind,
            "mean EER / FMR1000",
            "pooled",
            "change of the mean EER",
            "change of the mean FMR1000",
            "identical scores",
        ]
        body = [[row["name"], *_cells(row[kind])] for row in rows]
        parts.append(markdown_table([head, *body]))
    return "\n\n".join(parts)


def _cells(found: Mapping[str, Any]) -> list[str]:
    return [
        *(
            f"{100 * found[k]['eer']:.2f} / {100 * found[k]['fmr1000']:.2f}"
            for k in ("mean", "pooled")
        ),
        *(_interval(found["change"][rate]) for rate in ("eer", "fmr1000")),
        f"{100 * found['identical']:.1f} %",
    ]


def _interval(change: Sequence[float] | None) -> str:
    """Return an interval of a difference, in percentage points."""
    if change is None:
        return "–"
    return f"{100 * change[0]:+.2f} to {100 * change[1]:+.2f}"
