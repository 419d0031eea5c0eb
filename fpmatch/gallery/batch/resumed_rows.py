"""Rows of a run, written to a file from where an earlier, interrupted run has come."""

from __future__ import annotations

import time
from contextlib import closing
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple
from zlib import crc32

from fpmatch.base.folders import make_private
from fpmatch.gallery.batch.score_file import convert_to_parquet, is_parquet
from fpmatch.gallery.batch.store import Position, are_rows_of, flush

if TYPE_CHECKING:
    from collections.abc import Callable, Generator

    from fpmatch.gallery.batch.store import Store


SAVE_EVERY_S: Final = 0.5  # of work between two saved positions, about


class Rows(NamedTuple):
    """The rows of a chunk, as lines of a file: how many pairs and rows, and how many failed."""

    lines: bytes
    pairs: int
    rows: int
    failed: int


@dataclass(frozen=True, slots=True)
class ResumedRows:
    """Write a header and the rows of `number_of_chunks`; save the position now and then."""

    store: Store
    header: bytes
    number_of_chunks: int

    def write(
        self,
        rows_from: Callable[[int], Generator[Rows, None, None]],
        report: Callable[[Position], object],
    ) -> tuple[Position, Position]:
        """Write the rows that are missing, and the file; return the positions before and after.

        `rows_from` yields the rows of the chunks from the number given on, and `report` is called
        with each position.
        """
        position = start = self._saved_position()
        report(start)
        if not self._is_in_place(start):
            with closing(self._write(start, rows_from)) as positions:
                for position in positions:
                    report(position)
            self._finish()
        self.store.clear()
        return start, position

    def _saved_position(self) -> Position:
        """Return the position of an earlier run; the start if its rows are missing."""
        position = self.store.position
        is_there = self.store.rows_file.exists() or self._is_in_place(position)
        return position if is_there else Position()

    def _is_in_place(self, position: Position) -> bool:
        """Return whether an earlier run put its file in place without clearing up."""
        output = self.store.output
        if position.chunks != self.number_of_chunks or self.store.rows_file.exists():
            return False
        if not output.is_file():
            return False
        with self.store.writing(), output.open("rb") as stream:
            return are_rows_of(position, stream)

    def _write(
        self, start: Position, rows_from: Callable[[int], Generator[Rows, None, None]]
    ) -> Generator[Position, None, None]:
        position, saved_at = start, time.monotonic()
        with self.store.rows(start) as stream, closing(rows_from(start.chunks)) as chunks:
            if start == Position():
                stream.write(self.header)
                position = Position(size=len(self.header), checksum=crc32(self.header))
            try:
                for lines, pairs, rows, failed in chunks:
                    stream.write(lines)
                    position = position.after(lines, pairs=pairs, rows=rows, failed=failed)
                    if time.monotonic() - saved_at >= SAVE_EVERY_S:
                        flush(stream)
                        self.store.advance(position)
                        saved_at = time.monotonic()
                    yield position
            finally:
                flush(stream)
                self.store.advance(position)

    def _finish(self) -> None:
        """Put the file in place."""
        rows = self.store.rows_file
        if is_parquet(self.store.output):
            table = rows.with_suffix(self.store.output.suffix)
            with self.store.writing():
                convert_to_parquet(rows, table)
            rows = table
        with self.store.writing():
            make_private(rows)
            rows.replace(self.store.output)
