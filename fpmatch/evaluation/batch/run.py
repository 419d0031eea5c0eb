"""One scoring from its beginning, or from where it was ended, to its file."""

from __future__ import annotations

import time
from collections import deque
from contextlib import closing
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.evaluation.batch.compare import Bench, ComparisonTask, compare_pairs
from fpmatch.evaluation.batch.rows import HEADER, is_parquet, write_parquet
from fpmatch.evaluation.batch.store import Position, flush

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


def collect(
    store: Store,
    key: str,
    side: PrintSource,
    numbers: Sequence[int],
    engine: Engine,
    progress: Progress,
) -> None:
    """Bring the templates of a side into the store, but for those that are there already.

    Parameters
    ----------
    store : Store
        Where to.
    key : str
        The side's name in the store, and of the stage that `progress` is told of.
    side : PrintSource
        The side.
    numbers : sequence of int
        Those of its prints that are needed, ascending.
    engine : Engine
        Where templates are extracted.
    progress : callable
        Told of the prints.
    """
    start = store.count_items(key)
    missing = numbers[start:]
    progress(key, start, len(numbers))
    if missing:
        with (
            closing(side.items(engine, missing)) as items,
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
        Holds the templates, and how far the rows have come.
    plan : Plan
        The pairs.
    probes, references : str
        Names of the two sides in the store.
    matcher : Matcher
        The matcher; it is sent to the workers.
    writer : RowWriter
        Puts rows into words.
    save_every_s : float
        Seconds of work that a kill may cost, about.
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
        start = self._found()
        position = start
        progress(COMPARE, start.pairs, len(self.plan))
        if not self._is_in_place(start):
            with closing(self._write(start, engine)) as positions:
                for position in positions:
                    progress(COMPARE, position.pairs, len(self.plan))
            self._finish()
        self.store.clear()
        return start, position

    def _found(self) -> Position:
        """Return how far an earlier run came: nowhere, where its rows have gone."""
        position = self.store.position
        if self.store.rows_file.exists() or self._is_in_place(position):
            return position
        return Position()

    def _is_in_place(self, position: Position) -> bool:
        """Tell whether a run was ended when its file was in place, but not all cleared up."""
        output = self.store.output
        return (
            position.chunks == self.plan.number_of_chunks
            and not self.store.rows_file.exists()
            and output.is_file()
            and output.stat().st_size == position.size
        )

    def _write(self, start: Position, engine: Engine) -> Generator[Position, None, None]:
        position, saved_at = start, time.monotonic()
        under_way: deque[PairChunk] = deque()
        tasks = self._tasks(start.chunks, under_way)
        with (
            self.store.rows(start.size) as stream,
            closing(engine.map(compare_pairs, Bench(self.matcher), tasks)) as results,
        ):
            if start == Position():
                stream.write(HEADER)
                position = replace(position, size=len(HEADER))
            try:
                for similarity in results:
                    chunk = under_way.popleft()
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

    def _tasks(self, start: int, under_way: deque[PairChunk]) -> Iterator[ComparisonTask]:
        for chunk in self.plan.chunks(start):
            under_way.append(chunk)
            yield ComparisonTask(
                chunk,
                self.store.templates(self.probes, np.unique(chunk.probe).tolist()),
                self.store.templates(self.references, np.unique(chunk.reference).tolist()),
            )

    def _finish(self) -> None:
        """Put the file in its place."""
        rows = self.store.rows_file
        if is_parquet(self.store.output):
            table = rows.with_suffix(self.store.output.suffix)
            with self.store.writing():
                write_parquet(rows, table)
            rows = table
        self.store.put_in_place(rows)
