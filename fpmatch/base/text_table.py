"""Tables as text: aligned columns for the terminal, Markdown, and HTML; numbers with nouns."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence


def count(number: int, noun: str, plural: str = "") -> str:
    """Return a number and its noun, in the plural (default: with an s) unless it is one."""
    return f"{number} {noun if number == 1 else plural or noun + 's'}"


def text_table(rows: Sequence[Sequence[str]], *, left: int = 1) -> str:
    """Return rows of cells as aligned columns, the first `left` of them to the left."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    align = [str.ljust if k < left else str.rjust for k in range(len(widths))]
    return "\n".join(
        "  ".join(put(cell, n) for put, cell, n in zip(align, row, widths, strict=True)).rstrip()
        for row in rows
    )


def markdown_table(rows: Sequence[Sequence[str]], *, left: int = 1) -> str:
    """Return rows of cells, the first of which is the head, as a table in Markdown."""
    head, *body = rows
    rule = ["---" if k < left else "---:" for k in range(len(head))]
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, rule, *body))


def html_table(rows: Sequence[Sequence[object]], *, left: int = 1, head: bool = False) -> str:
    """Return rows of cells as a table in HTML, escaped; with `head`, the first row is the head."""
    from html import escape  # noqa: PLC0415  (for notebooks only)

    def cells(row: Sequence[object], tag: str) -> str:
        style = (' style="text-align:left"' if k < left else "" for k in range(len(row)))
        put = (f"<{tag}{s}>{escape(str(cell))}</{tag}>" for s, cell in zip(style, row, strict=True))
        return f"<tr>{''.join(put)}</tr>"

    lines = (cells(row, "th" if head and not k else "td") for k, row in enumerate(rows))
    return f"<table>{''.join(lines)}</table>"
