"""Tables of the documentation."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence


def markdown_table(rows: Sequence[Sequence[str]]) -> str:
    """Return rows of cells, the first of which is the head, as a table in Markdown.

    Examples
    --------
    >>> print(markdown_table([["", "EER"], ["one set", "1.2 %"]]))
    |  | EER |
    | --- | ---: |
    | one set | 1.2 % |
    """
    head, *body = rows
    rule = ["---", *["---:"] * (len(head) - 1)]
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, rule, *body))
