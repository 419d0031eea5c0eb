"""A run that writes rows to a file, and is resumed from where it was interrupted.

The folder ``OUTPUT.unfinished`` holds the rows so far, ``rows.csv``, and ``state.db``: which run it
is, the templates of both sides, and the position that the rows have reached. Rows beyond that
position, written when the run was killed, are cut off and made again.

Of runs that have finished, the user's cache has a small file for each output: the digest of what
described the run, size and time of the output, and the position at its end.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import sqlite3
import time
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from fpmatch.base.folders import create_private, make_private
from fpmatch.base.output import atomic_write_bytes, make_missing, reason
from fpmatch.errors import EncryptionError, OutputError, ScoringError
from fpmatch.gallery.batch.sources import StoredTemplate
from fpmatch.gallery.encryption.keys import given_source, load_keys
from fpmatch.gallery.encryption.records import is_sealed, key_id_of, seal, unseal

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
    from typing import BinaryIO, Self

    from fpmatch.gallery.batch.compare import Rows

SUFFIX: Final = ".unfinished"
ROWS_FILE: Final = "rows.csv"
STATE_FILE: Final = "state.db"
SAVE_EVERY_S: Final = 0.5  # of work between two saved positions, about
_PURPOSE: Final = b"unfinished batch"
_TABLES: Final = (
    """CREATE TABLE IF NOT EXISTS run (
    what TEXT NOT NULL, chunks INT, pairs INT, rows INT, bytes INT, failed INT)""",
    """CREATE TABLE IF NOT EXISTS item (
    side TEXT, number INT, data BLOB, reason TEXT NOT NULL, dpi_assumed INT NOT NULL,
    notes TEXT NOT NULL, quality INT, digest BLOB NOT NULL, PRIMARY KEY (side, number)
    ) WITHOUT ROWID""",
)


class Position(NamedTuple):
    """The position that a run has reached."""

    chunks: int = 0
    pairs: int = 0
    rows: int = 0  # that were written
    size: int = 0  # of the rows, in bytes
    failed: int = 0  # rows without a score


class Unfinished:
    """Keep an unfinished run on disk; a context manager that leaves it there.

    A run of another description than `run` cannot resume it. One that is not `lasting` never waits
    for the disk, and does not outlive a failure of the machine. Raises a `ScoringError` if a
    different run is unfinished there, it is damaged, or another one is running now; an
    `OutputError` if nothing can be written there.
    """

    def __init__(self, output: Path, run: Mapping[str, str], *, lasting: bool = True) -> None:
        self.output, self._lasting = output, lasting
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
        if not self._lasting:
            self._database.execute("PRAGMA synchronous = OFF")
        # One run at a time; the system releases the lock of a run that was killed.
        self._database.execute("PRAGMA locking_mode = EXCLUSIVE")
        with self._database:
            self._database.execute("BEGIN EXCLUSIVE")
            for table in _TABLES:
                self._database.execute(table)
            kept = self._database.execute("SELECT what FROM run").fetchone()
            if kept is None:
                begun = json.dumps(dict(run)), *Position()
                self._database.execute("INSERT INTO run VALUES (?, ?, ?, ?, ?, ?)", begun)
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

    def write(
        self,
        header: bytes,
        rows_from: Callable[[int], Generator[Rows, None, None]],
        report: Callable[[Position], object],
    ) -> tuple[Position, Position]:
        """Write the rows that are missing, and the file; return the positions before and after.

        `rows_from` yields the rows of the chunks from the number given on, and `report` is called
        with each position.
        """
        with self._writing():
            start = Position(*self._database.execute("SELECT * FROM run").fetchone()[1:])
        if start.size and not self._rows_file.exists():  # put in place by a run that was killed
            start = Position()
            self._set_position(start)
        report(start)
        position, saved_at = start, time.monotonic()
        with self._opened_rows(start.size) as stream, closing(rows_from(start.chunks)) as chunks:
            try:
                if not start.size:
                    stream.write(header)
                    position = Position(size=len(header))
                for lines, pairs, rows, failed in chunks:
                    stream.write(lines)
                    made = 1, pairs, rows, len(lines), failed
                    position = Position(*map(sum, zip(position, made, strict=True)))
                    if time.monotonic() - saved_at >= SAVE_EVERY_S:
                        self._save(stream, position)
                        saved_at = time.monotonic()
                    report(position)
            except BaseException:
                self._save(stream, position)
                raise
            flush(stream, self._lasting)
        with self._writing():
            self._rows_file.replace(self.output)
            self._database.close()
            shutil.rmtree(self.folder)
        return start, position

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
        flush(stream, self._lasting)
        self._set_position(position)

    def _set_position(self, position: Position) -> None:
        with self._writing(), self._database:
            what = "UPDATE run SET chunks = ?, pairs = ?, rows = ?, bytes = ?, failed = ?"
            self._database.execute(what, position)

    def collect(
        self,
        side: str,
        numbers: Sequence[int],
        templates: Callable[[Sequence[int]], Generator[StoredTemplate, None, None]],
        report: Callable[[int, int], object],
    ) -> None:
        """Store the templates of some prints of a side, ascending, that are not stored yet.

        `report` is called with the number of those that are, and of all.
        """
        query = "SELECT COUNT(*) FROM item WHERE side = ?"
        with self._writing():
            (start,) = self._database.execute(query, [side]).fetchone()
        saved_at = time.monotonic()
        report(start, len(numbers))
        missing = numbers[start:]
        if not missing:
            return
        with closing(templates(missing)) as items:
            try:
                for done, (number, item) in enumerate(zip(missing, items, strict=True), start + 1):
                    with self._writing():
                        self._add(side, number, item)
                        if time.monotonic() - saved_at >= SAVE_EVERY_S:
                            self._database.commit()
                            saved_at = time.monotonic()
                    report(done, len(numbers))
            finally:
                with self._writing():
                    self._database.commit()

    def _add(self, side: str, number: int, item: StoredTemplate) -> None:
        data = item.data
        if data is not None and self._keys is not None:
            bound = _place(side, number)
            data = seal(self._keys.current, data, purpose=_PURPOSE, bound=bound)
        beside = item.reason, item.dpi_assumed, json.dumps(item.notes), item.quality, item.digest
        query = "INSERT INTO item VALUES (?, ?, ?, ?, ?, ?, ?, ?)"
        self._database.execute(query, (side, number, data, *beside))

    def prints(self, side: str, numbers: Sequence[int] | None = None) -> dict[int, StoredTemplate]:
        """Return stored prints of a side, by number: some, or all of them without their data."""
        data, which = "NULL", "1"
        if numbers is not None:
            data, which = "data", f"number IN ({','.join(map(str, numbers))})"
        columns = f"number, {data}, reason, dpi_assumed, notes, quality, digest"
        query = f"SELECT {columns} FROM item WHERE side = ? AND {which} ORDER BY number"
        with self._writing():
            rows = self._database.execute(query, [side]).fetchall()
        prints = {}
        for number, data, why, dpi_assumed, notes, quality, digest in rows:
            known = why, bool(dpi_assumed), tuple(json.loads(notes)), quality, digest
            prints[number] = StoredTemplate(self._unsealed(side, number, data), *known)
        return prints

    def _unsealed(self, side: str, number: int, data: bytes | None) -> bytes | None:
        if data is None or not is_sealed(data):
            return data
        try:
            keys = self._keys or load_keys(key_id=key_id_of(data))
            return unseal(keys, data, purpose=_PURPOSE, bound=_place(side, number))
        except EncryptionError as error:
            raise ScoringError(f"{self.folder}: {error}", code=error.code) from error

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


def flush(stream: BinaryIO, lasting: bool) -> None:
    """Write buffered rows, and wait for the disk where they are lasting."""
    stream.flush()
    if lasting:
        os.fsync(stream.fileno())


def remember(output: Path, run: Mapping[str, str], end: Position) -> None:
    """Note that a run has written its output, if anything can be written into the cache."""
    with suppress(OSError, OutputError):
        noted = {**_state(output, run), "end": list(end)}
        atomic_write_bytes(_note_of(output), json.dumps(noted).encode())


def finished_before(output: Path, run: Mapping[str, str]) -> Position | None:
    """Return the position at the end of the same run, if its output is there as it was written."""
    with suppress(OSError, ValueError, KeyError, TypeError):
        noted = json.loads(_note_of(output).read_bytes())
        end = Position(*noted.pop("end"))
        if noted == _state(output, run):
            return end
    return None


def _note_of(output: Path) -> Path:
    from platformdirs import user_cache_path  # noqa: PLC0415

    name = hashlib.sha256(bytes(output.resolve())).hexdigest()[:32]
    return Path(user_cache_path("fpmatch"), "finished", f"{name}.json")


def _state(output: Path, run: Mapping[str, str]) -> dict[str, Any]:
    status = output.stat()
    digest = hashlib.sha256(json.dumps(dict(run), sort_keys=True).encode()).hexdigest()
    return {"run": digest, "size": status.st_size, "time": status.st_mtime_ns}
