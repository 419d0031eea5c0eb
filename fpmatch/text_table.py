"""Tables as text: aligned columns for the terminal, and Markdown."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence


def text_table(rows: Sequence[Sequence[str]], *, left: int = 1) -> str:
    """Return rows of cells as columns two spaces apart, of which the first `left` are left-aligned.

    Examples
    --------
    >>> print(text_table([("set", "EER"), ("first", "1 %")]))
    set    EER
    first  1 %
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    align = [str.ljust if k < left else str.rjust for k in range(len(widths))]
    return "\n".join(
        "  ".join(put(cell, n) for put, cell, n in zip(align, row, widths, strict=True)).rstrip()
        for row in rows
    )


def markdown_table(rows: Sequence[Sequence[str]], *, left: int = 1) -> str:
    """Return rows of cells, the first of which is the head, as a table in Markdown.

    Examples
    --------
    >>> print(markdown_table([["", "EER"], ["one set", "1.2 %"]]))
    |  | EER |
    | --- | ---: |
    | one set | 1.2 % |
    """
    head, *body = rows
    rule = ["---" if k < left else "---:" for k in range(len(head))]
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, rule, *body))
