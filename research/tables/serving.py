"""Table of the page on the server: many requests at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fpmatch.text_table import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping


def format_serving(load: Mapping[str, Any]) -> str:
    """Format the results of ``benchmarks/serve_load.py --json`` as a Markdown table."""
    title = f"{load['requests']} requests of {load['clients']} clients at once"
    before, after = (f"{load[f'memory_{when}_mb']:.0f} MB" for when in ("before", "after"))
    rows = [
        [f"{title}, {load['workers']} worker processes", "measured"],
        [f"refused (status 503) within the wait of {load['wait_s']:g} s", str(load["refused"])],
        ["responses that differ from those to single requests", str(load["wrong"])],
        ["response to a single request, median", f"{load['alone_s']:.2f} s"],
        ["to one of these, median", f"{load['p50_s']:.1f} s"],
        ["to one of these, 95th percentile", f"{load['p95_s']:.1f} s"],
        ["memory of server and workers before and after them", f"{before}, {after}"],
    ]
    return markdown_table(rows)
