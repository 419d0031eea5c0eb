"""Tables in Markdown, and generated blocks of a page, between comments."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fpmatch.base.output import atomic_write_bytes
from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path


def markdown_table(rows: Sequence[Sequence[str]], *, left: int = 1) -> str:
    """Return rows of cells, the first of which is the head, as a table in Markdown."""
    head, *body = rows
    rule = ["---" if k < left else "---:" for k in range(len(head))]
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, rule, *body))


def marked_block(page: str, mark: str) -> str | None:
    """Return what a page holds between its marks of a name; None where it has no such marks."""
    _, start, rest = page.partition(f"<!-- {mark}:start -->")
    block, end, _ = rest.partition(f"<!-- {mark}:end -->")
    return block.strip() if start and end else None


def write_marked_block(path: Path, mark: str, block: str) -> None:
    """Replace a block of a file, between its marks of that name."""
    page = path.read_text(encoding="utf-8")
    if marked_block(page, mark) is None:
        raise FpmatchError(f"{path}: has no block {mark}")
    start, end = f"<!-- {mark}:start -->", f"<!-- {mark}:end -->"
    before, _, rest = page.partition(start)
    page = f"{before}{start}\n\n{block.strip()}\n\n{end}{rest.partition(end)[2]}"
    atomic_write_bytes(path, page.encode("utf-8"), public=True)
