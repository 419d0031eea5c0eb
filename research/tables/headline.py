"""The headline measures of the README."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fpmatch.evaluation.rate_text import percent
from fpmatch.text_table import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping


def format_headline(results: Mapping[str, Any]) -> str:
    """Return the headline measures as a table: value, and what it is compared with."""
    learned, paper = results["learned"], results["paper"]
    speed = {row["name"]: row for row in results["figures"]}
    extraction, search = speed["extraction"], speed["comparison, 1:N"]
    rows = [
        ["figure", "measured", "beside it"],
        [
            f"equal error rate, mean of {len(learned['sets'])} FVC set B databases, all pairs",
            f"**{percent(learned['mean']['eer'])}**",
            f"the paper's method as printed: {percent(paper['mean']['eer'])}",
        ],
        [
            "extraction of one print, CPU time",
            f"**{extraction['ours']}**",
            extraction["yardstick"],
        ],
        ["comparison of one print with one of many", f"**{search['ours']}**", search["yardstick"]],
    ]
    return markdown_table(rows)
