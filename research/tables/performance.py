"""Tables of the page on performance, and of the README."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from fpmatch.lab.evaluation.report.rate_text import percent
from research.markdown import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping

_TITLES: Final = {
    "extraction": "Stages of an extraction, 388 × 374 pixels at 500 dpi",
    "matching": "Before and after it",
    "process": "One `fpmatch verify` of two images",
}


def format_ratios(results: Mapping[str, Any]) -> str:
    """Return the measures of ``scripts/bench --json`` as a table."""
    body = [
        [
            row["name"],
            f"{row['value']:.3g} {row['unit']}",
            row["target"].replace(">=", "≥").replace("<=", "≤"),
            "yes" if row["ok"] else "**no**",
            row["ours"],
            row["yardstick"],
        ]
        for row in results["figures"]
    ]
    return markdown_table([["", "measured", "target", "met", "ours", "beside"], *body])


def format_stages(results: Mapping[str, Any]) -> str:
    """Return the times of the stages, before and now, in milliseconds, as a table for each part."""
    before, now = results["before"], results["now"]
    tables = []
    for part, title in _TITLES.items():
        body = [
            [name, *(_milliseconds(times[part].get(name)) for times in (before, now))]
            for name in dict.fromkeys([*before[part], *now[part]])
        ]
        if part != "matching":  # whose rows are not steps of one process
            sums = [_milliseconds(sum(times[part].values())) for times in (before, now)]
            body.append(["together", *sums])
        tables += [f"### {title}", markdown_table([["CPU time", "before", "now"], *body])]
    return "\n\n".join(tables)


def _milliseconds(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.2f} ms" if value < 10 else f"{value:.0f} ms"


def format_headline(results: Mapping[str, Any]) -> str:
    """Return the headline measures as a table: of fpmatch, and of another where one is measured."""
    learned, paper = results["learned"], results["paper"]
    speed = {row["name"]: row for row in results["figures"]}
    extraction, start = speed["extraction"], speed["cold start of verify"]
    comparison = speed["comparison of sample prints"]
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
        ["comparison of two extracted prints", comparison["ours"], comparison["yardstick"]],
    ]
    head = ["figure", "fpmatch", "for comparison"]
    return markdown_table([head, *([name, f"**{ours}**", other] for name, ours, other in rows)])
