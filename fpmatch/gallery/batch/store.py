"""The state of an unfinished `fpmatch score` beside its output, from which it is resumed.

The folder ``OUTPUT.unfinished`` holds the rows so far, ``rows.csv``, and ``state.db``: which run it
is, the templates of both sides, and the position that the rows have reached. Rows beyond that
position, written when the run was killed, are cut off and made again. All is resumed only where
its checksums are right: a damaged run must be started again.
"""

from __future__ import annotations

import json
import os
import shutil
import sqlite3
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final, NamedTuple
from zlib import crc32

from fpmatch.base.folders import create_private, make_private
from fpmatch.base.output import make_missing, reason
from fpmatch.base.parsing import ParseError, parse_json
from fpmatch.errors import EncryptionError, OutputError, ScoringError
from fpmatch.gallery.encryption.keys import given_source, keys_for, load_keys
from fpmatch.gallery.encryption.records import is_sealed, key_id_of, seal, unseal

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
    from pathlib import Path
    from typing import BinaryIO, Self

    from fpmatch.gallery.batch.sources import StoredTemplate

SUFFIX: Final = ".unfinished"
ROWS_FILE: Final = "rows.csv"
STATE_FILE: Final = "state.db"
_PURPOSE: Final = b"unfinished batch"
_COMMIT_EVERY_S: Final = 0.5
_NUMBERS_PER_QUERY: Final = 500
_BLOCK: Final = 1 << 20  # bytes that are read at once
_START_AGAIN: Final = "delete the folder and start again"
# The tables are of one form, and a number of a print is stored once: all else is damage.
_DAMAGED: Final = ("SQLITE_NOTADB", "SQLITE_CORRUPT", "SQLITE_ERROR", "SQLITE_CONSTRAINT")
_TABLES: Final = """
CREATE TABLE IF NOT EXISTS run (what TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS position (
    chunks INT, pairs INT, rows INT, bytes INT, failed INT, rows_checksum INT, checksum INT
);
CREATE TABLE IF NOT EXISTS item (
    side TEXT, number INT, data BLOB, reason TEXT NOT NULL, dpi_assumed INT NOT NULL,
    notes TEXT NOT NULL, quality INT, digest BLOB NOT NULL, checksum INT NOT NULL,
    PRIMARY KEY (side, number)
) WITHOUT ROWID;
"""


class Position(NamedTuple):
    """The position that a run has reached."""

    chunks: int = 0
    pairs: int = 0
    rows: int = 0  # that were written
    size: int = 0  # of the rows, in bytes
    failed: int = 0  # rows without a score
    checksum: int = 0  # of the rows, CRC-32

    def after(self, lines: bytes, *, pairs: int, rows: int, failed: int) -> Position:
        """Return the position after the rows of one more chunk."""
        return Position(
            chunks=self.chunks + 1,
            pairs=self.pairs + pairs,
            rows=self.rows + rows,
            size=self.size + len(lines),
            failed=self.failed + failed,
            checksum=crc32(lines, self.checksum),
        )


