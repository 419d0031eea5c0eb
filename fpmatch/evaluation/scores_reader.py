"""Read the comparisons that an earlier evaluation wrote to a CSV file."""

from __future__ import annotations

import csv
import math
import re
from array import array
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import DatasetError
from fpmatch.evaluation.comparison import NO_TEMPLATE
from fpmatch.evaluation.intervals import trials_of
from fpmatch.evaluation.resampling import Trials

if TYPE_CHECKING:
    import os

    from numpy.typing import NDArray

    from fpmatch.evaluation.report import EvaluationReport

NEEDED: Final = ("set", "probe", "reference", "genuine", "similarity")
_PRINT_NAME: Final = re.compile(r"(\d+)_\d+(\.\w+)?", re.ASCII)


@dataclass(frozen=True, slots=True, eq=False)
class ScoresSet:
    """Hold the comparisons of one database by one matcher.

    Parameters
    ----------
    matcher : str
        The matcher; "" where the file does not say.
    name : str
        The database.
    prints : tuple of str
        Names of the images.
    probe, reference : ndarray of intp, shape (N,)
        Indices of the two images of each comparison.
    trials : Trials
        Similarities and fingers.
    compared : ndarray of bool, shape (N,)
        False where a side gave no template, which is no comparison but an error.
    """

    matcher: str
    name: str
    prints: tuple[str, ...]
    probe: NDArray[np.intp]
    reference: NDArray[np.intp]
    trials: Trials
    compared: NDArray[np.bool_]


@dataclass(slots=True)
class _Columns:
    """Gather the rows of one database in little space."""

    index: dict[str, int] = field(default_factory=dict)
    probe: array[int] = field(default_factory=lambda: array("q"))
    reference: array[int] = field(default_factory=lambda: array("q"))
    similarity: array[float] = field(default_factory=lambda: array("d"))
    compared: bytearray = field(default_factory=bytearray)
    seen: set[tuple[int, int]] = field(default_factory=set)

    def add(self, row: dict[str, str]) -> None:
        """Take a row; a ValueError says what is wrong with it."""
        a, b = row["probe"], row["reference"]
        if row["genuine"] not in {"0", "1"}:
            raise ValueError(f"genuine must be 0 or 1, not {row['genuine']!r}")
        if (_finger(a) == _finger(b)) != (row["genuine"] == "1"):
            raise ValueError(f"genuine is {row['genuine']}, which {a} and {b} are not by name")
        similarity = float(row["similarity"])
        if not math.isfinite(similarity):
            raise ValueError("similarity must be a finite number")
        i, j = (self.index.setdefault(name, len(self.index)) for name in (a, b))
        if (min(i, j), max(i, j)) in self.seen:
            raise ValueError(f"{a} and {b} are compared twice")
        self.seen.add((min(i, j), max(i, j)))
        self.probe.append(i)
        self.reference.append(j)
        self.similarity.append(similarity)
        self.compared.append(row.get("reason") != NO_TEMPLATE)


def read_scores(path: str | os.PathLike[str]) -> list[ScoresSet]:
    """Read what `fpmatch evaluate --scores` wrote.

    Parameters
    ----------
    path : path
        A CSV file with the columns `NEEDED`, and perhaps "matcher", "reason" and others; prints
        are named FFF_M, finger and impression.

    Returns
    -------
    list of ScoresSet
        One a matcher and database, in the order of the file.

    Raises
    ------
    DatasetError
        If the file is missing, no such table or empty; for a malformed row, with its line.
    """
    found: dict[tuple[str, str], _Columns] = {}
    try:
        with Path(path).open(newline="", encoding="utf-8") as stream:
            reader = csv.DictReader(stream, restval="")
            missing = [name for name in NEEDED if name not in (reader.fieldnames or ())]
            if missing:
                raise DatasetError(
                    f"{path}: not a file of fpmatch evaluate --scores: no column {missing[0]!r}"
                )
            for row in reader:
                key = (row.get("matcher") or "", row["set"])
                try:
                    found.setdefault(key, _Columns()).add(row)
                except ValueError as error:
                    raise DatasetError(f"{path}: line {reader.line_num}: {error}") from error
    except OSError as error:
        raise DatasetError(f"{path}: cannot be read: {(error.strerror or '').lower()}") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise DatasetError(f"{path}: not a CSV file of scores") from error
    if not found:
        raise DatasetError(f"{path}: holds no comparison")
    return [_as_set(*key, columns) for key, columns in found.items()]


def scores_of(report: EvaluationReport) -> list[ScoresSet]:
    """Return an evaluation's comparisons as `read_scores` would read them from its file.

    Parameters
    ----------
    report : EvaluationReport
        The evaluation.

    Returns
    -------
    list of ScoresSet
        One a database.
    """
    return [
        ScoresSet(
            matcher=report.matcher,
            name=row.name,
            prints=tuple(i.path.name for i in row.extracted.dataset.impressions),
            probe=row.pairs.probe,
            reference=row.pairs.reference,
            trials=trials_of(row),
            compared=row.outcomes["reason"] != NO_TEMPLATE,
        )
        for row in report.sets
    ]


def choose_matcher(
    sets: list[ScoresSet], matcher: str, path: str | os.PathLike[str]
) -> list[ScoresSet]:
    """Return the sets that a matcher scored; those of no named matcher count as its own.

    Parameters
    ----------
    sets : list of ScoresSet
        All of a file.
    matcher : str
        The matcher.
    path : path
        The file, for the message of an error.

    Returns
    -------
    list of ScoresSet
        Those of the matcher.

    Raises
    ------
    DatasetError
        If the file has none.
    """
    chosen = [one for one in sets if one.matcher in {"", matcher}]
    if not chosen:
        others = ", ".join(sorted({one.matcher for one in sets}))
        raise DatasetError(f"{path}: holds scores of {others}, none of {matcher}")
    return chosen


def _finger(name: str) -> int:
    named = _PRINT_NAME.fullmatch(name)
    if named is None:
        raise ValueError(f"{name!r} is not named FFF_M (finger FFF, impression M)")
    return int(named[1])


def _as_set(matcher: str, name: str, columns: _Columns) -> ScoresSet:
    fingers, number = np.unique([_finger(n) for n in columns.index], return_inverse=True)
    probe = np.frombuffer(columns.probe, np.int64).astype(np.intp)
    reference = np.frombuffer(columns.reference, np.int64).astype(np.intp)
    return ScoresSet(
        matcher=matcher,
        name=name,
        prints=tuple(columns.index),
        probe=probe,
        reference=reference,
        trials=Trials(
            similarity=np.frombuffer(columns.similarity, np.float64).copy(),
            probe=number[probe],
            reference=number[reference],
            fingers=int(fingers.size),
        ),
        compared=np.frombuffer(columns.compared, np.uint8).astype(bool),
    )
