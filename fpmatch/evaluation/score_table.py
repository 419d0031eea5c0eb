"""Tables of scores, of fpmatch or of another program: which column contains what.

The table is CSV (comma, semicolon or tab), columns separated by spaces, or Parquet. Columns are
recognised by their names, see `COLUMN_NAMES`, or, in a file without a first line of names, by their
number and by what they contain; see `_guess`. Lines that begin with ``#`` are comments, in CSV
only those before the first row.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch.errors import DatasetError
from fpmatch.gallery.csv_rows import csv_rows
from fpmatch.output import reason

if TYPE_CHECKING:
    import os

Cells = list[Any]
Lines = Iterator[tuple[int, Cells]]

COLUMN_NAMES: Final[Mapping[str, tuple[str, ...]]] = {
    "matcher": (),
    "set": (),
    "probe": ("probe_template_id", "probe_reference_id", "probe_key", "test_label", "key", "query"),
    "reference": ("bio_ref_template_id", "bio_ref_reference_id", "model_label", "gallery"),
    "probe_finger": ("probe_subject_id", "probe_subject", "real_id"),
    "reference_finger": ("bio_ref_subject_id", "reference_subject", "claimed_id"),
    "genuine": ("label", "mated"),
    "impostor": ("nonmated",),
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
    **dict.fromkeys(("0", "impostor", "nonmated", "non-mated", "false", "nonmatch"), "0"),
}
"""What a column genuine may contain."""
NO_SCORE: Final = frozenset({"", "nan", "na", "none", "null"})
PARQUET: Final = ".parquet"
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
        with _errors_of(self.path):
            for line, row in self.rows:
                if len(row) > width:
                    raise DatasetError(
                        f"line {line}, column {width + 1}: {len(row)} columns instead of {width}",
                        path=self.path,
                    )
                row.extend([""] * (width - len(row)))
                yield line, [row[k] if k >= 0 else "" for k in places]


def open_table(path: str | os.PathLike[str], *, last: bool = False) -> ScoreTable:
    """Open a file of scores; raise a `DatasetError` if it cannot be read or understood.

    With `last`, the last column of a file without names of columns contains the scores.
    """
    source = Path(path)
    rows = _rows_of(source)
    with _errors_of(source):
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
    with _errors_of(Path(path)):
        _, head = next(rows, (0, []))
        if missing := [name for name in columns if name not in head]:
            raise DatasetError(f"not a file of scores: no column {missing[0]!r}", path=path)
    places = {name: head.index(name) for name in columns}
    yield from ScoreTable(Path(path), places, head, rows).cells(columns)


def number(cell: Any) -> float:
    """Return the number in a cell, with decimal point or comma; raise a ValueError for others."""
    if isinstance(cell, str):
        if "_" in cell:  # which Python takes for a number
            raise ValueError(cell)
        if cell.count(",") == 1 and "." not in cell:
            cell = cell.replace(",", ".")
    return float(cell)


def is_parquet(path: Path) -> bool:
    """Return whether the name of a file is that of a Parquet file."""
    return path.suffix.lower() == PARQUET


def _by_name(head: Cells) -> dict[str, int]:
    """Return the places of the columns with known names; those of similarity win over scores."""
    known = {name: role for role, names in COLUMN_NAMES.items() for name in (*names, role)}
    found: dict[str, int] = {}
    for k, cell in enumerate(head):
        name = str(cell).strip().casefold().replace(" ", "_")
        role = known.get(name)
        if role is not None and (role not in found or name == role):
            found[role] = k
    return found


def _check_names(path: Path, line: int, head: Cells, places: Mapping[str, int]) -> None:
    """Raise a DatasetError unless there is a column of scores."""
    if not places.keys() & {"similarity", "distance"} and not {"genuine", "impostor"} <= set(
        places
    ):
        raise DatasetError(
            f"line {line}: not a file of scores: no column 'similarity', 'score' or 'distance' "
            f"among {', '.join(map(repr, map(str, head)))}",
            path=path,
        )


def _guess(path: Path, lines: Sequence[tuple[int, Cells]]) -> list[str]:
    """Return what the columns of a file without names contain.

    One: scores. Two: a score and whether the pair is genuine, in either order. Three: probe,
    reference, score, or score first (as NIST's bozorth3 prints them). Four: probe, reference, and
    score and genuine in either order; else claimed_id, real_id, test_label, score (bob). Five:
    claimed_id, model_label, real_id, test_label, score (bob).
    """
    rows = [row for _, row in lines]
    width = len(rows[0])
    columns = [[str(row[k]) if k < len(row) else "" for row in rows] for k in range(width)]
    numeric = [all(_is_number(cell) for cell in column) for column in columns]
    label = [all(cell.strip().casefold() in LABELS for cell in column) for column in columns]
    score = [n and not is_label for n, is_label in zip(numeric, label, strict=True)]
    names = ["probe", "reference"]
    if width == 1 and numeric[0]:
        return ["similarity"]
    if width == 2 and label[1] and not label[0] and numeric[0]:
        return ["similarity", "genuine"]
    if width == 2 and label[0] and not label[1] and numeric[1]:
        return ["genuine", "similarity"]
    if width == 3 and numeric[2]:
        return [*names, "similarity"]
    if width == 3 and numeric[0]:
        return ["similarity", *names]
    if width == 4 and label[3] and score[2]:
        return [*names, "similarity", "genuine"]
    if width == 4 and label[2] and score[3]:
        return [*names, "genuine", "similarity"]
    if width == 4 and numeric[3]:
        return ["reference_finger", "probe_finger", "probe", "similarity"]
    if width == 5 and numeric[4]:
        return ["reference_finger", "reference", "probe_finger", "probe", "similarity"]
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
        number(cell)
    except ValueError:
        return False
    return True


def _rows_of(path: Path) -> Lines:
    """Yield line number and cells of each row; blank lines and comments are left out."""
    if is_parquet(path):
        return _parquet_rows(path)
    return csv_rows(path, DatasetError, spaces=True, exact=True, comments=True)


def _parquet_rows(path: Path) -> Lines:
    try:
        from pyarrow import ArrowException, parquet  # noqa: PLC0415
    except ImportError as error:
        raise DatasetError(
            "Parquet needs pyarrow: pip install 'fpmatch[parquet]'", path=path
        ) from error
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
        if getattr(error, "errno", None) is not None:  # of the system, not of Arrow
            raise
        raise DatasetError("not a Parquet file of scores, or damaged", path=path) from error


@contextmanager
def _errors_of(path: Path) -> Iterator[None]:
    """Name the file in errors of reading it."""
    try:
        yield
    except OSError as error:
        raise DatasetError(f"cannot be read: {reason(error)}", path=path) from error
