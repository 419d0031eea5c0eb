"""Attacks: the promise that each tries, and what became of it."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from research.promises.program import Place

    # Of each try: true where the promise was kept, else what broke it.
    Tries = Iterator[bool | str]
    Function = Callable[[Place], Tries]

_LONGEST: Final = 300  # characters of an example


@dataclass(frozen=True)
class Outcome:
    """The number of tries of an attack, how many broke the promise, and the first of these.

    `promise` is how the row of ``docs/security.md`` begins. Where the promise cannot be tried,
    `name` is empty, and `attack` is the reason.
    """

    promise: str
    attack: str
    name: str
    tries: int = 0
    broken: int = 0
    example: str = ""
    seconds: float = 0.0


ATTACKS: Final[dict[str, Function]] = {}  # by the promise
NOT_TRIED: Final = {
    "No version with a known advisory": "`packaging/audit_dependencies` compares with the list",
    "Most templates joined from": "`python -m research measure joined` states how many are named",
    "No statistic of words": "`python -m research measure revocable` has many more statistics",
    "Prepared prints with right checksums": "the form of these files is not documented",
    "A clock that is set back": "it takes a computer whose clock may be set",
    "The container runs without privileges": "it takes a system of containers",
}


def attack(promise: str) -> Callable[[Function], Function]:
    """Register a function that attacks a promise; its docstring becomes a cell of the table."""

    def register(function: Function) -> Function:
        ATTACKS[promise] = function
        return function

    return register


def attempt(promise: str, function: Function, place: Place) -> Outcome:
    """Run an attack; an exception of its own counts as a broken promise."""
    tries, broken, start = 0, list[str](), time.monotonic()
    try:
        for result in function(place):
            tries += 1
            broken += [] if result is True else [str(result)]
    except Exception as error:  # noqa: BLE001 - the other attacks go on
        broken.append(f"the attack ended: {type(error).__name__}: {error}")
    first = broken[0].replace(f"{place.folder}/", "") if broken else ""
    example = " ".join(first.split())[:_LONGEST]
    what = " ".join((function.__doc__ or "").split()).rstrip(".")
    seconds = round(time.monotonic() - start, 1)
    return Outcome(promise, what, function.__name__, tries, len(broken), example, seconds)
