"""One run of `fpmatch score`, from its beginning or from where it was interrupted."""

from __future__ import annotations

import time
from collections import deque
from contextlib import closing
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.evaluation.batch.compare import BytesComparer, ComparisonTask, compare_pairs
from fpmatch.evaluation.batch.store import Position, flush
from fpmatch.evaluation.score_file import COLUMNS, convert_to_parquet, csv_lines, is_parquet

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator, Sequence

    from fpmatch.engine.engine import Engine
    from fpmatch.engine.workers import Progress
    from fpmatch.evaluation.batch.plan import PairChunk, Plan
    from fpmatch.evaluation.batch.rows import RowWriter
    from fpmatch.evaluation.batch.sources import PrintSource
    from fpmatch.evaluation.batch.store import Store
    from fpmatch.matching.result import Matcher

COMPARE: Final = "compare"
HEADER: Final = csv_lines([COLUMNS])


def collect(
    store: Store,
    key: str,
    side: PrintSource,
    numbers: Sequence[int],
    engine: Engine,
    progress: Progress,
) -> None:
    """Store the templates of some prints of a side, ascending, that are not stored yet.

    `key` names the side in the store, and the stage for `progress`.
    """
    start = store.count_items(key)
    missing = numbers[start:]
    progress(key, start, len(numbers))
    if missing:
        with (
            closing(side.templates(engine, missing)) as items,
            closing(store.add_items(key, zip(missing, items, strict=True))) as added,
        ):
            for done, _ in enumerate(added, start + 1):
                progress(key, done, len(numbers))


@dataclass(frozen=True, slots=True)
class Comparing:
    """Compare the pairs of a plan and write their rows.

    Parameters
    ----------
    store : Store
        Holds the templates, and the position that the rows have reached.
    plan : Plan
        The pairs.
    probes, references : str
        Names of the two sides in the store.
    matcher : Matcher
        The matcher; it is sent to the workers.
    writer : RowWriter
        Writes the rows.
    save_every_s : float
        Seconds of work between two saved positions, about.
    """

    store: Store
    plan: Plan
    probes: str
    references: str
    matcher: Matcher
    writer: RowWriter
    save_every_s: float

    def run(self, engine: Engine, progress: Progress) -> tuple[Position, Position]:
        """Write the rows that are missing, and the file; return the positions before and after."""
        start = self._saved_position()
        position = start
        progress(COMPARE, start.pairs, len(self.plan))
        if not self._is_in_place(start):
            with closing(self._write(start, engine)) as positions:
                for position in positions:
                    progress(COMPARE, position.pairs, len(self.plan))
            self._finish()
        self.store.clear()
        return start, position

    def _saved_position(self) -> Position:
        """Return the position of an earlier run; the start if its rows are missing."""
        position = self.store.position
        if self.store.rows_file.exists() or self._is_in_place(position):
            return position
        return Position()

    def _is_in_place(self, position: Position) -> bool:
        """Return whether an earlier run put its file in place without clearing up."""
        output = self.store.output
        return (
            position.chunks == self.plan.number_of_chunks
            and not self.store.rows_file.exists()
            and output.is_file()
            and output.stat().st_size == position.size
        )

    def _write(self, start: Position, engine: Engine) -> Generator[Position, None, None]:
        position, saved_at = start, time.monotonic()
        pending: deque[PairChunk] = deque()
        tasks = self._tasks(start.chunks, pending)
        with (
            self.store.rows(start.size) as stream,
            closing(engine.map(compare_pairs, BytesComparer(self.matcher), tasks)) as results,
        ):
            if start == Position():
                stream.write(HEADER)
                position = replace(position, size=len(HEADER))
            try:
                for similarity in results:
                    chunk = pending.popleft()
                    lines, rows, failed = self.writer.lines(chunk, similarity)
                    stream.write(lines)
                    position = Position(
                        chunks=position.chunks + 1,
                        pairs=position.pairs + len(chunk),
                        rows=position.rows + rows,
                        size=position.size + len(lines),
                        failed=position.failed + failed,
                    )
                    if time.monotonic() - saved_at >= self.save_every_s:
                        flush(stream)
                        self.store.advance(position)
                        saved_at = time.monotonic()
                    yield position
            finally:
                flush(stream)
                self.store.advance(position)

    def _tasks(self, start: int, pending: deque[PairChunk]) -> Iterator[ComparisonTask]:
        for chunk in self.plan.chunks(start):
            pending.append(chunk)
            yield ComparisonTask(
                chunk,
                self.store.templates(self.probes, np.unique(chunk.probe).tolist()),
                self.store.templates(self.references, np.unique(chunk.reference).tolist()),
            )

    def _finish(self) -> None:
        """Put the file in place."""
        rows = self.store.rows_file
        if is_parquet(self.store.output):
            table = rows.with_suffix(self.store.output.suffix)
            with self.store.writing():
                convert_to_parquet(rows, table)
            rows = table
        self.store.put_in_place(rows)
