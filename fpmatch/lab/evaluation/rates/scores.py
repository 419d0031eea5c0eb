r"""Scores of comparisons, read from files: of fpmatch, or of any other matcher.

A file is CSV (comma, semicolon or tab). Its first line names the columns: ``probe`` and
``reference``, the names of the two prints; ``similarity`` or ``score``; and perhaps ``genuine`` (1
or 0), ``matcher`` and ``set``, the database. Other columns are not read. A row without a score is a
comparison that failed. Without a column ``genuine``, or where it is empty, the names of the prints
contain the finger: FFF_M is finger FFF, impression M.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import DatasetError
from fpmatch.gallery.listing.csv_rows import csv_rows, row_error
from fpmatch.gallery.listing.entry import NamePattern
from fpmatch.gallery.listing.folders import natural_key

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    Numbers = NDArray[np.float64]
    FingerOf = Callable[[str], str | None]

_PRINT_NAME: Final = re.compile(r"(\d+)_\d+(\.\w+)?", re.ASCII)
_LABELS: Final = {"1": True, "genuine": True, "0": False, "impostor": False}
_NO_SCORE: Final = frozenset({"", "na", "none", "null"})
_FORM: Final = (
    "the first line names the columns: probe, reference, similarity or score, perhaps genuine"
)


@dataclass(frozen=True, slots=True, eq=False)
class Trials:
    """The comparisons of one database, its `name`: similarity and the two fingers, from 0 on.

    `fingers` is 0 where the fingers are not known; `probe` and `reference` are then the same number
    in genuine comparisons, different ones in impostor comparisons, and mean nothing else.
    """

    similarity: NDArray[np.float64]
    probe: NDArray[np.intp]
    reference: NDArray[np.intp]
    fingers: int
    name: str = ""

    @classmethod
    def without_fingers(cls, similarity: Numbers, genuine: NDArray[np.bool_]) -> Trials:
        """Return comparisons of which it is only known whether they are genuine."""
        return cls(similarity, np.zeros(genuine.size, np.intp), (~genuine).astype(np.intp), 0)

    @property
    def genuine(self) -> NDArray[np.bool_]:
        """Whether both prints show the same finger."""
        return np.asarray(self.probe == self.reference)


@dataclass(frozen=True, slots=True, eq=False)
class ScoresSet:
    """The comparisons of one database by one matcher ("" where it is not known).

    `matcher`, `name`: the matcher and the database. `prints`: names of the images; empty where they
    are not known. `probe`, `reference` (N,): indices into `prints`; shape (0,) where the names are
    not known. `trials`: similarities and fingers. `compared` (N,): False where a side has no
    template; the similarity is then the lowest. `distances`: whether the similarities are
    distances, taken negatively.
    """

    matcher: str
    name: str
    prints: tuple[str, ...]
    probe: NDArray[np.intp]
    reference: NDArray[np.intp]
    trials: Trials
    compared: NDArray[np.bool_]
    distances: bool = False

    @property
    def impostors(self) -> Trials:
        """The comparisons of different fingers, without prints that have no template."""
        t, kept = self.trials, ~self.trials.genuine & self.compared
        return Trials(t.similarity[kept], t.probe[kept], t.reference[kept], t.fingers, self.name)

    @property
    def never_compared(self) -> list[str]:
        """Names of the prints none of whose comparisons has a score: failures to extract."""
        alive = np.zeros(len(self.prints), bool)
        if self.prints:
            alive[self.probe[self.compared]] = alive[self.reference[self.compared]] = True
        return [name for name, is_alive in zip(self.prints, alive, strict=True) if not is_alive]


def split(sets: Sequence[Trials]) -> tuple[Numbers, Numbers]:
    """Return the similarities of genuine and of impostor comparisons of all databases.

    Rates are computed on them and not on scores: calibration keeps their order, but ties its ends.
    """
    similarity = np.concatenate([one.similarity for one in sets])
    genuine = np.concatenate([one.genuine for one in sets])
    return similarity[genuine], similarity[~genuine]


def unnamed_set(
    genuine: Numbers, impostor: Numbers, name: str = "scores", *, distances: bool = False
) -> ScoresSet:
    """Return scores whose prints and fingers are not known; NaN where a comparison failed."""
    similarity, nothing = np.concatenate([genuine, impostor]), np.empty(0, np.intp)
    kind = np.arange(similarity.size) < genuine.size
    trials = Trials.without_fingers(filled(similarity), kind)
    compared = np.isfinite(similarity)
    return ScoresSet("", name, (), nothing, nothing, trials, compared, distances)


def filled(similarity: Numbers) -> Numbers:
    """Return similarities; failed comparisons get the lowest of all, and not above 0."""
    failed = np.isnan(similarity)
    lowest = min(0.0, float(similarity[~failed].min(initial=0.0)))
    return np.where(failed, lowest, similarity)


def finger_in_name(pattern: str | None = None) -> FingerOf:
    """Return the function that finds the finger in the name of a print, None where there is none.

    `pattern` is as for `fpmatch.gallery.listing.entry.NamePattern`; by default prints are named
    FFF_M, and the finger is FFF without leading zeros.
    """
    names = None if pattern is None else NamePattern(pattern)

    def finger_of(name: str) -> str | None:
        if names is not None:
            label = names.label(Path(name))
            return None if label is None else repr(label.of_finger)
        parts = _PRINT_NAME.fullmatch(name)
        return None if parts is None else str(int(parts[1]))

    return finger_of


def read_scores(
    path: str | os.PathLike[str],
    *,
    name: str | None = None,
    distances: bool = False,
    finger_of: FingerOf = finger_in_name(),  # noqa: B008
) -> list[ScoresSet]:
    r"""Read a file of scores by matcher and database; this module describes the form.

    Comparisons of a print with itself are left out, and pairs that come in both orders count once
    if both have the same score. `name`: name of the database where there is no column ``set``
    (default: that of the file). `distances`: whether lower is more similar; the similarities are
    then the distances, negative. `finger_of`: returns the finger in the name of a print, None where
    it is not known. Where the finger of any print is not known, that of none is: all rows must then
    state ``genuine``.
    Raises a `DatasetError` if the file is missing, no file of scores, or empty; for a malformed
    row or one that contradicts the names or another row, with its line.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from fpmatch.lab.evaluation.rates.scores import read_scores
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "mine.csv")
    ...     _ = file.write_text("probe,reference,similarity\n1_1,2_1,0.5\n1_1,1_2,7\n")
    ...     (scores,) = read_scores(file)
    >>> scores.name, scores.prints, scores.trials.genuine.tolist()
    ('mine', ('1_1', '2_1', '1_2'), [False, True])
    """
    table = csv_rows(path, DatasetError, exact=True, comments=True)
    refused = partial(row_error, DatasetError, path)
    line, head = next(table, (1, []))
    names = [cell.strip().casefold() for cell in head]
    places = {cell: k for k, cell in enumerate(names)}
    score = next((places[one] for one in ("similarity", "score") if one in places), None)
    if score is None or not {"probe", "reference"} <= places.keys():
        raise DatasetError(f"line {line}: not a file of scores: {_FORM}", path=path)
    columns = "matcher", "set", "probe", "reference", "genuine"
    if twice := [one for one in (*columns, "similarity", "score") if names.count(one) > 1]:
        raise DatasetError(f"line {line}: two columns are named {twice[0]}", path=path)
    read = [places.get(one, -1) for one in columns]
    by_set: dict[tuple[str, str], list[Any]] = {}
    for line, row in table:
        cells = [*row, *[""] * (len(head) - len(row)), ""]
        if len(row) > len(head):
            raise refused(line, f"{len(row)} columns instead of {len(head)}")
        matcher, of_set, probe, reference, genuine = (cells[k] for k in read)
        genuine = genuine.strip().casefold()
        if not (probe and reference):
            raise refused(line, "no name of a print")
        if genuine and genuine not in _LABELS:
            raise refused(line, f"genuine must be 1 or 0, not {genuine!r}")
        value = _number(path, line, cells[score]) * (-1 if distances else 1)
        key = matcher, of_set or (Path(path).stem if name is None else name)
        by_set.setdefault(key, []).append((line, probe, reference, _LABELS.get(genuine), value))
    if not by_set:
        raise DatasetError("holds no comparison", path=path)
    return [
        _as_set(path, rows, finger_of, matcher=matcher, name=name, distances=distances)
        for (matcher, name), rows in by_set.items()
    ]


def read_genuine_and_impostor(
    genuine: str | os.PathLike[str], impostor: str | os.PathLike[str], *, distances: bool = False
) -> ScoresSet:
    """Read genuine scores from one file and impostor scores from another.

    The scores are in the last column; a first line may name the columns. Prints and fingers stay
    unknown. Raises a `DatasetError` if a file cannot be read, or has something else than scores.
    """
    kinds = []
    for path in (genuine, impostor):
        values, rows = [], csv_rows(path, DatasetError, exact=True, comments=True)
        for n, (line, row) in enumerate(rows):
            try:
                values.append(_number(path, line, row[-1]))
            except DatasetError:
                if n:
                    raise
        if not values:
            raise DatasetError("holds no score", path=path)
        kinds.append(np.array(values) * (-1 if distances else 1))
    return unnamed_set(kinds[0], kinds[1], distances=distances)


def choose_matcher(
    sets: Sequence[ScoresSet], matcher: str, path: str | os.PathLike[str]
) -> list[ScoresSet]:
    """Return the sets that a matcher, or an unknown one, scored; DatasetError if there are none."""
    chosen = [one for one in sets if one.matcher in {"", matcher}]
    if not chosen:
        others = ", ".join(sorted({one.matcher for one in sets}))
        raise DatasetError(f"{path}: holds scores of {others}, none of {matcher}")
    return chosen


def _as_set(
    path: str | os.PathLike[str],
    rows: Sequence[tuple[int, str, str, bool | None, float]],
    finger_of: Callable[[str], str | None],
    **about: Any,
) -> ScoresSet:
    """Return the comparisons of a database: line, names, label and score of each row.

    Raises a DatasetError if they contradict each other, or the names of the prints.
    """
    numbers = {name: k for k, name in enumerate(dict.fromkeys(n for row in rows for n in row[1:3]))}
    prints = tuple(numbers)
    probe = np.array([numbers[row[1]] for row in rows], np.intp)
    reference = np.array([numbers[row[2]] for row in rows], np.intp)
    similarity = np.array([row[4] for row in rows])
    compared, similarity = np.isfinite(similarity), filled(similarity)
    stated = np.array([-1 if row[3] is None else row[3] for row in rows], np.int8)

    def refuse(wrong: NDArray[np.intp], why: Callable[[Any], str]) -> None:
        if wrong.size:
            line, one, other, *_ = rows[wrong[0]]
            raise row_error(DatasetError, path, line, f"{one!r} and {other!r} {why(wrong[0])}")

    ordered = probe * len(prints) + reference
    _, first, again = np.unique(ordered, return_index=True, return_inverse=True)
    refuse(
        np.flatnonzero(similarity != similarity[first[again]]),
        lambda k: f"are compared again, with another score than in line {rows[first[again[k]]][0]}",
    )
    either = np.minimum(probe, reference) * len(prints) + np.maximum(probe, reference)
    _, once, again_either = np.unique(either, return_index=True, return_inverse=True)
    if np.array_equal(similarity, similarity[once[again_either]]):  # the order does not matter
        first = once
    kept = np.sort(first)
    # a gallery names a print as its file, without extension
    same = np.array([numbers.get(name.rpartition(".")[0], k) for k, name in enumerate(prints)])
    kept = kept[same[probe[kept]] != same[reference[kept]]]
    fingers = [finger_of(name) for name in prints]
    if None in fingers:
        refuse(
            np.flatnonzero(stated < 0),
            lambda _: (
                "are not both named FFF_M (finger, impression), and there is no 1 or 0 in a "
                "column 'genuine'"
            ),
        )
        trials = Trials.without_fingers(similarity[kept], stated[kept] == 1)
    else:
        names = sorted(set(map(str, fingers)), key=natural_key)
        place = {name: k for k, name in enumerate(names)}
        finger = np.array([place[str(one)] for one in fingers], np.intp)
        of_one = finger[probe] == finger[reference]
        refuse(
            np.flatnonzero((stated >= 0) & (stated != of_one)),
            lambda k: (
                f"are of {'one finger' if of_one[k] else 'different fingers'} by their names "
                f"(--pattern finds fingers in names), but genuine is {stated[k]}"
            ),
        )
        both = finger[probe[kept]], finger[reference[kept]]
        trials = Trials(similarity[kept], *both, len(names))
    of: dict[str, Any] = {"probe": probe[kept], "reference": reference[kept], **about}
    return ScoresSet(prints=prints, trials=trials, compared=compared[kept], **of)


def _number(path: str | os.PathLike[str], line: int, cell: str) -> float:
    """Return the number in a cell, NaN where there is none; infinite numbers are errors."""
    text = cell.strip().casefold()
    if text in _NO_SCORE:
        return math.nan
    try:
        value = float(text.replace("_", "?"))  # which Python takes for a number
    except ValueError:
        value = math.inf
    if math.isinf(value):
        raise row_error(DatasetError, path, line, f"{cell!r} is not a finite number")
    return value
