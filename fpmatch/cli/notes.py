"""Notes on stderr, and counts in sentences."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import click

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

NOTES_SHOWN: Final = 20


def count(number: int, noun: str) -> str:
    """Return a number and its noun, in the plural unless it is one.

    Examples
    --------
    >>> count(1, "subject"), count(2, "subject")
    ('1 subject', '2 subjects')
    """
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def first_of(things: Sequence[object]) -> str:
    """Return the first of some things, and how many others there are.

    Examples
    --------
    >>> first_of(["a.tif"]), first_of(["a.tif", "b.tif", "c.tif"])
    ('a.tif', 'a.tif and 2 others')
    """
    others = len(things) - 1
    return f"{things[0]} and {count(others, 'other')}" if others else str(things[0])


def say_note(text: str) -> None:
    """Print one note on stderr."""
    click.echo(f"fpmatch: note: {text}", err=True)


def say_notes(noted: Mapping[str, Sequence[object]]) -> None:
    """Print each note once, with the first of the prints that it is about."""
    from fpmatch.reading import ASSUMED_DPI

    for note, prints in list(noted.items())[:NOTES_SHOWN]:
        say_note(f"{first_of(prints)}: {note}{' (--dpi sets it)' * (note == ASSUMED_DPI)}")
    if len(noted) > NOTES_SHOWN:
        say_note(f"{len(noted) - NOTES_SHOWN} more notes of other kinds")


def notes_as_json(noted: Mapping[str, Sequence[object]]) -> list[dict[str, Any]]:
    """Return notes and all their prints as JSON values.

    Examples
    --------
    >>> notes_as_json({"ridges white on black": ["a.tif"]})
    [{'note': 'ridges white on black', 'prints': ['a.tif']}]
    """
    return [{"note": note, "prints": list(map(str, prints))} for note, prints in noted.items()]
