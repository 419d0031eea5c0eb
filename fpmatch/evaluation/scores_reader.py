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
from fpmatch.evaluation.bootstrap import Trials
from fpmatch.evaluation.comparison import NO_TEMPLATE
from fpmatch.evaluation.intervals import trials_of

if TYPE_CHECKING:
    import os

    from numpy.typing import NDArray

    from fpmatch.evaluation.report import EvaluationReport

NEEDED: Final = ("set", "probe", "reference", "genuine", "similarity")
_READ: Final = ("matcher", *NEEDED, "reason")  # in this order; those not needed may be missing
_PRINT_BITS: Final = 32  # enough to number prints
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
    finger: list[int] = field(default_factory=list)
    probe: array[int] = field(default_factory=lambda: array("q"))
    reference: array[int] = field(default_factory=lambda: array("q"))
    similarity: array[float] = field(default_factory=lambda: array("d"))
    compared: bytearray = field(default_factory=bytearray)
    seen: set[int] = field(default_factory=set)

    def add(self, probe: str, reference: str, genuine: str, similarity: str, reason: str) -> None:
        """Take a row; a ValueError says what is wrong with it."""
        i, j = self._number(probe), self._number(reference)
        if genuine not in {"0", "1"}:
            raise ValueError(f"genuine must be 0 or 1, not {genuine!r}")
        if (self.finger[i] == self.finger[j]) != (genuine == "1"):
            raise ValueError(f"genuine is {genuine}, which {probe} and {reference} are not by name")
        value = float(similarity)
        if not math.isfinite(value):
            raise ValueError("similarity must be a finite number")
        key = min(i, j) << _PRINT_BITS | max(i, j)
        if key in self.seen:
            raise ValueError(f"{probe} and {reference} are compared twice")
        self.seen.add(key)
        self.probe.append(i)
        self.reference.append(j)
        self.similarity.append(value)
        self.compared.append(reason != NO_TEMPLATE)

    def _number(self, name: str) -> int:
        number = self.index.get(name)
        if number is None:
            named = _PRINT_NAME.fullmatch(name)
            if named is None:
                raise ValueError(f"{name!r} is not named FFF_M (finger FFF, impression M)")
            number = self.index[name] = len(self.finger)
            self.finger.append(int(named[1]))
        return number


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
            reader = csv.reader(stream)
            head = next(reader, [])
            missing = [name for name in NEEDED if name not in head]
            if missing:
                raise DatasetError(
                    f"{path}: not a file of fpmatch evaluate --scores: no column {missing[0]!r}"
                )
            places = [head.index(name) if name in head else len(head) for name in _READ]
            for row in reader:
                if not row:
                    continue
                row.extend([""] * (len(head) + 1 - len(row)))
                matcher, name, *cells = (row[k] for k in places)
                try:
                    found.setdefault((matcher, name), _Columns()).add(*cells)
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


def _as_set(matcher: str, name: str, columns: _Columns) -> ScoresSet:
    fingers, number = np.unique(columns.finger, return_inverse=True)
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
