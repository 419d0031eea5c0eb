"""What commands print: results on stdout, notes and failures on stderr, all of it printable."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Final

import click

from fpmatch.printable import as_encodable, count, printable, printable_lines

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from fpmatch.prints.reading import GivenPrint

MOST_SHOWN: Final = 20


def first_of(things: Sequence[object]) -> str:
    """Return the first of some things, and how many others there are."""
    others = len(things) - 1
    return f"{things[0]} and {count(others, 'other')}" if others else str(things[0])


def show(text: str) -> None:
    """Print lines on stdout: the one place where results are printed."""
    click.echo(as_encodable(printable_lines(text)))


def show_line(text: object) -> None:
    """Print one line on stdout, whatever is in the names that it contains."""
    show(printable(text))


def say(text: object) -> None:
    """Print one line on stderr: the one place where messages are printed."""
    click.echo(as_encodable(f"fpmatch: {printable(text)}", sys.stderr), err=True)


def say_note(text: str) -> None:
    """Print one note on stderr."""
    say(f"note: {text}")


def say_slow_kernels() -> None:
    """Note before long work that kernels are not compiled, where that is so."""
    from fpmatch.base import kernels

    if note := kernels.slow_kernels_note():
        say_note(note)


def say_kernels() -> None:
    """Note that another copy than the current clone's runs, or that kernels are out of date."""
    from fpmatch.base import kernels

    if note := kernels.other_sources_note():
        say_note(note)
    if outdated := kernels.outdated_kernels():
        build = kernels.build_command()
        say_note(f"{count(len(outdated), 'kernel')} out of date: `{build}` compiles them")


def say_notes(noted: Mapping[str, Sequence[object]]) -> None:
    """Print each note once, with the first of the prints that it is about."""
    from fpmatch.prints.reading import UNKNOWN_DPI

    for note, prints in list(noted.items())[:MOST_SHOWN]:
        say_note(f"{first_of(prints)}: {note}{' (--dpi sets it)' * note.startswith(UNKNOWN_DPI)}")
    if len(noted) > MOST_SHOWN:
        say_note(f"{count(len(noted) - MOST_SHOWN, 'more note')} of other kinds")


def say_notes_on(prints: Iterable[GivenPrint], *, resolution: bool = False) -> None:
    """Print the notes on prints; with `resolution`, also where the ridges contradict theirs."""
    from fpmatch.prints.reading import group_by_note

    noted = {one.name: one.notes + one.doubted_resolution * resolution for one in prints}
    say_notes(group_by_note(noted.items()))


def say_errors(errors: Iterable[object]) -> None:
    """Print each error on stderr."""
    for error in errors:
        say(f"error: {error}")
