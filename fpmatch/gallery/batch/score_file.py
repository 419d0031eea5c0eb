"""Files of scores: a row a comparison, of `evaluate --scores` and `score`, or of another program.

fpmatch writes one format, whose columns are found by their names:

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

It reads CSV (comma, semicolon or tab), columns separated by spaces, and Parquet. Columns are
recognised by their names, see `COLUMN_NAMES`, or, in a file without a first line of names, by their
number and by what they contain; see `LAYOUTS`. Lines that begin with ``#`` are comments, in CSV
only those before the first row. `fpmatch.lab.evaluation.rates.scores` makes sets of scores of the
rows.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch.base.output import reason
from fpmatch.errors import DatasetError, OutputError
from fpmatch.gallery.listing.csv_rows import csv_cell, csv_rows

if TYPE_CHECKING:
    import os
    from collections.abc import Iterable

Cells = list[Any]
Lines = Iterator[tuple[int, Cells]]

COLUMNS: Final = (
    *("matcher", "set", "probe", "reference", "genuine", "similarity", "score"),
    *("decision", "reason", "probe_quality", "reference_quality"),
)
DETAILS: Final = (
    *("pairs", "scale", "rotation_deg", "tx", "ty", "rms_px", "agreement", "overlap"),
)
PARQUET: Final = ".parquet"
FORMATS: Final = (".csv", PARQUET)
_NEEDS_PYARROW: Final = "Parquet needs pyarrow: pip install 'fpmatch[parquet]'"
_BLOCK_BYTES: Final = 8 << 20  # of CSV that become one row group of Parquet, at least
COLUMN_NAMES: Final[Mapping[str, tuple[str, ...]]] = {
    "matcher": (),
    "set": (),
    "probe": ("probe_template_id", "probe_reference_id", "probe_key", "test_label", "key", "query"),
    "reference": ("bio_ref_template_id", "bio_ref_reference_id", "model_label", "gallery"),
    "probe_finger": ("probe_subject_id", "probe_subject", "real_id"),
    "reference_finger": ("bio_ref_subject_id", "reference_subject", "claimed_id"),
    "genuine": ("label", "mated"),
    "impostor": ("imposter", "nonmated"),
    "similarity": ("score",),
    "distance": ("dissimilarity",),
    "reason": (),
    "overlap": (),
    "probe_quality": (),
    "reference_quality": (),
}
"""The columns that are read, and other names of them; small and capital letters are the same."""
LABELS: Final = {
    **dict.fromkeys(("1", "genuine", "mated", "true", "match"), "1"),
    **dict.fromkeys(
        ("0", "impostor", "imposter", "nonmated", "non-mated", "false", "nonmatch"), "0"
    ),
}
"""What a column genuine may contain."""
NO_SCORE: Final = frozenset({"", "nan", "na", "none", "null"})
LAYOUTS: Final = (
    ("similarity",),
    ("similarity", "genuine"),
    ("genuine", "similarity"),
    ("probe", "reference", "similarity"),
    ("similarity", "probe", "reference"),  # as NIST's bozorth3 prints them
    ("probe", "reference", "similarity", "genuine"),
    ("probe", "reference", "genuine", "similarity"),
    ("reference_finger", "probe_finger", "probe", "similarity"),  # of bob, as the next
    ("reference_finger", "reference", "probe_finger", "probe", "similarity"),
)
"""Columns of files without a line of names; genuine contains `LABELS` alone, and scores do not."""
_SHOWN_LETTERS: Final = 20  # of a column that an error quotes; a key has 44
_PEEKED: Final = 1000  # rows by which the columns of a file without names are recognised


@dataclass(frozen=True, slots=True)
class ScoreTable:
    """The rows of a file of scores, with line numbers, and the place of each known column.

    `names` are those of all columns, as in the file; `note` says how a file without a line of names
    is understood.
    """

    path: Path
    places: Mapping[str, int]
    names: Sequence[str]
    rows: Lines
    note: str = ""

    def column(self, role: str) -> str:
        """Return the name of a known column in the file, for messages."""
        return f"column {self.names[self.places[role]]!r}"

    def cells(self, roles: Sequence[str]) -> Lines:
        """Yield line number and cells of `roles` of each row, "" where there is none.

        Raises a `DatasetError` if the file cannot be read or a row has too many columns.
        """
        places = [self.places.get(role, -1) for role in roles]
        width = len(self.names)
        for line, row in self.rows:
            if len(row) > width:
                raise DatasetError(
                    f"line {line}, column {width + 1}: {len(row)} columns instead of {width}",
                    path=self.path,
                )
            row.extend([""] * (width - len(row)))
            yield line, [row[k] if k >= 0 else "" for k in places]

    def number(self, role: str, line: int, cell: Any) -> float:
        """Return the number in a cell, NaN where there is none; infinite numbers are errors."""
        if isinstance(cell, str) and cell.strip().casefold() in NO_SCORE:
            return math.nan
        try:
            value = _number(cell)
        except ValueError:
            value = math.inf
        if math.isinf(value):
            what = f"{cell!r} is not a finite number"
            raise DatasetError(f"line {line}, {self.column(role)}: {what}", path=self.path)
        return value


def open_table(path: str | os.PathLike[str], *, last: bool = False) -> ScoreTable:
    """Open a file of scores; raise a `DatasetError` if it cannot be read or understood.

    With `last`, the last column of a file without names of columns contains the scores.
    """
    source = Path(path)
    rows = _rows_of(source)
    line, head = next(rows, (0, []))
    if not head:
        raise DatasetError("holds no comparison", path=path)
    places = _by_name(head)
    if places or not any(_is_number(cell) for cell in head):
        _check_names(source, line, head, places)
        return ScoreTable(source, places, list(map(str, head)), rows)
    first = [(line, head), *islice(rows, _PEEKED - 1)]
    roles = [*(f"column {k + 1}" for k in range(len(head) - 1)), "similarity"]
    if not last:
        roles = _guess(source, first)
    note = f"without a line of column names, its columns are taken for {', '.join(roles)}"
    places = {role: k for k, role in enumerate(roles)}
    return ScoreTable(source, places, roles, chain(first, rows), note)


def read_columns(path: str | os.PathLike[str], columns: Sequence[str]) -> Lines:
    """Yield line number and cells of the columns of these very names of a file of scores."""
    rows = _rows_of(Path(path))
    _, head = next(rows, (0, []))
    if missing := [name for name in columns if name not in head]:
        raise DatasetError(f"not a file of scores: no column {missing[0]!r}", path=path)
    places = {name: head.index(name) for name in columns}
    yield from ScoreTable(Path(path), places, head, rows).cells(columns)


def is_parquet(path: Path) -> bool:
    """Return whether the name of a file is that of a Parquet file."""
    return path.suffix.lower() == PARQUET


def _by_name(head: Cells) -> dict[str, int]:
    """Return the places of the columns with known names; those of similarity win over scores."""
    known = {name: role for role, names in COLUMN_NAMES.items() for name in (*names, role)}
    places: dict[str, int] = {}
    for k, cell in enumerate(head):
        name = str(cell).strip().casefold().replace(" ", "_")
        role = known.get(name)
        if role is not None and (role not in places or name == role):
            places[role] = k
    return places


def _check_names(path: Path, line: int, head: Cells, places: Mapping[str, int]) -> None:
    """Raise a DatasetError unless there is a column of scores."""
    scored = places.keys() & {"similarity", "distance"}
    if not scored and not {"genuine", "impostor"} <= places.keys():
        raise DatasetError(
            f"line {line}: not a file of scores: no column 'similarity', 'score' or 'distance' "
            f"among {', '.join(repr(str(cell)[:_SHOWN_LETTERS]) for cell in head)}",
            path=path,
        )


def _guess(path: Path, lines: Sequence[tuple[int, Cells]]) -> list[str]:
    """Return what the columns of a file without names contain: the first layout that fits."""
    rows = [row for _, row in lines]
    width = len(rows[0])
    columns = [[str(row[k]) if k < len(row) else "" for row in rows] for k in range(width)]
    numeric = [all(map(_is_number, column)) for column in columns]
    label = [all(cell.strip().casefold() in LABELS for cell in column) for column in columns]
    for layout in filter(lambda layout: len(layout) == width, LAYOUTS):
        score = layout.index("similarity")
        labels = layout.index("genuine") if "genuine" in layout else None
        if numeric[score] and (labels is None or (label[labels] and not label[score])):
            return list(layout)
    _name_the_odd_cell(path, lines)
    raise DatasetError(
        f"what its {width} columns contain is not clear: name them in a first line, such as "
        "probe,reference,genuine,score",
        path=path,
    )


def _name_the_odd_cell(path: Path, lines: Sequence[tuple[int, Cells]]) -> None:
    """Raise a DatasetError where a column of numbers contains something else."""
    first, head = lines[0]
    for k in reversed([k for k, cell in enumerate(head) if _is_number(cell)]):
        for line, row in lines:
            if k >= len(row) or not _is_number(row[k]):
                cell = row[k] if k < len(row) else ""
                raise DatasetError(
                    f"line {line}, column {k + 1}: {cell!r} is not a number, as line {first} has",
                    path=path,
                )


def _is_number(cell: Any) -> bool:
    if str(cell).strip().casefold() in NO_SCORE - {""}:
        return True
    try:
        _number(cell)
    except ValueError:
        return False
    return True


def _number(cell: Any) -> float:
    """Return the number in a cell, with decimal point or comma; raise a ValueError for others."""
    if isinstance(cell, str):
        if "_" in cell:  # which Python takes for a number
            raise ValueError(cell)
        if cell.count(",") == 1 and "." not in cell:
            cell = cell.replace(",", ".")
    return float(cell)


def _rows_of(path: Path) -> Lines:
    """Yield line number and cells of each row; blank lines and comments are left out."""
    if is_parquet(path):
        return _parquet_rows(path)
    return csv_rows(path, DatasetError, spaces=True, exact=True, comments=True)


def _parquet_rows(path: Path) -> Lines:
    try:
        from pyarrow import ArrowException, parquet  # noqa: PLC0415
    except ImportError as error:
        raise DatasetError(_NEEDS_PYARROW, path=path) from error
    line = 1
    try:
        with parquet.ParquetFile(path, page_checksum_verification=True) as file:
            names = file.schema_arrow.names
            yield line, names
            for block in file.iter_batches():
                for row in block.to_pylist():
                    line += 1
                    yield line, ["" if row[name] is None else row[name] for name in names]
            if line - 1 != file.metadata.num_rows:
                raise ValueError("rows are missing")
    except (ArrowException, ValueError, OSError) as error:
        if isinstance(error, OSError) and error.errno is not None:  # of the system, not of Arrow
            raise DatasetError(f"cannot be read: {reason(error)}", path=path) from error
        raise DatasetError("not a Parquet file of scores, or damaged", path=path) from error


def csv_lines(rows: Iterable[Sequence[object]]) -> bytes:
    """Return rows as lines of a CSV file, texts as `fpmatch.printable.csv_cell` has them."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(
        [csv_cell(cell) if isinstance(cell, str) else cell for cell in row] for row in rows
    )
    return text.getvalue().encode()


def failure_reason(probe: str, reference: str) -> str:
    """Return the reason of a row from those why its prints have no template ("": they have one)."""
    sides = {"probe": probe, "reference": reference}
    return "; ".join(f"{side}: {why}" for side, why in sides.items() if why)


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
