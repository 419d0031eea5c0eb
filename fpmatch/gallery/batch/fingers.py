"""Scores of fingers from a file of scores: a row for each probe and finger of the references.

The rows are read again one by one; of every probe and finger three numbers are kept. The score of
a finger is ``-10·log10`` of the harmonic mean of the false match rates of its impressions, as in
`fpmatch.gallery.fingers.finger.fused_score`.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.base.output import atomic_write_bytes
from fpmatch.errors import ScoringError
from fpmatch.gallery.batch.score_file import csv_lines, read_columns
from fpmatch.gallery.listing.entry import NamePattern
from fpmatch.matching.calibration import MAX_SCORE

if TYPE_CHECKING:
    from collections.abc import Sequence

FINGER_COLUMNS: Final = ("probe", "finger", "impressions", "best", "score")
MAX_CELLS: Final = 50_000_000
"""Probes times fingers, at most: 20 bytes of memory each."""


def finger_of_name(name: str) -> str:
    """Return the finger in a file name: FFF of FFF_M.tif, else the name without suffix."""
    label = NamePattern().label(Path(name))
    return Path(name).stem if label is None else str(label.of_finger)


def check_fingers(probes: int, fingers: Sequence[str]) -> None:
    """Raise a `ScoringError` if there are more pairs of a probe and a finger than `MAX_CELLS`."""
    several = len(set(fingers))
    if probes * several > MAX_CELLS:
        raise ScoringError(
            f"scores of fingers: {probes:,} probes and {several:,} fingers are "
            f"{probes * several:,} pairs, more than {MAX_CELLS:,}; score fewer probes at a time"
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
    """Write the scores of fingers, with the columns `FINGER_COLUMNS`; return the number of rows.

    There is a row for each probe and finger of which a pair has a score, in the order of the sides.
    `fingers` holds the finger of each reference; with `same` a print is not compared with itself.
    """
    probe_number = {name: k for k, name in enumerate(probes)}
    reference_number = {name: k for k, name in enumerate(references)}
    names = list(dict.fromkeys(fingers))
    number = {name: k for k, name in enumerate(names)}
    finger = [number[name] for name in fingers]
    shape = (len(probes), len(names))
    ratio, best = np.zeros(shape), np.zeros(shape)
    count = np.zeros(shape, np.int32)
    for _, (probe, reference, cell) in read_columns(scores, ("probe", "reference", "score")):
        i, j = probe_number[probe], reference_number[reference]
        if cell != "" and not (same and i == j):
            at, score = (i, finger[j]), float(cell)
            ratio[at] += 10.0 ** (score / 10.0)
            best[at] = max(best[at], score)
            count[at] += 1
    rows, columns = np.nonzero(count)
    fused = np.clip(10.0 * np.log10(ratio[rows, columns] / count[rows, columns]), 0, MAX_SCORE)
    lines = csv_lines(
        (probes[i], names[j], count[i, j], float(best[i, j]), score)
        for i, j, score in zip(rows.tolist(), columns.tolist(), fused.tolist(), strict=True)
    )
    atomic_write_bytes(target, csv_lines([FINGER_COLUMNS]) + lines)
    return len(rows)
