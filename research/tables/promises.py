"""Table of the page on security: the attacks on each of its promises."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from research.markdown import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


def format_promises(outcomes: Sequence[Mapping[str, Any]]) -> str:
    """Format what ``python -m research promises --json`` wrote as a Markdown table."""
    rows = [["promise", "attack", "outcome", "tries"]]
    for one in outcomes:
        tried = "kept" if not one["broken"] else f"broken {one['broken']:,} times"
        cells = [one["attack"], tried] if one["name"] else ["-", f"not tried: {one['attack']}"]
        rows.append([one["promise"], *cells, f"{one['tries']:,}"])
    return markdown_table(rows, left=3)
