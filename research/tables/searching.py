"""Tables of the page on large galleries: what a search costs, and its pre-selection error."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fpmatch.evaluation.rate_text import percent
from fpmatch.text_table import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping


def format_searching(results: Mapping[str, Any]) -> str:
    """Format the results of ``benchmarks/large_galleries.py --json`` as Markdown tables."""
    speed = [
        [
            *("prints", "encoding", "prefilter", "with a candidate list", "comparing all"),
            *("aligning all", "candidate list / aligning all", "bytes of descriptors"),
            "bytes of a print",
        ]
    ]
    speed += [
        [
            f"{t['prints']:,}",
            *(f"{t[key]:.2f} µs" for key in ("encoding_us", "prefilter_us", "search_us")),
            *(f"{t[key]:.1f} µs" for key in ("comparing_all_us", "aligning_all_us")),
            f"{t['share_of_time']:.3f}",
            *(f"{t[key]:.0f}" for key in ("descriptor_bytes", "print_bytes")),
        ]
        for t in results["speed"]
    ]
    share = results["penetration_rate"]
    recall = [
        [
            *("prints", "found by comparing all", f"found at a penetration rate of {share:.0%}"),
            *("at 2%", "penetration rate that finds 99%"),
        ]
    ]
    recall += [
        [
            *(str(r["prints"]), str(r["mates"])),
            *(percent(r[key]) for key in ("recall", "recall_2_percent", "share_for_99_percent")),
        ]
        for r in results["recall"]
    ]
    return f"{markdown_table(speed)}\n\n{markdown_table(recall)}"
