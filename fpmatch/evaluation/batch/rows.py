"""Rows of scores: as lines of a CSV file, and that file turned into Parquet."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import OutputError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.evaluation.batch.plan import PairChunk
    from fpmatch.matching.calibration import Calibration

COLUMNS: Final = ("probe", "reference", "similarity", "score", "reason")
HEADER: Final = (",".join(COLUMNS) + "\n").encode()
PARQUET: Final = ".parquet"
FORMATS: Final = (".csv", PARQUET)
_BLOCK_BYTES: Final = 8 << 20  # of CSV that become one row group of Parquet, at least


@dataclass(frozen=True, slots=True)
class RowWriter:
    """Put pairs and their similarities into words.

    Parameters
    ----------
    probes, references : sequence of str
        Names of the prints of the two sides.
    probe_failures, reference_failures : mapping of int to str
        Why some of them have no template, by number.
    calibration : Calibration or None
        Turns similarities into scores; without one, scores are left empty.
    threshold : float or None
        Least score of the rows that are kept; None keeps all. Rows without a score, because a
        print has no template, are kept always: nobody knows what it would be.
    """

    probes: Sequence[str]
    references: Sequence[str]
    probe_failures: Mapping[int, str]
    reference_failures: Mapping[int, str]
    calibration: Calibration | None
    threshold: float | None

    def lines(self, chunk: PairChunk, similarity: NDArray[np.float64]) -> tuple[bytes, int, int]:
        """Return the lines of some pairs, how many, and how many of them have no score.

        Parameters
        ----------
        chunk : PairChunk
            The pairs.
        similarity : ndarray of float64, shape (N,)
            Their similarities; not a number where a print has no template.
        """
        failed = np.isnan(similarity)
        score = np.full(len(chunk), np.nan)
        if self.calibration is not None:
            score = self.calibration.scores(similarity)
        kept = np.arange(len(chunk))
        if self.threshold is not None:
            kept = np.flatnonzero(failed | (score >= self.threshold))
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        for probe, reference, raw, calibrated in zip(
            chunk.probe[kept].tolist(),
            chunk.reference[kept].tolist(),
            similarity[kept].tolist(),
            score[kept].tolist(),
            strict=True,
        ):
            why = self._why(probe, reference) if math.isnan(raw) else ""
            names = self.probes[probe], self.references[reference]
            writer.writerow((*names, _cell(raw), _cell(calibrated), why))
        return text.getvalue().encode(), len(kept), int(failed.sum())

    def _why(self, probe: int, reference: int) -> str:
        """Return why there is no score."""
        reasons = {
            "probe": self.probe_failures.get(probe),
            "reference": self.reference_failures.get(reference),
        }
        return "; ".join(f"{side}: {reason}" for side, reason in reasons.items() if reason)


def _cell(value: float) -> float | str:
    """Return a number with all its digits; "" where there is none."""
    return "" if math.isnan(value) else value


def check_format(path: Path) -> None:
    """Refuse a file whose name ends in no format that can be written.

    Raises
    ------
    OutputError
        If it ends in none, or in ``.parquet`` where pyarrow (extra ``fpmatch[parquet]``) is
        missing.
    """
    if path.suffix.lower() not in FORMATS:
        raise OutputError(f"{path}: scores are written as {' or '.join(FORMATS)}")
    if is_parquet(path):
        try:
            import pyarrow.parquet  # noqa: F401, PLC0415
        except ImportError as error:
            raise OutputError(
                f"{path}: Parquet needs pyarrow: pip install 'fpmatch[parquet]'"
            ) from error


def is_parquet(path: Path) -> bool:
    """Tell whether a file is to be Parquet."""
    return path.suffix.lower() == PARQUET


def write_parquet(source: Path, target: Path) -> None:
    """Turn a CSV file of rows into Parquet, a block at a time; numbers keep their last bit."""
    from pyarrow import csv as arrow_csv  # noqa: PLC0415
    from pyarrow import float64, parquet, string  # noqa: PLC0415

    types: dict[str, Any] = dict.fromkeys(COLUMNS, string())
    types |= {"similarity": float64(), "score": float64()}
    with (
        arrow_csv.open_csv(
            source,
            read_options=arrow_csv.ReadOptions(use_threads=False, block_size=_BLOCK_BYTES),
            convert_options=arrow_csv.ConvertOptions(column_types=types, null_values=[""]),
        ) as blocks,
        parquet.ParquetWriter(target, blocks.schema) as writer,
    ):
        for block in blocks:
            writer.write_batch(block)
