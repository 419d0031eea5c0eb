"""One run of `fpmatch score`, from its beginning or from where it was interrupted."""

from __future__ import annotations

import math
from collections import deque
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.gallery.batch.comparer import Comparer
from fpmatch.gallery.batch.decision import outcomes
from fpmatch.gallery.batch.score_file import COLUMNS, csv_lines, failure_reason
from fpmatch.gallery.batch.sources import unpack
from fpmatch.gallery.batch.unfinished import Rows
from fpmatch.matching.decision import DEFAULT_THRESHOLD
from fpmatch.matching.result import is_own

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.batch.plan import PairChunk, Plan
    from fpmatch.gallery.batch.sources import PrintSource
    from fpmatch.gallery.batch.unfinished import Position, Unfinished
    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.engine.workers import Progress
    from fpmatch.gallery.listing.entry import Label
    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Matcher
    from fpmatch.templates.minutiae import Template


COMPARE: Final = "compare"
HEADER: Final = csv_lines([COLUMNS])


class SideRows(NamedTuple):
    """Names and fingers of the prints of one side, why some have no template, and qualities."""

    names: Sequence[str]
    fingers: Sequence[str]
    failures: Mapping[int, str]
    quality: Mapping[int, int]
    labels: Sequence[Label] | None = None  # of a manifest

    @classmethod
    def of(cls, side: PrintSource, store: Unfinished, key: str) -> SideRows:
        """Return what is known of the prints of a side that are stored under a name."""
        failures = store.column(key, "reason", "data IS NULL")
        quality = store.column(key, "quality", "quality IS NOT NULL")
        return cls(side.names, side.fingers, failures, quality, getattr(side, "labels", None))


@dataclass(frozen=True, slots=True)
class RowWriter:
    """Write pairs and their similarities as rows of `fpmatch.gallery.batch.score_file.COLUMNS`.

    Genuine pairs are known if a list states them, both sides are the `same` prints, or both are
    manifests, whose subjects are taken for the same persons. Without a calibration, scores
    are left empty. With a `threshold`, rows of lower scores are left out, but not those of prints
    without a template, whose score is not known. The decision is that at the threshold, by default
    40, or by a share `rho` of paired minutiae.
    """

    matcher: str
    database: str
    probes: SideRows
    references: SideRows
    same: bool
    calibration: Calibration | None
    threshold: float | None
    rho: float | None = None

    def lines(
        self, chunk: PairChunk, similarity: NDArray[np.float64], reachable: NDArray[np.float64]
    ) -> tuple[bytes, int, int]:
        """Return the lines of some pairs, their number, and the number of pairs without a score.

        The similarities are what `compare_pairs` returned.
        """
        failed = np.isnan(similarity)
        score = np.full(len(chunk), np.nan)
        if self.calibration is not None:
            score = self.calibration.scores(similarity)
        kept = np.arange(len(chunk))
        if self.threshold is not None:
            kept = np.flatnonzero(failed | (score >= self.threshold))
        listed = np.full(len(chunk), -1) if chunk.genuine is None else chunk.genuine
        decision = outcomes(
            similarity,
            score,
            reachable,
            calibration=self.calibration,
            rho=self.rho,
            threshold=DEFAULT_THRESHOLD if self.threshold is None else self.threshold,
        )
        columns = (chunk.probe, chunk.reference, listed, similarity, score, decision)
        rows = map(self._row, *(column[kept].tolist() for column in columns))
        return csv_lines(rows), len(kept), int(failed.sum())

    def _row(
        self, i: int, j: int, listed: int, similarity: float, score: float, decision: str
    ) -> tuple[object, ...]:
        probes, references = self.probes, self.references
        genuine = listed if listed >= 0 else self._genuine(i, j)
        reason = ""
        if math.isnan(similarity):
            reason = failure_reason(probes.failures.get(i, ""), references.failures.get(j, ""))
        names = probes.names[i], references.names[j]
        numbers = ["" if math.isnan(value) else value for value in (similarity, score)]
        quality = probes.quality.get(i, ""), references.quality.get(j, "")
        return (self.matcher, self.database, *names, genuine, *numbers, decision, reason, *quality)

    def _genuine(self, i: int, j: int) -> int | str:
        """Return 1 or 0 where the names indicate whether a pair is genuine, else ""."""
        probes, references = self.probes, self.references
        if self.same:
            return int(probes.fingers[i] == references.fingers[j])
        if probes.labels is None or references.labels is None:
            return ""
        one, other = probes.labels[i], references.labels[j]
        if one.subject == other.subject and bool(one.finger) != bool(other.finger):
            return ""
        return int(one.of_finger == other.of_finger)


