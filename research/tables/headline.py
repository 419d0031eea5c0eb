"""The headline measures of the README."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fpmatch.evaluation.report.rate_text import percent
from fpmatch.text_table import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping


def format_headline(results: Mapping[str, Any]) -> str:
    """Return the headline measures as a table: of fpmatch, and of another where one is measured."""
    learned, paper = results["learned"], results["paper"]
    speed = {row["name"]: row for row in results["figures"]}
    extraction, start = speed["extraction"], speed["cold start of verify"]
    rows = [
        [
            f"equal error rate, mean of {len(learned['sets'])} FVC set B databases, all pairs",
            percent(learned["mean"]["eer"]),
            f"the paper's method as printed: {percent(paper['mean']['eer'])}",
        ],
        [
            "`fpmatch verify` of two images, whole process",
            start["ours"],
            f"only importing numpy and OpenCV: {start['yardstick'].rpartition(': ')[2]}",
        ],
        ["extraction of one print", extraction["ours"], extraction["yardstick"]],
        ["comparison of two extracted prints, 1:1", speed["comparison, 1:1"]["ours"], ""],
        ["comparison with each print of a search, 1:N", speed["comparison, 1:N"]["ours"], ""],
    ]
    head = ["figure", "fpmatch", "for comparison"]
    return markdown_table([head, *([name, f"**{ours}**", other] for name, ours, other in rows)])
