"""The comparisons of a run, from an evaluation or from a file of scores."""

from __future__ import annotations

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
from fpmatch.evaluation.score_file import read_rows

if TYPE_CHECKING:
    import os

    from numpy.typing import NDArray

    from fpmatch.evaluation.report import EvaluationReport

_READ: Final = ("matcher", "set", "probe", "reference", "genuine", "similarity", "reason")
_OPTIONAL: Final = ("matcher", "set", "genuine", "reason")
_PRINT_NAME: Final = re.compile(r"(\d+)_\d+(\.\w+)?", re.ASCII)


@dataclass(frozen=True, slots=True, eq=False)
class ScoresSet:
    """Hold the comparisons of one database by one matcher ("" where it is not known).

    `probe` and `reference` are indices into `prints`, the names of the images. `compared` is False
    where a side has no template; the similarity is then 0.
    """

    matcher: str
    name: str
    prints: tuple[str, ...]
    probe: NDArray[np.intp]
    reference: NDArray[np.intp]
    trials: Trials
    compared: NDArray[np.bool_]

    @property
    def impostors(self) -> Trials:
        """The comparisons of different fingers, without those of prints that have no template."""
        t, kept = self.trials, ~self.trials.genuine & self.compared
        return Trials(t.similarity[kept], t.probe[kept], t.reference[kept], t.fingers)


def scores_of(report: EvaluationReport) -> list[ScoresSet]:
    """Return the comparisons of an evaluation, one `ScoresSet` a database."""
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


def read_scores(path: str | os.PathLike[str]) -> list[ScoresSet]:
    r"""Read a file of scores, see `fpmatch.evaluation.score_file`, by matcher and database.

    Prints are named after their fingers: FFF_M. Comparisons of a print with itself are left out,
    and pairs that come in both orders count once. Without the column ``set`` the database is named
    after the file.

    Raises
    ------
    DatasetError
        If the file is missing, no file of scores, or empty; for a malformed row, with its line.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "mine.csv")
    ...     _ = file.write_text("probe,reference,similarity\n1_1,2_1,0.5\n1_1,1_2,7\n")
    ...     (found,) = read_scores(file)
    >>> found.name, found.prints, found.trials.genuine.tolist()
    ('mine', ('1_1', '2_1', '1_2'), [False, True])
    """
    found: dict[tuple[str, str], _Rows] = {}
    for line, (matcher, name, *cells) in read_rows(path, _READ, _OPTIONAL):
        try:
            found.setdefault((matcher, name or Path(path).stem), _Rows()).add(*cells)
        except ValueError as error:
            raise DatasetError(f"{path}: line {line}: {error}") from error
    if not found:
        raise DatasetError(f"{path}: holds no comparison")
    try:
        return [_as_set(*key, rows) for key, rows in found.items()]
    except ValueError as error:
        raise DatasetError(f"{path}: {error}") from error


def choose_matcher(
    sets: list[ScoresSet], matcher: str, path: str | os.PathLike[str]
) -> list[ScoresSet]:
    """Return the sets that a matcher, or an unknown one, scored; DatasetError if there are none."""
    chosen = [one for one in sets if one.matcher in {"", matcher}]
    if not chosen:
        others = ", ".join(sorted({one.matcher for one in sets}))
        raise DatasetError(f"{path}: holds scores of {others}, none of {matcher}")
    return chosen


@dataclass(slots=True)
class _Rows:
    """Gather the rows of one database in little space."""

    index: dict[str, int] = field(default_factory=dict)
    finger: list[int] = field(default_factory=list)
    probe: array[int] = field(default_factory=lambda: array("q"))
    reference: array[int] = field(default_factory=lambda: array("q"))
    similarity: array[float] = field(default_factory=lambda: array("d"))
    compared: bytearray = field(default_factory=bytearray)

    def add(
        self, probe: str, reference: str, genuine: str, similarity: str | float, reason: str
    ) -> None:
        """Add a row; raise a ValueError if it is malformed."""
        i, j = self._number(probe), self._number(reference)
        if genuine not in {"0", "1", ""}:
            raise ValueError(f"genuine must be 0 or 1, not {genuine!r}")
        if genuine and (self.finger[i] == self.finger[j]) != (genuine == "1"):
            raise ValueError(f"genuine is {genuine}, which {probe} and {reference} are not by name")
        failed = reason == NO_TEMPLATE or similarity == ""
        value = 0.0 if failed else float(similarity)
        if not math.isfinite(value):
            raise ValueError("similarity must be a finite number")
        if i != j:
            self.probe.append(i)
            self.reference.append(j)
            self.similarity.append(value)
            self.compared.append(not failed)

    def _number(self, name: str) -> int:
        if name not in self.index:
            named = _PRINT_NAME.fullmatch(name)
            if named is None:
                raise ValueError(f"{name!r} is not named FFF_M (finger FFF, impression M)")
            self.index[name] = len(self.finger)
            self.finger.append(int(named[1]))
        return self.index[name]


def _as_set(matcher: str, name: str, rows: _Rows) -> ScoresSet:
    """Return the comparisons of a database, each pair once; raise a ValueError if they differ."""
    fingers, finger = np.unique(rows.finger, return_inverse=True)
    probe = np.frombuffer(rows.probe, np.int64).astype(np.intp)
    reference = np.frombuffer(rows.reference, np.int64).astype(np.intp)
    similarity = np.frombuffer(rows.similarity, np.float64)
    keys = np.minimum(probe, reference) * len(finger) + np.maximum(probe, reference)
    _, first, again = np.unique(keys, return_index=True, return_inverse=True)
    differing = np.flatnonzero(similarity != similarity[first[again]])
    prints = tuple(rows.index)
    if differing.size:
        one, other = prints[probe[differing[0]]], prints[reference[differing[0]]]
        raise ValueError(f"{one} and {other} are compared twice, differently")
    kept = np.sort(first)
    probe, reference = probe[kept], reference[kept]
    trials = Trials(similarity[kept], finger[probe], finger[reference], len(fingers))
    compared = np.frombuffer(rows.compared, np.uint8).astype(bool)[kept]
    return ScoresSet(matcher, name, prints, probe, reference, trials, compared)
