"""Files of scores: a row a comparison, of `evaluate --scores` and `score`.

There is one format, whose columns are found by their names:

- ``matcher``, ``set``: the matcher and the database;
- ``probe``, ``reference``: names of the two prints;
- ``genuine``: 1 if both show the same finger, 0 if not, empty where it is not known;
- ``similarity``: the matcher's own measure; empty where a print has no template;
- ``score``: calibrated, 0 to 100; empty without calibration;
- ``decision``: match, no match or inconclusive, as `fpmatch.verify` decides; inconclusive, too,
  where a print has no template; empty where the matcher does not decide;
- ``reason``: why there is no similarity;
- ``probe_quality``, ``reference_quality``: quality of the two images, 0 to 100; empty where it is
  not known, as of templates.
"""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING, Any, Final

from fpmatch.errors import OutputError
from fpmatch.gallery.listing.csv_rows import csv_cell

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

Cells = list[Any]

COLUMNS: Final = (
    *("matcher", "set", "probe", "reference", "genuine", "similarity", "score"),
    *("decision", "reason", "probe_quality", "reference_quality"),
)
PARQUET: Final = ".parquet"
FORMATS: Final = (".csv", PARQUET)
_NEEDS_PYARROW: Final = "Parquet needs pyarrow: pip install 'fpmatch[parquet]'"
_BLOCK_BYTES: Final = 8 << 20  # of CSV that become one row group of Parquet, at least


def is_parquet(path: Path) -> bool:
    """Return whether the name of a file is that of a Parquet file."""
    return path.suffix.lower() == PARQUET


def csv_lines(rows: Iterable[Sequence[object]]) -> bytes:
    """Return rows as lines of a CSV file, texts as `fpmatch.printable.csv_cell` has them."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(
        [csv_cell(cell) if isinstance(cell, str) else cell for cell in row] for row in rows
    )
    return text.getvalue().encode()


HEADER: Final = csv_lines([COLUMNS])


def check_format(path: Path) -> None:
    """Raise an OutputError unless scores can be written to a file of this name."""
    if path.suffix.lower() not in FORMATS:
        raise OutputError(f"{path}: scores are written as {' or '.join(FORMATS)}")
    if is_parquet(path):
        try:
            import pyarrow.parquet  # noqa: F401, PLC0415
        except ImportError as error:
            raise OutputError(f"{path}: {_NEEDS_PYARROW}") from error


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
