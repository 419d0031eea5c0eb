"""Scores of fingers from a file of scores: a row for each probe and finger of the references.

The rows of a scoring are read again, one after the other; of every probe and finger only three
numbers are kept. The score of a finger is ``-10·log10`` of the harmonic mean of the false match
rates of its impressions, as `fpmatch.matching.finger.fused_score` has it.
"""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import ScoringError
from fpmatch.evaluation.batch.rows import is_parquet
from fpmatch.gallery.names import NamePattern
from fpmatch.matching.calibration import MAX_SCORE
from fpmatch.output import atomic_write_bytes

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

FINGER_COLUMNS: Final = ("probe", "finger", "impressions", "best", "score")
MOST_CELLS: Final = 50_000_000
"""Probes times fingers, at most: 20 bytes of memory each."""


def finger_of_name(name: str) -> str:
    """Return the finger in a file name: FFF of FFF_M.tif, else the name without suffix.

    Examples
    --------
    >>> finger_of_name("101_3.tif"), finger_of_name("left thumb.png")
    ('101', 'left thumb')
    """
    label = NamePattern().label(Path(name))
    return Path(name).stem if label is None else str(label.of_finger)


def check_fingers(probes: int, fingers: Sequence[str]) -> None:
    """Refuse more probes and fingers than fit into memory.

    Raises
    ------
    ScoringError
        If there are more than `MOST_CELLS` pairs of a probe and a finger.
    """
    cells = probes * len(set(fingers))
    if cells > MOST_CELLS:
        raise ScoringError(
            f"scores of fingers: {probes:,} probes and {len(set(fingers)):,} fingers are "
            f"{cells:,} pairs, more than {MOST_CELLS:,}; score fewer probes at a time"
        )


def write_fingers(
    scores: Path,
    target: Path,
    probes: Sequence[str],
    references: Sequence[str],
    fingers: Sequence[str],
    *,
    same: bool = False,
) -> int:
    """Write the scores of fingers of a file of scores.

    Parameters
    ----------
    scores : Path
        What `fpmatch.evaluation.batch.score.score` wrote, ``.csv`` or ``.parquet``, without a
        threshold.
    target : Path
        The CSV file to write or replace; its columns are `FINGER_COLUMNS`.
    probes, references : sequence of str
        Names of the prints of the two sides.
    fingers : sequence of str
        Whose each reference is.
    same : bool
        Whether both sides are the same prints: a print is then not compared with itself.

    Returns
    -------
    int
        How many rows were written: one for each probe and finger of which a pair has a score, in
        the order of the sides.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    probe_number = {name: k for k, name in enumerate(probes)}
    reference_number = {name: k for k, name in enumerate(references)}
    names = list(dict.fromkeys(fingers))
    number = {name: k for k, name in enumerate(names)}
    finger = [number[name] for name in fingers]
    shape = (len(probes), len(names))
    ratio, best = np.zeros(shape), np.zeros(shape)
    count = np.zeros(shape, np.int32)
    for probe, reference, score in _scores(scores):
        i, j = probe_number[probe], reference_number[reference]
        if not (same and i == j):
            at = i, finger[j]
            ratio[at] += 10.0 ** (score / 10.0)
            best[at] = max(best[at], score)
            count[at] += 1
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(FINGER_COLUMNS)
    rows, columns = np.nonzero(count)
    fused = np.clip(10.0 * np.log10(ratio[rows, columns] / count[rows, columns]), 0, MAX_SCORE)
    for i, j, score in zip(rows.tolist(), columns.tolist(), fused.tolist(), strict=True):
        writer.writerow((probes[i], names[j], count[i, j], float(best[i, j]), score))
    atomic_write_bytes(target, text.getvalue().encode())
    return len(rows)


def _scores(path: Path) -> Iterator[tuple[str, str, float]]:
    """Yield probe, reference and score of the rows that have a score."""
    if is_parquet(path):
        from pyarrow import parquet  # noqa: PLC0415

        with parquet.ParquetFile(path) as file:
            for block in file.iter_batches(columns=["probe", "reference", "score"]):
                for row in block.to_pylist():
                    if row["score"] is not None:
                        yield row["probe"], row["reference"], row["score"]
        return
    with path.open(newline="", encoding="utf-8") as stream:
        for row in csv.DictReader(stream):
            if row["score"]:
                yield row["probe"], row["reference"], float(row["score"])
