"""A run that writes rows to a file, and is resumed from where it was interrupted.

The folder ``OUTPUT.unfinished`` holds the rows so far, ``rows.csv``, and ``state.db``: which run it
is, the templates of both sides, and the position that the rows have reached. Rows beyond that
position, written when the run was killed, are cut off and made again.
"""

from __future__ import annotations

import json
import os
import shutil
import sqlite3
import time
from contextlib import closing, contextmanager
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from fpmatch.base.folders import create_private, make_private
from fpmatch.base.output import make_missing, reason
from fpmatch.errors import EncryptionError, OutputError, ScoringError
from fpmatch.gallery.batch.score_file import convert_to_parquet, is_parquet
from fpmatch.gallery.encryption.keys import given_source, load_keys
from fpmatch.gallery.encryption.records import is_sealed, key_id_of, seal, unseal

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
    from pathlib import Path
    from typing import BinaryIO, Self

    from fpmatch.gallery.batch.sources import StoredTemplate

SUFFIX: Final = ".unfinished"
ROWS_FILE: Final = "rows.csv"
STATE_FILE: Final = "state.db"
SAVE_EVERY_S: Final = 0.5  # of work between two saved positions, about
_PURPOSE: Final = b"unfinished batch"
_NUMBERS_PER_QUERY: Final = 500
_TABLES: Final = """
CREATE TABLE IF NOT EXISTS run (what TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS position (chunks INT, pairs INT, rows INT, bytes INT, failed INT);
CREATE TABLE IF NOT EXISTS item (
    side TEXT, number INT, data BLOB, reason TEXT NOT NULL, dpi_assumed INT NOT NULL,
    notes TEXT NOT NULL, quality INT, digest BLOB NOT NULL, PRIMARY KEY (side, number)
) WITHOUT ROWID;
"""


class Position(NamedTuple):
    """The position that a run has reached."""

    chunks: int = 0
    pairs: int = 0
    rows: int = 0  # that were written
    size: int = 0  # of the rows, in bytes
    failed: int = 0  # rows without a score


class Rows(NamedTuple):
    """The rows of a chunk, as lines of a file: how many pairs and rows, and how many failed."""

    lines: bytes
    pairs: int
    rows: int
    failed: int


