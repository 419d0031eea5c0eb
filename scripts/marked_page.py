"""The part of a documentation page that a script fills in, between two marks."""

from __future__ import annotations

START, END = "<!-- measured:start -->", "<!-- measured:end -->"


def with_tables(page: str, tables: str) -> str:
    """Return the page with other tables between its marks."""
    before, _, rest = page.partition(START)
    _, _, after = rest.partition(END)
    return f"{before}{START}\n\n{tables.strip()}\n\n{END}{after}"
