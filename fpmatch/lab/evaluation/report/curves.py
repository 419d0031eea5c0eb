"""The points of an evaluation's curves as CSV files, for other programs to draw."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeVar

import numpy as np

from fpmatch.base.folders import make_folder
from fpmatch.base.output import atomic_write_bytes, check_writable
from fpmatch.gallery.batch.score_file import csv_lines
from fpmatch.lab.evaluation.rates.error_rates import POOLED, error_curves
from fpmatch.lab.evaluation.report.results import split_scores

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.report.analysis import Analysis

    Row = tuple[object, ...]
    Scores = tuple[NDArray[np.float64], NDArray[np.float64]]

Part = TypeVar("Part")

DET, HISTOGRAM = "det.csv", "histogram.csv"
HEADS: Final = {
    DET: ("matcher", "set", "threshold", "fmr", "fnmr"),
    HISTOGRAM: ("matcher", "set", "from", "to", "genuine", "impostor"),
}
"""The files and their columns."""
BINS: Final = 50


def prepare_curves(folder: str | os.PathLike[str]) -> list[Path]:
    """Make a folder for the files of `write_curves`, and return these.

    Raises an `OutputError` if they cannot be written there.
    """
    return writable_files(folder, HEADS)


def writable_files(folder: str | os.PathLike[str], names: Iterable[str]) -> list[Path]:
    """Make a folder for files of these names; OutputError if they cannot be written there."""
    files = [Path(folder) / name for name in names]
    make_folder(folder)
    for file in files:
        check_writable(file)
    return files


def write_curves(folder: str | os.PathLike[str], analyses: Sequence[Analysis]) -> list[Path]:
    """Write the points of all curves into a folder, made if missing; return the files of `HEADS`.

    `folder`: where to write. `analyses`: one a matcher. Raises an `OutputError` if a file cannot be
    written.
    """
    rows = {DET: _det_rows, HISTOGRAM: _histogram_rows}
    return write_files(folder, HEADS, rows, analyses)


def write_files(
    folder: str | os.PathLike[str],
    heads: Mapping[str, Row],
    rows_of: Mapping[str, Callable[[Part], Iterable[Row]]],
    parts: Sequence[Part],
) -> list[Path]:
    """Write files of these names, with the rows of each part; OutputError if one cannot be."""
    files = writable_files(folder, heads)
    for file in files:
        lines = [row for part in parts for row in rows_of[file.name](part)]
        atomic_write_bytes(file, csv_lines([heads[file.name], *lines]))
    return files


def _each(analysis: Analysis) -> Iterator[tuple[str, Scores, int]]:
    """Yield name and scores of each database, and of several all; and the sign of distances."""
    rows = analysis.report.sets
    sign = -1 if rows[0].scores.distances else 1
    named = [(row.name, row.scores.split()) for row in rows]
    if len(rows) > 1:
        named.append((POOLED, split_scores(rows)))
    for name, scores in named:
        if all(side.size for side in scores):
            yield name, scores, sign


def _det_rows(analysis: Analysis) -> Iterator[Row]:
    """Yield the corners of the polyline of FMR and FNMR, without points between two of them."""
    for name, scores, sign in _each(analysis):
        curves = error_curves(*scores)
        x, y = np.diff(curves.fmr) == 0, np.diff(curves.fnmr) == 0
        straight = np.r_[False, (x[1:] & x[:-1]) | (y[1:] & y[:-1]), False]
        kept = np.flatnonzero(~straight)
        points = (curves.threshold[kept] * sign, curves.fmr[kept], curves.fnmr[kept])
        for point in zip(*(column.tolist() for column in points), strict=True):
            yield (analysis.report.matcher, name, *point)


def _histogram_rows(analysis: Analysis) -> Iterator[Row]:
    for name, (genuine, impostor), sign in _each(analysis):
        edges = np.histogram_bin_edges(sign * np.concatenate([genuine, impostor]), BINS)
        counts = [np.histogram(sign * side, edges)[0].tolist() for side in (genuine, impostor)]
        for row in zip(edges[:-1].tolist(), edges[1:].tolist(), *counts, strict=True):
            yield (analysis.report.matcher, name, *row)
