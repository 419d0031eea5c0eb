"""The rows of one database in a file of scores, gathered and checked."""

from __future__ import annotations

import math
import re
from array import array
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import DatasetError
from fpmatch.evaluation.comparison import NO_TEMPLATE
from fpmatch.evaluation.ranked_trials import Trials
from fpmatch.evaluation.score_table import LABELS, NO_SCORE, ScoreTable, number
from fpmatch.evaluation.scores_set import ScoresSet

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

SIDES: Final = ("probe", "reference")
_PRINT_NAME: Final = re.compile(r"(\d+)_\d+(\.\w+)?", re.ASCII)
_UNKNOWN: Final = -1


def finger_of_fvc_name(name: str) -> str | None:
    """Return the finger of a print named FFF_M, without leading zeros; None for other names."""
    found = _PRINT_NAME.fullmatch(name)
    return None if found is None else str(int(found[1]))


def unnamed_set(
    genuine: NDArray[np.float64],
    impostor: NDArray[np.float64],
    *,
    matcher: str = "",
    name: str = "scores",
    distances: bool = False,
) -> ScoresSet:
    """Return scores whose prints and fingers are not known; NaN where a comparison failed."""
    similarity = np.concatenate([genuine, impostor])
    kind = np.repeat(np.array([0, 1], np.intp), [genuine.size, impostor.size])
    trials = Trials(_filled(similarity), np.zeros(kind.size, np.intp), kind, 0)
    nothing = np.empty(0, np.intp)
    compared = np.isfinite(similarity)
    return ScoresSet(matcher, name, (), nothing, nothing, trials, compared, distances=distances)


def number_in(table: ScoreTable, role: str, line: int, cell: Any) -> float:
    """Return the number in a cell, NaN where there is none; infinite numbers are errors."""
    if isinstance(cell, str) and cell.strip().casefold() in NO_SCORE:
        return math.nan
    try:
        value = number(cell)
    except ValueError:
        value = math.inf
    if math.isinf(value):
        what = f"{cell!r} is not a finite number"
        raise DatasetError(f"line {line}, {table.column(role)}: {what}", path=table.path)
    return value


@dataclass(slots=True)
class ScoreRows:
    """Gather the rows of one database in little space.

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
                self.quality[node] = number_in(self.table, f"{side}_quality", line, cell)
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
        self.similarity.append(number_in(self.table, self.score, line, score))
        self.overlap.append(number_in(self.table, "overlap", line, overlap))

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
        compared, filled = np.isfinite(similarity), _filled(similarity)
        kept = self._kept(probe, reference, filled) if self.named else np.arange(probe.size)
        probe, reference = probe[kept], reference[kept]
        known = np.unique(finger[np.concatenate([probe, reference])])
        finger = np.searchsorted(known, finger)
        trials = Trials(filled[kept], finger[probe], finger[reference], int(known.size))
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
        found = np.array([self.quality.get(k, math.nan) for k in range(len(self.node))])
        return found if np.isfinite(found).any() else None


def _filled(similarity: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return similarities with those of failed comparisons as low as any, and not above 0."""
    failed = np.isnan(similarity)
    lowest = min(0.0, float(similarity[~failed].min(initial=0.0)))
    return np.where(failed, lowest, similarity)