class Store:
    """Keep an unfinished run on disk; a context manager that leaves it there.

    A run of another description than `run` cannot resume it. Raises a `ScoringError` if a different
    run is unfinished there, or another one is running now, and an `OutputError` if nothing can be
    written there.
    """

    def __init__(self, output: Path, run: Mapping[str, str]) -> None:
        self.output = output
        self.folder = output.with_name(output.name + SUFFIX)
        self.rows_file = self.folder / ROWS_FILE
        self._keys = load_keys() if given_source() else None
        with self.writing():
            if output.is_dir():
                raise OutputError(f"{output}: cannot be written: it is a folder")
            make_missing(self.folder)
            create_private(self.folder / STATE_FILE)
            for path in (self.folder, self.folder / STATE_FILE):
                make_private(path)
            self._database = sqlite3.connect(self.folder / STATE_FILE, timeout=0)
            self._database.execute("PRAGMA secure_delete = ON")
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
        # One run at a time; the system releases the lock of a run that was killed.
        self._database.execute("PRAGMA locking_mode = EXCLUSIVE")
        self._database.execute("BEGIN EXCLUSIVE")
        self._database.commit()
        self._database.executescript(_TABLES)
        kept = self._database.execute("SELECT what FROM run").fetchone()
        if kept is None:
            with self._database:
                self._database.execute("INSERT INTO run VALUES (?)", [json.dumps(dict(run))])
                self._insert_position(Position())
            return
        try:
            other = dict(parse_json(kept[0]))
        except (ValueError, TypeError, AttributeError) as error:
            raise self._damaged() from error
        differing = [key for key in {**run, **other} if run.get(key) != other.get(key)]
        if differing:
            raise ScoringError(
                f"{self.folder}: an unfinished run, but with another {differing[0]}; finish it as "
                "it was started, or delete the folder"
            )
        for row in self._database.execute("SELECT * FROM item"):
            if row[-1] != _checksum(row[:-1]):
                raise self._damaged()

    def _damaged(self) -> ScoringError:
        return ScoringError(f"{self.folder}: damaged; {_START_AGAIN}")

    @property
    def position(self) -> Position:
        """The position that the run has reached."""
        with self.writing():
            rows = self._database.execute("SELECT * FROM position").fetchall()
            if len(rows) != 1 or rows[0][-1] != _checksum(rows[0][:-1]):
                raise self._damaged()
            return Position(*rows[0][:-1])

    def advance(self, position: Position) -> None:
        """Save the position that the run has reached; its rows must be on disk."""
        with self.writing(), self._database:
            self._database.execute("DELETE FROM position")
            self._insert_position(position)

    def _insert_position(self, position: Position) -> None:
        row = (*position, _checksum(position))
        self._database.execute("INSERT INTO position VALUES (?, ?, ?, ?, ?, ?, ?)", row)

    @contextmanager
    def rows(self, position: Position) -> Iterator[BinaryIO]:
        """Open the file of rows, cut off after those of a position, to write more."""
        size = position.size
        with self.writing():
            create_private(self.rows_file)
            make_private(self.rows_file)
        with self.writing(), self.rows_file.open("r+b" if size else "w+b") as stream:
            if stream.seek(0, os.SEEK_END) < size:
                raise ScoringError(f"{self.rows_file}: cut short; {_START_AGAIN}")
            stream.truncate(size)
            stream.seek(0)
            if not are_rows_of(position, stream):
                raise ScoringError(f"{self.rows_file}: damaged; {_START_AGAIN}")
            yield stream

    def count_items(self, side: str) -> int:
        """Return the number of stored prints of a side, which are the first of those needed."""
        with self.writing():
            query = "SELECT count(*) FROM item WHERE side = ?"
            return int(self._database.execute(query, [side]).fetchone()[0])

    def add_items(
        self, side: str, items: Iterable[tuple[int, StoredTemplate]]
    ) -> Generator[int, None, None]:
        """Store prints of a side with their numbers; yield the number of each."""
        query = "INSERT INTO item VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)"
        committed = time.monotonic()
        try:
            for number, item in items:
                with self.writing():
                    notes = json.dumps(item.notes) if item.notes else ""
                    beside = item.reason, int(item.dpi_assumed), notes, item.quality, item.digest
                    row = side, number, self._sealed(side, number, item.data), *beside
                    self._database.execute(query, (*row, _checksum(row)))
                    if time.monotonic() - committed >= _COMMIT_EVERY_S:
                        self._database.commit()
                        committed = time.monotonic()
                yield number
        finally:
            with self.writing():
                self._database.commit()

    def templates(self, side: str, numbers: Sequence[int]) -> dict[int, bytes]:
        """Return the templates, in bytes, of those of some prints that have one."""
        templates: dict[int, bytes] = {}
        for k in range(0, len(numbers), _NUMBERS_PER_QUERY):
            part = ",".join(map(str, numbers[k : k + _NUMBERS_PER_QUERY]))
            stored = self._items(side, "data", f"data IS NOT NULL AND number IN ({part})")
            templates |= {
                number: self._opened(side, number, data) for number, data in stored.items()
            }
        return templates

    def _sealed(self, side: str, number: int, data: bytes | None) -> bytes | None:
        """Return a template as it is stored: encrypted, where a key was given."""
        if data is None or self._keys is None:
            return data
        return seal(self._keys.current, data, purpose=_PURPOSE, bound=_place(side, number))

    def _opened(self, side: str, number: int, data: bytes) -> bytes:
        """Return a stored template as it was."""
        if not is_sealed(data):
            return data
        try:
            keys = self._keys or keys_for(key_id_of(data))
            return unseal(keys, data, purpose=_PURPOSE, bound=_place(side, number))
        except EncryptionError as error:
            if error.code == "damaged":
                raise self._damaged() from error
            raise ScoringError(f"{self.folder}: {error}", code=error.code) from error

    def failures(self, side: str) -> dict[int, str]:
        """Return the reasons of the prints of a side that have no template, by number."""
        return self._items(side, "reason", "data IS NULL")

    def assumed(self, side: str) -> list[int]:
        """Return the numbers of the prints of a side whose resolution was assumed."""
        return list(self._items(side, "dpi_assumed", "dpi_assumed"))

    def notes(self, side: str) -> dict[int, list[str]]:
        """Return the notes on reading prints of a side, by number."""
        stored = self._items(side, "notes", "notes != ''")
        try:
            parsed = {number: parse_json(notes) for number, notes in stored.items()}
        except (TypeError, ParseError) as error:
            raise self._damaged() from error
        for notes in parsed.values():
            if not isinstance(notes, list) or not all(isinstance(note, str) for note in notes):
                raise self._damaged()
        return parsed

    def qualities(self, side: str) -> dict[int, int]:
        """Return the quality of the images of a side, by number."""
        return self._items(side, "quality", "quality IS NOT NULL")

    def digests(self, side: str) -> dict[int, bytes]:
        """Return the digests of the prints of a side that have minutiae, by number."""
        return self._items(side, "digest", "digest != x''")

    def _items(self, side: str, column: str, which: str) -> dict[int, Any]:
        """Return a column of those prints of a side for which a condition holds, by number."""
        query = f"SELECT number, {column} FROM item WHERE side = ? AND {which} ORDER BY number"
        with self.writing():
            return dict(self._database.execute(query, [side]).fetchall())

    def clear(self) -> None:
        """Delete the folder."""
        with self.writing():
            self._database.close()
            shutil.rmtree(self.folder)

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Turn errors of the disk and the database into errors of one line."""
        try:
            yield
        except OSError as error:
            raise OutputError(f"{self.output}: cannot be written: {reason(error)}") from error
        except (sqlite3.Error, UnicodeDecodeError) as error:
            code = getattr(error, "sqlite_errorname", "")
            if code == "SQLITE_BUSY":
                raise ScoringError(f"{self.folder}: another run is writing this output") from error
            if code == "" or code.startswith(_DAMAGED):
                raise self._damaged() from error
            raise OutputError(f"{self.output}: cannot be written: {error}") from error


def _place(side: str, number: int) -> tuple[bytes, ...]:
    """Return what an encrypted template is bound to."""
    return side.encode(), str(number).encode()


def are_rows_of(position: Position, stream: BinaryIO) -> bool:
    """Return whether the rest of a file is the rows of a position."""
    checksum = size = 0
    while block := stream.read(_BLOCK):
        checksum, size = crc32(block, checksum), size + len(block)
    return (size, checksum) == (position.size, position.checksum)


def _checksum(values: Sequence[object]) -> int:
    """Return the CRC-32 of values of a row, of which some may be bytes."""
    data = b"".join(value for value in values if isinstance(value, bytes))
    others = [None if isinstance(value, bytes) else value for value in values]
    return crc32(data, crc32(ascii((len(data), others)).encode()))


def flush(stream: BinaryIO) -> None:
    """Write buffered rows to the disk."""
    stream.flush()
    os.fsync(stream.fileno())
