"""The part of a documentation page that a script fills in, between two marks."""

from __future__ import annotations


def with_tables(page: str, tables: str, mark: str = "measured") -> str:
    """Return the page with other tables between its marks of that name."""
    start, end = f"<!-- {mark}:start -->", f"<!-- {mark}:end -->"
    before, _, rest = page.partition(start)
    _, _, after = rest.partition(end)
    return f"{before}{start}\n\n{tables.strip()}\n\n{end}{after}"
