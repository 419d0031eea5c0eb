"""Tables of the index of large galleries: bytes, time, and mates lost by wanted loss."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fpmatch.evaluation.report.rate_text import percent
from fpmatch.text_table import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping


def format_indexing(results: Mapping[str, Any]) -> str:
    """Format what ``research/benchmarks/index_terms.py --json`` wrote as Markdown tables."""
    return "\n\n".join([_speed(results), _plans(results), _lost(results)])


def _speed(results: Mapping[str, Any]) -> str:
    rows = [["prints", "first stage", "Delaunay calls", "passed on", "compared"]]
    rows += [
        [
            f"{s['prints']:,}",
            f"{s['ms']:.1f} ms",
            f"{s['delaunay_calls']:,.0f}",
            *(f"{s[key]:,}" for key in ("passed_on", "compared")),
        ]
        for s in results["speed"]
    ]
    return markdown_table(rows)


def _plans(results: Mapping[str, Any]) -> str:
    rows = [["wanted loss", "prints", "budget", "passed on", "compared"]]
    for plans, gallery in zip(results["plans"], results["loss"][0]["galleries"], strict=True):
        for loss, (budget, by_terms, by_descriptors) in zip(results["losses"], plans, strict=True):
            counts = f"{by_terms:,}", f"{by_descriptors:,}"
            rows.append([f"{loss:.1%}", f"{gallery['prints']:,}", f"{budget:g}", *counts])
    return markdown_table(rows)


def _lost(results: Mapping[str, Any]) -> str:
    rows = [["mates of", "prints", "mates", "bytes a print"]]
    rows[0] += [f"lost at {loss:.1%}" for loss in results["losses"]]
    for found, size in zip(results["loss"], results["bytes"], strict=True):
        for g in found["galleries"]:
            row = [found["prints"], f"{g['prints']:,}", str(g["mates"]), f"{size['bytes']:.0f}"]
            rows.append(row + [f"{percent(one)} ({percent(both)})" for one, both in g["lost"]])
    return markdown_table(rows)
