r"""Read files of scores: of fpmatch, or of any other matcher.

Which pairs are genuine is known from the column ``genuine``; where that is missing or empty, from
the columns of fingers or else from the names of the prints, FFF_M: finger FFF, impression M.
Fingers are what genuine pairs join, so that any names will do.
"""

from __future__ import annotations

import math
import re
from array import array
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import DatasetError
from fpmatch.gallery.batch.comparer import NO_TEMPLATE
from fpmatch.gallery.batch.score_file import LABELS, ScoreTable, open_table
from fpmatch.lab.evaluation.rates.scores_set import ScoresSet, Trials, filled, unnamed_set

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

_READ: Final = (
    *("matcher", "set", "probe", "reference", "probe_finger", "reference_finger", "genuine"),
    *("reason", "overlap", "probe_quality", "reference_quality"),
)
SIDES: Final = ("probe", "reference")
_PRINT_NAME: Final = re.compile(r"(\d+)_\d+(\.\w+)?", re.ASCII)
_UNKNOWN: Final = -1


def finger_of_fvc_name(name: str) -> str | None:
    """Return the finger of a print named FFF_M, without leading zeros; None for other names."""
    parts = _PRINT_NAME.fullmatch(name)
    return None if parts is None else str(int(parts[1]))


def read_scores(
    path: str | os.PathLike[str],
    *,
    name: str | None = None,
    distances: bool = False,
    finger_of: Callable[[str], str | None] = finger_of_fvc_name,
) -> list[ScoresSet]:
    r"""Read a file of scores by matcher and database; docs/reference/results.md has the formats.

    Comparisons of a print with itself are left out, and pairs that come in both orders count once
    if both have the same score. `path`: CSV, columns separated by spaces or tabs, or Parquet; with
    or without names of columns. `name`: name of the database where there is no column ``set``
    (default: that of the file). `distances`: whether lower is more similar; the similarities are
    then the distances, negative. `finger_of`: returns the finger in the name of a print, None where
    it contains none. Raises a `DatasetError` if the file is missing, no file of scores, or empty;
    for a malformed row, with its line and column.

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
    name = Path(path).stem if name is None else name
    table = open_table(path)
    if {"genuine", "impostor"} <= set(table.places):
        kinds = _scores_in(table, ("genuine", "impostor"), distances=distances)
        return [unnamed_set(*kinds, name=name, distances=distances)]
    role = _score_column(table, distances=distances)
    by_set: dict[tuple[str, str], ScoreRows] = {}
    for line, cells in table.cells([*_READ, role]):
        key = str(cells[0]), str(cells[1]) or name
        if key not in by_set:
            by_set[key] = ScoreRows(table, role, finger_of)
        by_set[key].add(line, *cells[2:])
    if not by_set:
        raise DatasetError("holds no comparison", path=path)
    sets = [rows.as_set(*key, distances=distances) for key, rows in by_set.items()]
    return [replace(one, note=table.note) for one in sets]


def read_genuine_and_impostor(
    genuine: str | os.PathLike[str], impostor: str | os.PathLike[str], *, distances: bool = False
) -> ScoresSet:
    """Read genuine scores from one file and impostor scores from another, as PyEER takes them.

    The scores are in the last column, unless a first line names the columns. Prints and fingers
    stay unknown. Errors are those of `read_scores`.
    """
    kinds = []
    for path in (genuine, impostor):
        table = open_table(path, last=True)
        role = _score_column(table, distances=distances)
        kinds += _scores_in(table, [role], distances=distances)
    return unnamed_set(*kinds, name="scores", distances=distances)


def choose_matcher(
    sets: list[ScoresSet], matcher: str, path: str | os.PathLike[str]
) -> list[ScoresSet]:
    """Return the sets that a matcher, or an unknown one, scored; DatasetError if there are none."""
    chosen = [one for one in sets if one.matcher in {"", matcher}]
    if not chosen:
        others = ", ".join(sorted({one.matcher for one in sets}))
        raise DatasetError(f"{path}: holds scores of {others}, none of {matcher}")
    return chosen


def _score_column(table: ScoreTable, *, distances: bool) -> str:
    """Return the column of scores; raise a DatasetError if distances must be declared."""
    if distances and "distance" in table.places:
        return "distance"
    if "similarity" in table.places:
        return "similarity"
    if "distance" not in table.places:
        raise DatasetError(
            "no column 'similarity', 'score' or 'distance', but several kinds of scores",
            path=table.path,
        )
    message = "distances, of which lower ones are more similar, need --distances"
    raise DatasetError(f"{table.column('distance')}: {message}", path=table.path)


def _scores_in(
    table: ScoreTable, roles: Sequence[str], *, distances: bool
) -> list[NDArray[np.float64]]:
    """Return the scores in some columns, without empty cells; NaN where a comparison failed."""
    columns: list[array[float]] = [array("d") for _ in roles]
    for line, cells in table.cells(roles):
        for values, role, cell in zip(columns, roles, cells, strict=True):
            if cell != "":
                values.append(table.number(role, line, cell))
    arrays = [np.array(values, np.float64) for values in columns]
    return [-values if distances else values for values in arrays]


@dataclass(slots=True)
class ScoreRows:
    """The rows of one database, gathered in little space and checked.

    A node is a print or, where prints have no names, a finger.
    """

    table: ScoreTable
    score: str  # the column of scores
    finger_of: Callable[[str], str | None]
    node: dict[str, int] = field(default_factory=dict)  # by name
    finger: dict[int, str] = field(default_factory=dict)  # of nodes, where the file has it
    quality: dict[int, float] = field(default_factory=dict)
    line: array[int] = field(default_factory=lambda: array("q"))
    probe: array[int] = field(default_factory=lambda: array("q"))
    reference: array[int] = field(default_factory=lambda: array("q"))
    genuine: array[int] = field(default_factory=lambda: array("b"))
    similarity: array[float] = field(default_factory=lambda: array("d"))
    overlap: array[float] = field(default_factory=lambda: array("d"))

    @property
    def named(self) -> bool:
        """Whether the prints have names."""
        return self.table.places.keys() >= {"probe", "reference"}

    def add(self, line: int, *cells: Any) -> None:
        """Add a row; raise a DatasetError if it is malformed."""
        *names, finger_1, finger_2, genuine, reason, overlap, quality_1, quality_2, score = cells
        fingers = finger_1, finger_2
        sides = zip(SIDES, names if self.named else fingers, fingers, strict=True)
        probe, reference = (self._number(line, *side) for side in sides)
        for side, node, cell in zip(SIDES, (probe, reference), (quality_1, quality_2), strict=True):
            if cell != "" and node not in self.quality:
                self.quality[node] = self.table.number(f"{side}_quality", line, cell)
        kind = str(genuine).strip().casefold()
        if kind and kind not in LABELS:
            what = f"must be 1 or 0, not {genuine!r}"
            raise self._error(f"line {line}, {self.table.column('genuine')}: {what}")
        if reason == NO_TEMPLATE:
            score = ""
        self.line.append(line)
        self.probe.append(probe)
        self.reference.append(reference)
        self.genuine.append(int(LABELS[kind]) if kind else _UNKNOWN)
        self.similarity.append(self.table.number(self.score, line, score))
        self.overlap.append(self.table.number("overlap", line, overlap))

    def _number(self, line: int, side: str, name: Any, finger: Any) -> int:
        """Return the number of a print; raise a DatasetError if it is of two fingers."""
        name, finger = str(name), str(finger)
        if self.named and not name:
            raise self._error(f"line {line}, {self.table.column(side)}: no name of a print")
        node = self.node.setdefault(name, len(self.node))
        if finger and self.finger.setdefault(node, finger) != finger:
            what = f"{name!r} is of finger {finger!r}, and in an earlier row {self.finger[node]!r}"
            raise self._error(f"line {line}, {self.table.column(f'{side}_finger')}: {what}")
        return node

    def _error(self, message: str) -> DatasetError:
        return DatasetError(message, path=self.table.path)

    def as_set(self, matcher: str, name: str, *, distances: bool) -> ScoresSet:
        """Return the comparisons, each once; raise a DatasetError if they contradict each other."""
        similarity = np.frombuffer(self.similarity, np.float64)
        similarity = -similarity if distances else similarity
        genuine = np.frombuffer(self.genuine, np.int8)
        if not self.named and not self.finger:
            self._require_known(genuine == _UNKNOWN)
            kinds = (similarity[genuine == kind] for kind in (1, 0))
            return unnamed_set(*kinds, matcher=matcher, name=name, distances=distances)
        probe = np.frombuffer(self.probe, np.int64).astype(np.intp)
        reference = np.frombuffer(self.reference, np.int64).astype(np.intp)
        finger = self._fingers(probe, reference, genuine)
        compared, lowered = np.isfinite(similarity), filled(similarity)
        kept = self._kept(probe, reference, lowered) if self.named else np.arange(probe.size)
        probe, reference = probe[kept], reference[kept]
        known = np.unique(finger[np.concatenate([probe, reference])])
        finger = np.searchsorted(known, finger)
        trials = Trials(lowered[kept], finger[probe], finger[reference], int(known.size))
        overlap = np.where(compared, np.frombuffer(self.overlap, np.float64), np.nan)[kept]
        nothing = np.empty(0, np.intp)
        return ScoresSet(
            matcher=matcher,
            name=name,
            prints=tuple(self.node) if self.named else (),
            probe=probe if self.named else nothing,
            reference=reference if self.named else nothing,
            trials=trials,
            compared=compared[kept],
            quality=self._qualities() if self.named else None,
            overlap=overlap if np.isfinite(overlap).any() else None,
            distances=distances,
        )

    def _fingers(
        self, probe: NDArray[np.intp], reference: NDArray[np.intp], genuine: NDArray[np.int8]
    ) -> NDArray[np.intp]:
        """Return a number for the finger of each node; genuine pairs are of one finger."""
        from scipy.sparse import coo_array  # noqa: PLC0415
        from scipy.sparse.csgraph import connected_components  # noqa: PLC0415

        names, unknown = list(self.node), genuine == _UNKNOWN
        by_name = [self.finger_of(name) for name in names] if self.named else [None] * len(names)
        if unknown.any() and not self.finger:
            self.finger |= {k: one for k, one in enumerate(by_name) if one is not None}
        labelled = np.zeros(len(names), bool)
        labelled[list(self.finger)] = True
        self._require_known(unknown & ~(labelled[probe] & labelled[reference]))
        first: dict[str, int] = {}
        links = [(k, first.setdefault(one, k)) for k, one in self.finger.items()]
        joined = np.array(links, np.intp).reshape(-1, 2).T
        rows = np.concatenate([probe[genuine == 1], joined[0]])
        columns = np.concatenate([reference[genuine == 1], joined[1]])
        graph = coo_array((np.ones(rows.size), (rows, columns)), shape=(len(names), len(names)))
        finger: NDArray[Any] = connected_components(graph, directed=False)[1]
        wrong = np.flatnonzero((genuine == 0) & (finger[probe] == finger[reference]))
        if wrong.size:
            k = wrong[0]
            pair = f"{names[probe[k]]} and {names[reference[k]]}"
            what = f"genuine is 0, but by the names or other rows {pair} are of one finger"
            raise self._error(f"line {self.line[k]}: {what}")
        numbers = [one for one in by_name if one is not None and one.isdecimal()]
        if len(numbers) == len(names):  # as the fingers of an evaluation are numbered
            lowest = np.full(int(finger.max()) + 1, np.inf)
            np.minimum.at(lowest, finger, np.array(list(map(float, numbers))))
            finger = np.argsort(np.argsort(lowest, kind="stable"))[finger]
        return np.asarray(finger, np.intp)

    def _require_known(self, unknown: NDArray[np.bool_]) -> None:
        """Raise a DatasetError if it is not known whether some pairs are genuine."""
        if unknown.any():
            k = int(np.argmax(unknown))
            what = "whether the pair is genuine is not known: there is no column 'genuine'"
            if "genuine" in self.table.places:
                what = f"{self.table.column('genuine')}: whether the pair is genuine is not known"
            names, pair = list(self.node), ""
            if self.named:
                two = " and ".join(repr(names[n[k]]) for n in (self.probe, self.reference))
                pair = f", and {two} are not named FFF_M (finger FFF, impression M)"
            raise self._error(f"line {self.line[k]}, {what}{pair}")

    def _kept(
        self, probe: NDArray[np.intp], reference: NDArray[np.intp], similarity: NDArray[np.float64]
    ) -> NDArray[np.intp]:
        """Return the rows that are kept: each pair once, none of a print with itself."""
        size = len(self.node)
        ordered = probe * size + reference
        _, first, again = np.unique(ordered, return_index=True, return_inverse=True)
        differing = np.flatnonzero(similarity != similarity[first[again]])
        if differing.size:
            k, names = differing[0], list(self.node)
            pair = f"{names[probe[k]]} and {names[reference[k]]}"
            earlier = self.line[first[again[k]]]
            what = f"{pair} are compared again, with another score than in line {earlier}"
            raise self._error(f"line {self.line[k]}, {self.table.column(self.score)}: {what}")
        either = np.minimum(probe, reference) * size + np.maximum(probe, reference)
        _, once, again = np.unique(either, return_index=True, return_inverse=True)
        if np.array_equal(similarity, similarity[once[again]]):  # the order does not matter
            first = once
        kept = np.sort(first)
        same = self._same_print()
        return np.asarray(kept[same[probe[kept]] != same[reference[kept]]], np.intp)

    def _same_print(self) -> NDArray[np.intp]:
        """Return for each print the one that is named so without extension, as in a gallery."""
        stems = ((k, name.rpartition(".")[0]) for k, name in enumerate(self.node))
        return np.array([self.node.get(stem, k) for k, stem in stems], np.intp)

    def _qualities(self) -> NDArray[np.float64] | None:
        """Return the quality of each print; None where none is known."""
        quality = np.array([self.quality.get(k, math.nan) for k in range(len(self.node))])
        return quality if np.isfinite(quality).any() else None