@dataclass(frozen=True, slots=True)
class ComparisonTask:
    """The pairs of a chunk with the templates they need, in bytes; failed prints have none."""

    pairs: PairChunk
    probes: Mapping[int, bytes]
    references: Mapping[int, bytes]
    names: tuple[Mapping[int, str], Mapping[int, str]] = ({}, {})  # names of probes and references


class BytesComparer(Comparer[bytes]):
    """Compare templates that are kept as bytes."""

    def template(self, key: bytes) -> Template:
        """Return the template that the bytes hold."""
        return unpack(key)


def compare_pairs(comparer: BytesComparer, task: ComparisonTask) -> NDArray[np.float64]:
    """Return the similarity of each pair and the reachable one, shape (2, pairs).

    They are not a number where a print has no template.
    A probe that is paired with all references of the chunk is compared with them at once.
    """
    similarity, reachable = both = np.full((2, len(task.pairs)), np.nan)
    usable = np.isin(task.pairs.reference, list(task.references))
    every = sorted(task.references)
    packed = [task.references[number] for number in every]
    last: tuple[bytes, bytes, float, tuple[str, str]] | None = None
    for probe, data in task.probes.items():
        rows = np.flatnonzero((task.pairs.probe == probe) & usable)
        numbers = task.pairs.reference[rows].tolist()
        references = packed
        names = [task.names[0].get(probe, ""), *(task.names[1].get(k, "") for k in numbers)]
        if numbers == every:
            similarity[rows] = comparer.similarities(data, packed, names)
        else:
            references = [task.references[number] for number in numbers]
            similarity[rows] = comparer.one_by_one(data, references, names)
        if numbers:
            reachable[rows] = comparer.reachable(data, references)
            last = data, references[-1], similarity[rows[-1]], (names[0], names[-1])
    if last is not None:
        comparer.check_repeats(*last)
    return both


def collect(
    store: Unfinished,
    key: str,
    side: PrintSource,
    numbers: Sequence[int],
    engine: Engine,
    progress: Progress,
) -> None:
    """Store the templates of some prints of a side, ascending, that are not stored yet."""
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
    """Compare the pairs of a plan and write their rows."""

    store: Unfinished
    plan: Plan
    probes: str  # name of the side in the store
    references: str
    matcher: Matcher
    writer: RowWriter

    def run(self, engine: Engine, progress: Progress) -> tuple[Position, Position]:
        """Write the rows that are missing, and the file; return the positions before and after."""
        return self.store.write(
            HEADER,
            self.plan.number_of_chunks,
            partial(self._rows, engine),
            lambda position: progress(COMPARE, position.pairs, len(self.plan)),
        )

    def _rows(self, engine: Engine, start: int) -> Generator[Rows, None, None]:
        """Yield the rows of the chunks from number `start` on."""
        pending: deque[PairChunk] = deque()
        tasks = self._tasks(start, pending)
        with closing(engine.map(compare_pairs, BytesComparer(self.matcher), tasks)) as results:
            for similarities in results:
                chunk = pending.popleft()
                lines, rows, failed = self.writer.lines(chunk, *similarities)
                yield Rows(lines, pairs=len(chunk), rows=rows, failed=failed)

    def _tasks(self, start: int, pending: deque[PairChunk]) -> Iterator[ComparisonTask]:
        for chunk in self.plan.chunks(start):
            pending.append(chunk)
            yield self._task(chunk)

    def _task(self, chunk: PairChunk) -> ComparisonTask:
        numbers = [np.unique(side).tolist() for side in (chunk.probe, chunk.reference)]
        sides = zip((self.writer.probes, self.writer.references), numbers, strict=True)
        probes, references = ({k: side.names[k] for k in some} for side, some in sides)
        return ComparisonTask(
            chunk,
            self.store.templates(self.probes, numbers[0]),
            self.store.templates(self.references, numbers[1]),
            ({}, {}) if is_own(self.matcher) else (probes, references),
        )