class Unfinished:
    """Keep an unfinished run on disk; a context manager that leaves it there.

    A run of another description than `run` cannot resume it. Raises a `ScoringError` if a different
    run is unfinished there, it is damaged, or another one is running now; an `OutputError` if
    nothing can be written there.
    """

    def __init__(self, output: Path, run: Mapping[str, str]) -> None:
        self.output = output
        self.folder = output.with_name(output.name + SUFFIX)
        self._rows_file = self.folder / ROWS_FILE
        self._keys = load_keys() if given_source() else None
        with self._writing():
            if output.is_dir():
                raise OutputError(f"{output}: cannot be written: it is a folder")
            make_missing(self.folder)
            create_private(self.folder / STATE_FILE)
            for path in (self.folder, self.folder / STATE_FILE):
                make_private(path)
            self._database = sqlite3.connect(self.folder / STATE_FILE, timeout=0)
            try:
                self._begin(run)
            except BaseException:
                self._database.close()
                raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._database.close()

    def _begin(self, run: Mapping[str, str]) -> None:
        self._database.execute("PRAGMA secure_delete = ON")
        # One run at a time; the system releases the lock of a run that was killed.
        self._database.execute("PRAGMA locking_mode = EXCLUSIVE")
        self._database.execute("BEGIN EXCLUSIVE")
        self._database.commit()
        self._database.executescript(_TABLES)
        kept = self._database.execute("SELECT what FROM run").fetchone()
        if kept is None:
            with self._database:
                self._database.execute("INSERT INTO run VALUES (?)", [json.dumps(dict(run))])
                self._database.execute("INSERT INTO position VALUES (0, 0, 0, 0, 0)")
            return
        try:
            other = dict(json.loads(kept[0]))
        except (ValueError, TypeError) as error:
            raise self._damaged() from error
        differing = [key for key in {**run, **other} if run.get(key) != other.get(key)]
        if differing:
            raise ScoringError(
                f"{self.folder}: an unfinished run, but with another {differing[0]}; finish it as "
                "it was started, or delete the folder"
            )

    @property
    def position(self) -> Position:
        """The position that the run has reached."""
        with self._writing():
            return Position(*self._database.execute("SELECT * FROM position").fetchone())

    def write(
        self,
        header: bytes,
        number_of_chunks: int,
        rows_from: Callable[[int], Generator[Rows, None, None]],
        report: Callable[[Position], object],
    ) -> tuple[Position, Position]:
        """Write the rows that are missing, and the file; return the positions before and after.

        `rows_from` yields the rows of the chunks from the number given on, and `report` is called
        with each position.
        """
        position = start = self.position
        in_place = start.chunks == number_of_chunks and not self._rows_file.exists()
        if not self._rows_file.exists() and not (in_place and self._has_size(start.size)):
            position = start = Position()
            in_place = False
        report(start)
        if not in_place:  # by a run that was killed before it cleared up
            with closing(self._write(header, start, rows_from)) as positions:
                for position in positions:
                    report(position)
            self._finish()
        with self._writing():
            self._database.close()
            shutil.rmtree(self.folder)
        return start, position

    def _has_size(self, size: int) -> bool:
        """Return whether the output has the size of all rows; a Parquet file has another."""
        if not self.output.is_file():
            return False
        return is_parquet(self.output) or self.output.stat().st_size == size

    def _write(
        self,
        header: bytes,
        start: Position,
        rows_from: Callable[[int], Generator[Rows, None, None]],
    ) -> Generator[Position, None, None]:
        position, saved_at = start, time.monotonic()
        with self._opened_rows(start.size) as stream, closing(rows_from(start.chunks)) as chunks:
            if start == Position():
                stream.write(header)
                position = Position(size=len(header))
            try:
                for lines, pairs, rows, failed in chunks:
                    stream.write(lines)
                    position = Position(
                        chunks=position.chunks + 1,
                        pairs=position.pairs + pairs,
                        rows=position.rows + rows,
                        size=position.size + len(lines),
                        failed=position.failed + failed,
                    )
                    if time.monotonic() - saved_at >= SAVE_EVERY_S:
                        self._save(stream, position)
                        saved_at = time.monotonic()
                    yield position
            finally:
                self._save(stream, position)

    @contextmanager
    def _opened_rows(self, size: int) -> Iterator[BinaryIO]:
        """Open the file of rows, cut off after `size` bytes, to write more."""
        with self._writing():
            create_private(self._rows_file)
            make_private(self._rows_file)
            with self._rows_file.open("r+b") as stream:
                if stream.seek(0, os.SEEK_END) < size:
                    raise self._damaged()
                stream.truncate(size)
                stream.seek(size)
                yield stream

    def _save(self, stream: BinaryIO, position: Position) -> None:
        """Save the position that the run has reached, once its rows are on the disk."""
        flush(stream)
        with self._writing(), self._database:
            what = "UPDATE position SET chunks = ?, pairs = ?, rows = ?, bytes = ?, failed = ?"
            self._database.execute(what, position)

    def _finish(self) -> None:
        """Put the file in place."""
        rows = self._rows_file
        with self._writing():
            if is_parquet(self.output):
                rows = rows.with_suffix(self.output.suffix)
                convert_to_parquet(self._rows_file, rows)
            make_private(rows)
            rows.replace(self.output)
            self._rows_file.unlink(missing_ok=True)

    def count_items(self, side: str) -> int:
        """Return the number of stored prints of a side, which are the first of those needed."""
        return len(self.column(side, "number"))

    def add_items(
        self, side: str, items: Iterable[tuple[int, StoredTemplate]]
    ) -> Generator[int, None, None]:
        """Store prints of a side with their numbers; yield the number of each."""
        query = "INSERT INTO item VALUES (?, ?, ?, ?, ?, ?, ?, ?)"
        committed = time.monotonic()
        try:
            for number, item in items:
                data = item.data
                if data is not None and self._keys is not None:
                    bound = _place(side, number)
                    data = seal(self._keys.current, data, purpose=_PURPOSE, bound=bound)
                beside = item.reason, item.dpi_assumed, json.dumps(item.notes)
                with self._writing():
                    row = (side, number, data, *beside, item.quality, item.digest)
                    self._database.execute(query, row)
                    if time.monotonic() - committed >= SAVE_EVERY_S:
                        self._database.commit()
                        committed = time.monotonic()
                yield number
        finally:
            with self._writing():
                self._database.commit()

    def templates(self, side: str, numbers: Sequence[int]) -> dict[int, bytes]:
        """Return the stored templates of some prints, as bytes; without prints that have none."""
        templates: dict[int, bytes] = {}
        for k in range(0, len(numbers), _NUMBERS_PER_QUERY):
            part = ",".join(map(str, numbers[k : k + _NUMBERS_PER_QUERY]))
            templates |= self.column(side, "data", f"data IS NOT NULL AND number IN ({part})")
        return {n: self._unsealed(side, n, data) for n, data in templates.items()}

    def _unsealed(self, side: str, number: int, data: bytes) -> bytes:
        if not is_sealed(data):
            return data
        try:
            keys = self._keys or load_keys(key_id=key_id_of(data))
            return unseal(keys, data, purpose=_PURPOSE, bound=_place(side, number))
        except EncryptionError as error:
            raise ScoringError(f"{self.folder}: {error}", code=error.code) from error

    def column(self, side: str, column: str, which: str = "1") -> dict[int, Any]:
        """Return a column of those prints of a side for which a condition holds, by number."""
        query = f"SELECT number, {column} FROM item WHERE side = ? AND {which} ORDER BY number"
        with self._writing():
            return dict(self._database.execute(query, [side]).fetchall())

    def _damaged(self) -> ScoringError:
        return ScoringError(f"{self.folder}: damaged; delete the folder and start again")

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Turn errors of the disk and the database into errors of one line."""
        try:
            yield
        except OSError as error:
            raise OutputError(f"{self.output}: cannot be written: {reason(error)}") from error
        except sqlite3.Error as error:
            match getattr(error, "sqlite_errorname", ""):
                case "SQLITE_BUSY":
                    why = f"{self.folder}: another run is writing this output"
                    raise ScoringError(why) from error
                case "SQLITE_FULL" | "SQLITE_IOERR_WRITE" | "SQLITE_READONLY" | "SQLITE_CANTOPEN":
                    raise OutputError(f"{self.output}: cannot be written: {error}") from error
            raise self._damaged() from error


def _place(side: str, number: int) -> tuple[bytes, ...]:
    """Return what an encrypted template is bound to."""
    return side.encode(), str(number).encode()


def flush(stream: BinaryIO) -> None:
    """Write buffered rows to the disk."""
    stream.flush()
    os.fsync(stream.fileno())
