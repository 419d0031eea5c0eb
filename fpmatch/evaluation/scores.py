r"""Read files of scores: of fpmatch, or of any other matcher.

Which pairs are genuine is known from the column ``genuine``; where that is missing or empty, from
the columns of fingers or else from the names of the prints, FFF_M: finger FFF, impression M.
Fingers are what genuine pairs join, so that any names will do.
"""

from __future__ import annotations

from array import array
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import DatasetError
from fpmatch.evaluation.score_rows import (
    ScoreRows,
    finger_of_fvc_name,
    number_in,
    unnamed_set,
)
from fpmatch.evaluation.score_table import ScoreTable, open_table

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from fpmatch.evaluation.scores_set import ScoresSet

_READ: Final = (
    *("matcher", "set", "probe", "reference", "probe_finger", "reference_finger", "genuine"),
    *("reason", "overlap", "probe_quality", "reference_quality"),
)


def read_scores(
    path: str | os.PathLike[str],
    *,
    name: str | None = None,
    distances: bool = False,
    finger_of: Callable[[str], str | None] = finger_of_fvc_name,
) -> list[ScoresSet]:
    r"""Read a file of scores by matcher and database; docs/reference/scores.md has the formats.

    Comparisons of a print with itself are left out, and pairs that come in both orders count once
    if both have the same score.

    Parameters
    ----------
    path : path-like
        CSV, columns separated by spaces or tabs, or Parquet; with or without names of columns.
    name : str, optional
        Name of the database where there is no column ``set`` (default: that of the file).
    distances : bool
        Whether lower is more similar; the similarities are then the distances, negative.
    finger_of : callable
        Returns the finger in the name of a print, None where it contains none.

    Raises
    ------
    DatasetError
        If the file is missing, no file of scores, or empty; for a malformed row, with its line and
        column.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from fpmatch.evaluation.scores import read_scores
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "mine.csv")
    ...     _ = file.write_text("probe,reference,similarity\n1_1,2_1,0.5\n1_1,1_2,7\n")
    ...     (found,) = read_scores(file)
    >>> found.name, found.prints, found.trials.genuine.tolist()
    ('mine', ('1_1', '2_1', '1_2'), [False, True])
    """
    name = Path(path).stem if name is None else name
    table = open_table(path)
    if {"genuine", "impostor"} <= set(table.places):
        kinds = _scores_in(table, ("genuine", "impostor"), distances=distances)
        return [unnamed_set(*kinds, name=name, distances=distances)]
    role = _score_column(table, distances=distances)
    found: dict[tuple[str, str], ScoreRows] = {}
    for line, cells in table.cells([*_READ, role]):
        key = str(cells[0]), str(cells[1]) or name
        if key not in found:
            found[key] = ScoreRows(table, role, finger_of)
        found[key].add(line, *cells[2:])
    if not found:
        raise DatasetError("holds no comparison", path=path)
    sets = [rows.as_set(*key, distances=distances) for key, rows in found.items()]
    return [replace(one, note=table.note) for one in sets]


def read_genuine_and_impostor(
    genuine: str | os.PathLike[str],
    impostor: str | os.PathLike[str],
    *,
    distances: bool = False,
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
    found: list[array[float]] = [array("d") for _ in roles]
    for line, cells in table.cells(roles):
        for values, role, cell in zip(found, roles, cells, strict=True):
            if cell != "":
                values.append(number_in(table, role, line, cell))
    arrays = [np.array(values, np.float64) for values in found]
    return [-values if distances else values for values in arrays]
