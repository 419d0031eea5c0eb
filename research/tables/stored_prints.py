"""Tables of what is stored of a print: bytes by part, error rates by form, times."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.lab.evaluation.report.rate_text import RATE_TITLES, percent
from research.markdown import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    Rows = Sequence[Mapping[str, Any]]

RATES: Final = ("eer", "fmr100", "fmr1000")
PARTS: Final = ("index", "descriptors", "template")
_SIDES: Final = {"one": "one side", "both": "both sides"}


def format_stored(results: Mapping[str, Any]) -> str:
    """Format what ``research/benchmarks/compact_templates.py --json`` wrote as Markdown tables."""
    tables = stored_parts(results["parts"]), stored_forms(results["forms"])
    return "\n\n".join([*tables, stored_times(results["times"])])


def stored_parts(rows: Rows) -> str:
    """Return the table of the bytes of a print by part, with a row of means."""
    names = (*PARTS, "gallery", "prepared")
    head = ["prints", "minutiae", *PARTS, "in all", "in the gallery's database", "prepared"]
    mean = {"name": "mean", **{k: np.mean([r[k] for r in rows]) for k in ("minutiae", *names)}}
    table = [
        [
            str(r["name"]),
            f"{r['minutiae']:.1f}",
            *(f"{r[part]:.0f}" for part in PARTS),
            f"{sum(r[part] for part in PARTS):.0f}",
            *(f"{r[part]:.0f}" for part in ("gallery", "prepared")),
        ]
        for r in (*rows, mean)
    ]
    return markdown_table([head, *table])


def stored_forms(rows: Rows) -> str:
    """Return the table of bytes and error rates of forms of templates."""
    titles = [f"{RATE_TITLES[rate]}, {side}" for side in _SIDES.values() for rate in RATES]
    table = [
        [
            str(r["form"]),
            "-" if r["bytes"] is None else f"{r['bytes']:.0f}",
            *(percent(r[side][rate]) for side in _SIDES for rate in RATES),
        ]
        for r in rows
    ]
    return markdown_table([["ridges of a template", "bytes", *titles], *table])


def stored_times(times: Mapping[str, Any]) -> str:
    """Return the table of times, also as shares of a Delaunay triangulation by scipy."""
    words = {
        "compact": "a template made compact",
        "expand": "a compact template expanded",
        "prepare": "a template prepared",
        "pack": "a prepared template packed",
        "prepare_compact": "a compact template prepared and packed, many at a time",
        "pack_descriptors": "bit descriptors packed",
        "prefilter": "bit descriptors of a print scored",
        "packed_prefilter": "packed bit descriptors of a print scored",
    }
    unit = times["delaunay"]
    table = [[what, f"{times[k]:.1f} µs", f"{times[k] / unit:.3f}"] for k, what in words.items()]
    other = [
        f"scores of packed descriptors that differ, of {times['scores']:,}",
        f"{times['other_scores']:,}",
        "",
    ]
    return markdown_table([["", "CPU time", "Delaunay calls"], *table, other])
