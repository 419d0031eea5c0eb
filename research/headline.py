"""The headline figures of the README, from the results behind the pages on accuracy and speed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from research.markdown import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping


def format_headline(accuracy: Mapping[str, Any], performance: Mapping[str, Any]) -> str:
    """Return the three headline figures as a table.

    Parameters
    ----------
    accuracy, performance : mapping
        Contents of ``docs/data/accuracy.json`` and ``docs/data/performance.json``.

    Returns
    -------
    str
        Markdown, a row a figure: value, what it is, and what it is compared with.
    """
    learned, paper = accuracy["learned"], accuracy["paper"]
    speed = {figure["name"]: figure for figure in performance["figures"]}
    extraction, search = speed["extraction"], speed["comparison, 1:N"]
    rows = [
        ["figure", "measured", "beside it"],
        [
            f"equal error rate, mean of {len(learned['sets'])} FVC set B databases, all pairs",
            f"**{100 * learned['mean']['eer']:.2f} %**",
            f"the paper's method as printed: {100 * paper['mean']['eer']:.2f} %",
        ],
        [
            "extraction of one print, CPU time",
            f"**{extraction['ours']}**",
            extraction["yardstick"],
        ],
        ["comparison of one print with one of many", f"**{search['ours']}**", search["yardstick"]],
    ]
    return markdown_table(rows)
