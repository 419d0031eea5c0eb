"""`fpmatch gallery list`: what is enrolled, or could not be."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from fpmatch.gallery.entry import Entry, Failure


@click.command(
    "list",
    epilog="""\b
Columns: number, label (subject, finger and impression, joined by _), dpi, minutiae, picture.

\b
Examples:
  fpmatch gallery list prints.db
  fpmatch gallery list prints.db --subject 101 --json
  fpmatch gallery list prints.db --failures
""",
)
@click.argument("gallery")
@click.option("--subject", metavar="NAME", help="List the impressions of this subject only.")
@click.option("--failures", is_flag=True, help="List what could not be enrolled, and why.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON array.")
def gallery_list(gallery: str, subject: str | None, failures: bool, as_json: bool) -> None:
    """List what is enrolled in GALLERY, a file or the URL of a PostgreSQL database."""
    from fpmatch.gallery.gallery import open_gallery

    if failures and subject is not None:
        raise click.UsageError("--failures and --subject exclude each other")
    with open_gallery(gallery) as opened:
        if failures:
            found = opened.failures()
            rows: Iterable[dict[str, Any]] = map(asdict, found)
            lines: Iterable[str] = map(_failure_line, found)
        else:
            entries = opened.entries(subject=subject)
            rows, lines = (map(_as_dict, entries), map(_entry_line, entries))
        for line in _json_lines(rows) if as_json else lines:
            click.echo(line)


def _entry_line(entry: Entry) -> str:
    return (
        f"{entry.id:>6}  {entry.label!s:<16}  {entry.dpi:>5g}  {entry.minutiae:>3}  {entry.source}"
    )


def _failure_line(failure: Failure) -> str:
    return f"{failure.source}: {failure.reason}"


def _as_dict(entry: Entry) -> dict[str, Any]:
    return {
        "id": entry.id,
        **asdict(entry.label),
        "source": entry.source,
        "sha256": entry.content.hex(),
        "dpi": entry.dpi,
        "minutiae": entry.minutiae,
    }


def _json_lines(rows: Iterable[dict[str, Any]]) -> Iterator[str]:
    """Yield a JSON array, an element a line, without holding it all."""
    yield "["
    before = None
    for row in rows:
        if before is not None:
            yield f"  {before},"
        before = json.dumps(row, ensure_ascii=False)
    if before is not None:
        yield f"  {before}"
    yield "]"
