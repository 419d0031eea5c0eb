"""What commands on many prints print: failures and damage, notes as JSON, JSON line by line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fpmatch.cli.notes import MOST_SHOWN, say
from fpmatch.printable import json_text

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence


def say_failures(failures: Sequence[str], shown_by: str = "", *, word: str = "failed") -> None:
    """Print the first failures of a batch on stderr, and how many more there are."""
    for failure in failures[:MOST_SHOWN]:
        say(f"{word}: {failure}")
    if len(failures) > MOST_SHOWN:
        say(f"{word}: {len(failures) - MOST_SHOWN} more{shown_by}")


def say_damaged(gallery: str, damaged: Mapping[int, str]) -> None:
    """Name on stderr the damaged entries of a gallery, which were skipped, each once."""
    for number, why in list(damaged.items())[:MOST_SHOWN]:
        say(f"damaged: {gallery}: entry {number} is skipped: {why}")
    if len(damaged) > MOST_SHOWN:
        say(f"damaged: {len(damaged) - MOST_SHOWN} more; `fpmatch gallery check` lists all")


def notes_as_json(noted: Mapping[str, Sequence[object]]) -> list[dict[str, Any]]:
    """Return notes and all their prints as JSON values."""
    return [{"note": note, "prints": list(map(str, prints))} for note, prints in noted.items()]


def json_lines(rows: Iterable[dict[str, Any]]) -> Iterator[str]:
    """Yield a JSON array, one element a line, without holding it all."""
    yield "["
    before = None
    for row in rows:
        if before is not None:
            yield f"  {before},"
        before = json_text(row, indent=None)
    if before is not None:
        yield f"  {before}"
    yield "]"
