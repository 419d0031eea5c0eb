r"""Read files of scores: of fpmatch, or of any other matcher.

A file is CSV (comma, semicolon or tab) or Parquet. Its first line names the columns: ``probe`` and
``reference``, the names of the two prints; ``similarity`` or ``score``; and perhaps ``genuine`` (1
or 0), ``matcher`` and ``set``, the database. Other columns are not read. A row without a score is a
comparison that failed. Without a column ``genuine``, or where it is empty, the names of the prints
contain the finger: FFF_M is finger FFF, impression M.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import DatasetError
from fpmatch.gallery.batch.comparer import NO_TEMPLATE
from fpmatch.gallery.listing.csv_rows import csv_rows
from fpmatch.gallery.listing.entry import NamePattern
from fpmatch.gallery.listing.folders import natural_key
from fpmatch.lab.evaluation.rates.scores_set import ScoresSet, Trials, filled, unnamed_set

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    FingerOf = Callable[[str], str | None]

_PRINT_NAME: Final = re.compile(r"(\d+)_\d+(\.\w+)?", re.ASCII)
_LABELS: Final = {"1": True, "genuine": True, "0": False, "impostor": False}
_NO_SCORE: Final = frozenset({"", "nan", "na", "none", "null"})
_FORM: Final = (
    "the first line names the columns: probe, reference, similarity or score, perhaps genuine"
)
_NEEDS_PYARROW: Final = "Parquet needs pyarrow: pip install 'fpmatch[parquet]'"


def finger_in_name(pattern: str | None = None) -> FingerOf:
    """Return the function that finds the finger in the name of a print, None where there is none.

    `pattern` is as for `fpmatch.gallery.listing.entry.NamePattern`; by default prints are named
    FFF_M, and the finger is FFF without leading zeros.
    """
    if pattern is None:
        return _finger_of_fvc_name
    names = NamePattern(pattern)

    def finger_of(name: str) -> str | None:
        label = names.label(Path(name))
        return None if label is None else repr(label.of_finger)

    return finger_of


def _finger_of_fvc_name(name: str) -> str | None:
    parts = _PRINT_NAME.fullmatch(name)
    return None if parts is None else str(int(parts[1]))


def read_scores(
    path: str | os.PathLike[str],
    *,
    name: str | None = None,
    distances: bool = False,
    finger_of: Callable[[str, str], str | None] = lambda _, one: _finger_of_fvc_name(one),
) -> list[ScoresSet]:
    r"""Read a file of scores by matcher and database; this module describes the form.

    Comparisons of a print with itself are left out, and pairs that come in both orders count once
    if both have the same score. `name`: name of the database where there is no column ``set``
    (default: that of the file). `distances`: whether lower is more similar; the similarities are
    then the distances, negative. `finger_of`: returns the finger of a print from the names of its
    database and of the print, None where it is not known. Where the finger of any print is not
    known, that of none is: all rows must then state ``genuine``.
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
    rows = _rows_of(path)
    line, head = next(rows, (0, []))
    places = {str(cell).strip().casefold(): k for k, cell in enumerate(head)}
    score = next((places[one] for one in ("similarity", "score") if one in places), None)
    if score is None or not {"probe", "reference"} <= places.keys():
        raise DatasetError(f"line {line}: not a file of scores: {_FORM}", path=path)
    read = [places.get(one, -1) for one in ("matcher", "set", "probe", "reference")]
    beside = places.get("genuine", -1), places.get("reason", -1)
    by_set: dict[tuple[str, str], _Rows] = {}
    for line, row in rows:
        cells = [*row, *[""] * (len(head) - len(row)), ""]
        if len(row) > len(head):
            raise _error(path, line, f"{len(row)} columns instead of {len(head)}")
        matcher, of_set, probe, reference = (str(cells[k]) for k in read)
        genuine, reason = (str(cells[k]).strip().casefold() for k in beside)
        if not (probe and reference):
            raise _error(path, line, "no name of a print")
        if genuine and genuine not in _LABELS:
            raise _error(path, line, f"genuine must be 1 or 0, not {genuine!r}")
        value = math.nan if reason == NO_TEMPLATE else _number(path, line, cells[score])
        key = matcher, of_set or (Path(path).stem if name is None else name)
        by_set.setdefault(key, _Rows(path)).add(
            line, probe, reference, _LABELS.get(genuine), -value if distances else value
        )
    if not by_set:
        raise DatasetError("holds no comparison", path=path)
    return [
        rows.as_set(matcher, of_set, finger_of, distances=distances)
        for (matcher, of_set), rows in by_set.items()
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
        values = []
        for n, (line, row) in enumerate(_rows_of(path)):
            if n or _is_number(row[-1]):
                values.append(_number(path, line, row[-1]))
        if not values:
            raise DatasetError("holds no score", path=path)
        kinds.append(np.array(values) * (-1 if distances else 1))
    return unnamed_set(*kinds, distances=distances)


def choose_matcher(
    sets: Sequence[ScoresSet], matcher: str, path: str | os.PathLike[str]
) -> list[ScoresSet]:
    """Return the sets that a matcher, or an unknown one, scored; DatasetError if there are none."""
    chosen = [one for one in sets if one.matcher in {"", matcher}]
    if not chosen:
        others = ", ".join(sorted({one.matcher for one in sets}))
        raise DatasetError(f"{path}: holds scores of {others}, none of {matcher}")
    return chosen


@dataclass(slots=True)
class _Rows:
    """The rows of one database; prints are numbered as they come."""

    path: str | os.PathLike[str]
    prints: dict[str, int] = field(default_factory=dict)  # by name
    line: list[int] = field(default_factory=list)
    pairs: list[tuple[int, int]] = field(default_factory=list)
    genuine: list[bool | None] = field(default_factory=list)
    similarity: list[float] = field(default_factory=list)

    def add(
        self, line: int, probe: str, reference: str, genuine: bool | None, value: float
    ) -> None:
        number = self.prints.setdefault
        self.pairs.append((number(probe, len(self.prints)), number(reference, len(self.prints))))
        self.line.append(line)
        self.genuine.append(genuine)
        self.similarity.append(value)

    def as_set(
        self,
        matcher: str,
        name: str,
        finger_of: Callable[[str, str], str | None],
        *,
        distances: bool,
    ) -> ScoresSet:
        """Return the comparisons, each once; raise a DatasetError if they contradict each other."""
        probe, reference = np.array(self.pairs, np.intp).reshape(-1, 2).T
        similarity = np.array(self.similarity, np.float64)
        compared, similarity = np.isfinite(similarity), filled(similarity)
        fingers = [finger_of(name, one) for one in self.prints]
        kept = self._kept(probe, reference, similarity)
        if None in fingers:
            if None in self.genuine:
                k = self.genuine.index(None)
                why = (
                    "whether the pair is genuine is not known: there is no 1 or 0 in a column "
                    f"'genuine', and {self._named(k)} are not both named FFF_M"
                )
                raise _error(self.path, self.line[k], why)
            genuine = np.array(self.genuine, bool)
            trials = Trials.without_fingers(similarity[kept], genuine[kept])
        else:
            names = sorted({str(one) for one in fingers}, key=natural_key)
            number = {one: k for k, one in enumerate(names)}
            finger = np.array([number[str(one)] for one in fingers], np.intp)
            same = finger[probe] == finger[reference]
            stated = zip(self.genuine, same.tolist(), strict=True)
            wrong = [k for k, (one, by_name) in enumerate(stated) if one is (not by_name)]
            if wrong:
                are = "one finger" if same[wrong[0]] else "different fingers"
                why = f"genuine is {int(not same[wrong[0]])}, but by their names"
                why += f" {self._named(wrong[0])} are of {are} (--pattern finds fingers in names)"
                raise _error(self.path, self.line[wrong[0]], why)
            trials = Trials(
                similarity[kept], finger[probe[kept]], finger[reference[kept]], len(names)
            )
        return ScoresSet(
            matcher=matcher,
            name=name,
            prints=tuple(self.prints),
            probe=probe[kept],
            reference=reference[kept],
            trials=trials,
            compared=compared[kept],
            distances=distances,
        )

    def _kept(
        self, probe: NDArray[np.intp], reference: NDArray[np.intp], similarity: NDArray[np.float64]
    ) -> NDArray[np.intp]:
        """Return the rows that are kept: each pair once, none of a print with itself."""
        size = len(self.prints)
        ordered = probe * size + reference
        _, first, again = np.unique(ordered, return_index=True, return_inverse=True)
        differing = np.flatnonzero(similarity != similarity[first[again]])
        if differing.size:
            k = differing[0]
            earlier = self.line[first[again[k]]]
            why = f"{self._named(k)} are compared again, with another score than in line {earlier}"
            raise _error(self.path, self.line[k], why)
        either = np.minimum(probe, reference) * size + np.maximum(probe, reference)
        _, once, again = np.unique(either, return_index=True, return_inverse=True)
        if np.array_equal(similarity, similarity[once[again]]):  # the order does not matter
            first = once
        # a gallery names a print as its file, without extension
        stems = ((k, one.rpartition(".")[0]) for k, one in enumerate(self.prints))
        same = np.array([self.prints.get(stem, k) for k, stem in stems], np.intp)
        kept = np.sort(first)
        return np.asarray(kept[same[probe[kept]] != same[reference[kept]]], np.intp)

    def _named(self, row: int) -> str:
        names = list(self.prints)
        return " and ".join(repr(names[k]) for k in self.pairs[row])


def _error(path: str | os.PathLike[str], line: int, why: str) -> DatasetError:
    return DatasetError(f"line {line}: {why}", path=path, code="malformed row")


def _number(path: str | os.PathLike[str], line: int, cell: Any) -> float:
    """Return the number in a cell, NaN where there is none; infinite numbers are errors."""
    text = str(cell).strip().casefold()
    if text in _NO_SCORE:
        return math.nan
    if not _is_number(text) or math.isinf(float(text)):
        raise _error(path, line, f"{cell!r} is not a finite number")
    return float(text)


def _is_number(cell: Any) -> bool:
    try:
        float(str(cell))
    except ValueError:
        return False
    return "_" not in str(cell)  # which Python takes for a number


def _rows_of(path: str | os.PathLike[str]) -> Iterator[tuple[int, list[Any]]]:
    """Yield line number and cells of each row; blank lines and comments are left out."""
    if Path(path).suffix.lower() != ".parquet":
        yield from csv_rows(path, DatasetError, exact=True, comments=True)
        return
    try:
        from pyarrow import ArrowException, parquet  # noqa: PLC0415
    except ImportError as error:
        raise DatasetError(_NEEDS_PYARROW, path=path) from error
    try:
        table = parquet.read_table(path, page_checksum_verification=True)
    except (ArrowException, ValueError, OSError) as error:
        raise DatasetError("not a Parquet file of scores, or damaged", path=path) from error
    yield 1, table.column_names
    columns = [column.to_pylist() for column in table.columns]
    for line, row in enumerate(zip(*columns, strict=True), 2):
        yield line, ["" if cell is None else cell for cell in row]
