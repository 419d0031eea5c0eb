"""Work for the pool that goes wrong, or on for too long; its processes import it from here."""

import os
import sys
import time
from pathlib import Path

from fpmatch.errors import ImageError


def refuse(word: str) -> None:
    raise ImageError(f"{word}: no print")


def write_late(path: str) -> None:
    time.sleep(1.0)
    Path(path).touch()


def note_and_end(path: str) -> None:
    with Path(path).open("a") as file:
        file.write("begun\n")
    os._exit(3)


def end() -> None:
    os._exit(3)


def modules() -> set[str]:
    return set(sys.modules)
