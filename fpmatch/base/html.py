"""HTML: pages from templates of the package, and tables for notebooks."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from jinja2 import Environment


def page_templates(package: str) -> Environment:
    """Return the templates in the folder of a package; what they show is escaped."""
    from jinja2 import Environment, PackageLoader, StrictUndefined  # noqa: PLC0415

    return Environment(
        loader=PackageLoader(package, "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def html_table(rows: Sequence[Sequence[object]], *, left: int = 1) -> str:
    """Return rows of cells as a table in HTML, escaped, the first `left` to the left."""

    def cells(row: Sequence[object]) -> str:
        style = (' style="text-align:left"' if k < left else "" for k in range(len(row)))
        put = (f"<td{s}>{escape(str(cell))}</td>" for s, cell in zip(style, row, strict=True))
        return f"<tr>{''.join(put)}</tr>"

    return f"<table>{''.join(map(cells, rows))}</table>"
