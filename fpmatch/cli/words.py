"""Numbers in sentences."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence


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
