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
    if path.suffix.lower() != ".csv":
        raise OutputError(f"{path}: scores are written as .csv")
