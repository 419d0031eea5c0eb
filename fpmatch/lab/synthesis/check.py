"""Check the files of a finger of a database: whole, of the same plan, and the ones it names."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.base.output import reason
from fpmatch.base.parsing import ParseError, parse_json
from fpmatch.errors import OutputError
from fpmatch.lab.synthesis.truth_file import is_intact

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.lab.synthesis.plan import Plan

_LEAST_ALIKE: Final = 0.5  # share of its bytes that a damaged copy has in common with the original
_MOST_SHOWN: Final = 40  # characters of a value


def fault(files: list[Path], number: int, plan: Plan) -> str:
    """Return what is wrong with a finger's images and truth, all of which exist; "" for nothing.

    Raises OutputError if a file cannot be read.
    """
    *images, truth = files
    content = read(truth)
    try:
        document = parse_json(content)
        digests = {stem: entry["sha256"] for stem, entry in document["impressions"].items()}
        identity = _identity(document)
    except (ParseError, KeyError, TypeError, AttributeError):
        return f"{truth}: is damaged"
    if not is_intact(content):
        return f"{truth}: is damaged"
    for (name, value), (_, wanted) in zip(identity, _wanted(number, plan), strict=True):
        if value != wanted:
            return f"{truth}: is of {name} {_shown(value)}, not {_shown(wanted)}"
    for path in images:
        if hashlib.sha256(read(path)).hexdigest() != digests[path.stem]:
            return f"{path}: is damaged, or another image"
    return ""


def _identity(document: dict[str, Any]) -> list[tuple[str, object]]:
    """Return what a truth is of."""
    impressions = document["impressions"]
    return [
        ("finger", document["finger"]),
        ("seed", document["seed"]),
        ("impressions", list(impressions)),
        ("presets", [entry["preset"] for entry in impressions.values()]),
        ("sensors", [entry["sensor"] for entry in impressions.values()]),
    ]


def _wanted(number: int, plan: Plan) -> list[tuple[str, object]]:
    """Return what the truth of a finger of a plan is of."""
    each = range(1, plan.impressions + 1)
    return [
        ("finger", number),
        ("seed", plan.seed),
        ("impressions", [f"{number}_{m}" for m in each]),
        ("presets", [plan.ranges.name for _ in each]),
        ("sensors", [plan.sensor_of(m).name for m in each]),
    ]


def _shown(value: object) -> str:
    text = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
    return text if len(text) <= _MOST_SHOWN else f"{text[:_MOST_SHOWN]}…"


def is_damaged_copy(copy: bytes, original: bytes) -> bool:
    """Return whether bytes are those of a file that was cut short or partly overwritten."""
    if not any(copy):
        return True
    common = min(len(copy), len(original))
    a, b = (np.frombuffer(data, np.uint8, common) for data in (copy, original))
    return bool(np.count_nonzero(a == b) >= _LEAST_ALIKE * len(copy))


def read(path: Path) -> bytes:
    """Return the bytes of a file; raise OutputError if it cannot be read."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise OutputError(f"{path}: cannot be read: {reason(error)}") from error
