"""Findings of ``python -m research fuzz``: what went wrong, where, and with which input."""

from __future__ import annotations

import hashlib
import re
import traceback
from dataclasses import dataclass
from pathlib import Path

import fpmatch

_FRAME = re.compile(r'File "([^"]+)", line (\d+)')
_OURS = (Path(fpmatch.__file__).parent, Path(__file__).parent / "targets")  # package first
_NUMBERS = re.compile(r"0x[0-9a-f]+|\d+")
NOT_OURS = "in no file of fpmatch"


@dataclass
class Finding:
    """The first input that showed one kind of failure, and how often it was seen."""

    target: str  # name of the target
    data: bytes
    reason: str  # one line: what happened, and where
    details: str = ""  # the traceback, or the report of a sanitizer
    times: int = 0  # how many inputs showed it

    @property
    def kind(self) -> str:
        """What happened and where, equal for equal causes."""
        what, _, _ = self.reason.partition(": ")
        return _NUMBERS.sub("N", what) if ".py:" not in what else what

    def save(self, folder: Path) -> Path:
        """Write the input, and its details beside it; return the file of the input."""
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f"{self.target}-{hashlib.sha256(self.data).hexdigest()[:12]}.bin"
        path.write_bytes(self.data)
        path.with_suffix(".txt").write_text(
            f"{self.reason}\n\n{self.details}\n", "utf-8", "replace"
        )
        return path


def place_of(error: BaseException) -> str:
    """Return the last line of fpmatch's own code in the traceback of an error."""
    frames = traceback.extract_tb(error.__traceback__)
    return _place([(frame.filename, frame.lineno or 0) for frame in reversed(frames)])


def place_in_dump(dump: str) -> str:
    """Return the innermost line of fpmatch's own code in what faulthandler wrote."""
    return _place([(found[1], int(found[2])) for found in _FRAME.finditer(dump)])


def _place(frames: list[tuple[str, int]]) -> str:
    """Name the first of some frames, innermost first, that is in our code."""
    for folder in _OURS:
        for file, line in frames:
            if Path(file).is_relative_to(folder):
                return f"in {Path(file).name}:{line}"
    return NOT_OURS
