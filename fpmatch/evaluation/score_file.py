"""Files of scores: a row a comparison, in the one format of `evaluate --scores` and `score`.

The columns are found by their names:

- ``matcher``, ``set``: the matcher and the database;
- ``probe``, ``reference``: names of the two prints;
- ``genuine``: 1 if both show the same finger, 0 if not, empty where it is not known;
- ``similarity``: the matcher's own measure; empty where a print has no template;
- ``score``: calibrated, 0 to 100; empty without calibration;
- ``decision``: match, no match or inconclusive, as `fpmatch.verify` decides; inconclusive, too,
  where a print has no template; empty where the matcher does not decide;
- the columns `DETAILS`, which only `evaluate` writes: number of pairs, transform, agreement;
- ``reason``: why there is no similarity, or, in `evaluate`, why the prints do not match;
- ``probe_quality``, ``reference_quality``: quality of the two images, 0 to 100; empty where it is
  not known, as of templates.

A file of `score` may also be Parquet. `fpmatch.evaluation.scores` reads these files.
"""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import OutputError, without_path
from fpmatch.evaluation.comparison import NO_TEMPLATE
from fpmatch.evaluation.decision import calibration_of
from fpmatch.evaluation.decision import outcomes as outcomes_of
from fpmatch.evaluation.score_table import PARQUET, is_parquet
from fpmatch.matching.decision import MATCH
from fpmatch.output import atomic_write, check_writable
from fpmatch.printable import csv_cell

if TYPE_CHECKING:
    import os
    from collections.abc import Iterable, Iterator, Sequence
    from pathlib import Path

    from fpmatch.evaluation.report import EvaluationReport, SetResult


COLUMNS: Final = (
    *("matcher", "set", "probe", "reference", "genuine", "similarity", "score"),
    *("decision", "reason", "probe_quality", "reference_quality"),
)
_BEFORE_DETAILS: Final = COLUMNS.index("reason")
DETAILS: Final = (
    *("pairs", "scale", "rotation_deg", "tx", "ty", "rms_px", "agreement", "overlap"),
)
FORMATS: Final = (".csv", PARQUET)
_BLOCK_BYTES: Final = 8 << 20  # of CSV that become one row group of Parquet, at least


def csv_lines(rows: Iterable[Sequence[object]]) -> bytes:
    """Return rows as lines of a CSV file; texts are as `fpmatch.printable.csv_cell` has them."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(
        [csv_cell(cell) if isinstance(cell, str) else cell for cell in row] for row in rows
    )
    return text.getvalue().encode()


def failure_reason(probe: str, reference: str) -> str:
    """Return the reason of a row from those why its prints have no template ("": they have one)."""
    sides = {"probe": probe, "reference": reference}
    return "; ".join(f"{side}: {why}" for side, why in sides.items() if why)


def write_scores(path: str | os.PathLike[str], *reports: EvaluationReport) -> None:
    """Write all comparisons of evaluations, one a matcher, with `COLUMNS` and `DETAILS`.

    ``reason`` is empty where `fpmatch.verify` decides by default that the prints match. The file
    appears whole or not at all; an `OutputError` is raised if it cannot be written.
    """
    check_writable(path)
    with atomic_write(path) as stream:
        head = (*COLUMNS[:_BEFORE_DETAILS], *DETAILS, *COLUMNS[_BEFORE_DETAILS:])
        stream.write(csv_lines([head]))
        for report in reports:
            for row in report.sets:
                stream.write(csv_lines(_rows(row, report.matcher)))


def _rows(result: SetResult, matcher: str) -> Iterator[Sequence[object]]:
    impressions = result.extracted.dataset.impressions
    outcomes, pairs = result.outcomes, result.pairs
    failed, similarity = outcomes["reason"] == NO_TEMPLATE, outcomes["similarity"]
    calibration = calibration_of(matcher)
    score = calibration.scores(similarity) if calibration else np.full(len(pairs), np.nan)
    failures = [
        "" if e.template else without_path(e.reason, i.path) or NO_TEMPLATE
        for i, e in zip(impressions, result.extracted.extractions, strict=True)
    ]
    decision = outcomes_of(matcher, similarity, outcomes["reachable"])
    why = np.where(decision == MATCH, "", outcomes["reason"])
    for k in np.flatnonzero(failed).tolist():
        why[k] = failure_reason(failures[pairs.probe[k]], failures[pairs.reference[k]])
    quality = ["" if e.quality is None else e.quality for e in result.extracted.extractions]
    columns = (
        *([impressions[i].name for i in side] for side in (pairs.probe, pairs.reference)),
        pairs.genuine.astype(int).tolist(),
        ["" if no else value for no, value in zip(failed, similarity.tolist(), strict=True)],
        ["" if no else _short(value) for no, value in zip(failed, score.tolist(), strict=True)],
        decision.tolist(),
        outcomes["pairs"].tolist(),
        *([_short(value) for value in outcomes[column].tolist()] for column in DETAILS[1:]),
        why.tolist(),
        *([quality[i] for i in side] for side in (pairs.probe, pairs.reference)),
    )
    for values in zip(*columns, strict=True):
        yield (matcher, result.name, *values)


def _short(value: float) -> str:
    """Return a measured value with six digits; "" where there is none."""
    return "" if np.isnan(value) else f"{value:.6g}"


def check_format(path: Path) -> None:
    """Raise an OutputError unless scores can be written to a file of this name."""
    if path.suffix.lower() not in FORMATS:
        raise OutputError(f"{path}: scores are written as {' or '.join(FORMATS)}")
    if is_parquet(path):
        try:
            import pyarrow.parquet  # noqa: F401, PLC0415
        except ImportError as error:
            raise OutputError(
                f"{path}: Parquet needs pyarrow: pip install 'fpmatch[parquet]'"
            ) from error


def convert_to_parquet(source: Path, target: Path) -> None:
    """Convert a CSV file of `COLUMNS` to Parquet, a block at a time; numbers are kept exactly."""
    from pyarrow import csv as arrow_csv  # noqa: PLC0415
    from pyarrow import float64, int64, parquet, string  # noqa: PLC0415

    types: dict[str, Any] = dict.fromkeys(COLUMNS, string())
    types |= {"similarity": float64(), "score": float64()}
    types |= {"probe_quality": int64(), "reference_quality": int64()}
    with (
        arrow_csv.open_csv(
            source,
            read_options=arrow_csv.ReadOptions(use_threads=False, block_size=_BLOCK_BYTES),
            convert_options=arrow_csv.ConvertOptions(column_types=types, null_values=[""]),
        ) as blocks,
        parquet.ParquetWriter(target, blocks.schema, write_page_checksum=True) as writer,
    ):
        for block in blocks:
            writer.write_batch(block)
