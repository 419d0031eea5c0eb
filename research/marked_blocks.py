"""Generated blocks of a page, between the comments ``MARK:start`` and ``MARK:end``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fpmatch.base.output import atomic_write_bytes
from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    from pathlib import Path


def marked_block(page: str, mark: str) -> str:
    """Return what a page holds between its marks of a name."""
    _, start, rest = page.partition(f"<!-- {mark}:start -->")
    block, end, _ = rest.partition(f"<!-- {mark}:end -->")
    if not start or not end:
        raise FpmatchError(f"the page has no marks {mark}:start and {mark}:end")
    return block.strip()


def replace_marked_block(page: str, mark: str, block: str) -> str:
    """Return the page with another block between its marks of that name."""
    marked_block(page, mark)
    start, end = f"<!-- {mark}:start -->", f"<!-- {mark}:end -->"
    before, _, rest = page.partition(start)
    return f"{before}{start}\n\n{block.strip()}\n\n{end}{rest.partition(end)[2]}"


def write_marked_block(path: Path, mark: str, block: str) -> None:
    """Replace a block of a file."""
    page = replace_marked_block(path.read_text(encoding="utf-8"), mark, block)
    atomic_write_bytes(path, page.encode("utf-8"), public=True)
