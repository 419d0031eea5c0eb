"""Tables of searches of large galleries: bytes, time, mates lost."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fpmatch.lab.evaluation.report.rate_text import percent
from research.markdown import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping


def format_searching(results: Mapping[str, Any]) -> str:
    """Format what ``research/benchmarks/large_galleries.py --json`` wrote as Markdown tables."""
    return "\n\n".join(
        [
            _speed(results),
            _bytes(results),
            "### Mates that a search loses",
            _loss(results),
            "### Against comparing all",
            _exact(results),
        ]
    )


def _speed(results: Mapping[str, Any]) -> str:
    head = [
        *("prints", "wanted loss", "threshold", "passed on by the terms", "by the descriptors"),
        "a search, Delaunay calls",
        *("a search", "a print", "terms", "descriptors", "comparison", "time to open"),
    ]
    rows = [
        [
            _prints(s),
            f"{s['plan']['loss']:.1%}",
            _threshold(s["threshold"]),
            *(f"{s['plan'][name]:,}" for name in ("by_terms", "by_descriptors")),
            f"{s['calls']:,.0f}",
            f"{sum(s['ms'].values()):.0f} ms",
            f"{s['us_a_print']:.2f} µs",
            *(f"{s['ms'][name]:.1f} ms" for name in ("terms", "descriptors", "comparison")),
            f"{s['open_s']:.2f} s",
        ]
        for s in results["speed"]
    ]
    return markdown_table([head, *rows])


def _prints(row: Mapping[str, Any]) -> str:
    """Return the size of a gallery, and how many of its prints are different."""
    repeated = row["different"] < row["prints"]
    return f"{row['prints']:,}" + (f" ({row['different']:,} different)" if repeated else "")


def _threshold(least: float) -> str:
    return f"{least:g}" if least else "-"


def _bytes(results: Mapping[str, Any]) -> str:
    rows = [["prints", "bytes a print", "terms", "descriptors", "compact template"]]
    for s in {s["prints"]: s for s in results["speed"]}.values():
        sizes = [s["bytes"][name] for name in ("terms", "descriptors", "templates")]
        rows.append([f"{s['prints']:,}", *(f"{n:,.0f}" for n in (sum(sizes), *sizes))])
    return markdown_table(rows)


def _loss(results: Mapping[str, Any]) -> str:
    head = ["mates of", "gallery", "wanted loss", "threshold", "mates"]
    head += [
        "found if all are compared, at most",
        "lost by the terms",
        "lost in all",
        "penetration of the terms that finds 99%",
    ]
    rows = [
        [
            r["prints"],
            f"{r['gallery']:,}",
            f"{r['wanted']:.1%}",
            _threshold(r["threshold"]),
            *(str(r[key]) for key in ("mates", "found")),
            *(percent(r[key]) for key in ("lost_by_terms", "lost", "penetration_for_99_percent")),
        ]
        for r in results["loss"]
    ]
    return markdown_table([head, *rows])


def _exact(results: Mapping[str, Any]) -> str:
    head = ["mates of", "gallery", "mates", "found if all are compared", "lost of them"]
    head += ["counted as found above", "lost of them"]
    rows = [
        [
            r["prints"],
            f"{r['gallery']:,}",
            str(r["mates"]),
            *(str(r["found"]), percent(r["lost"])),
            *(str(b["found"]), percent(b["lost"])),
        ]
        for r, b in zip(results["exact"], results["bound"], strict=True)
    ]
    return markdown_table([head, *rows])
