"""Comparison of the chosen pairs of whole databases, each template prepared once."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.gallery.batch.comparer import NO_TEMPLATE, Comparer
from fpmatch.gallery.engine.workers import Progress, no_progress, run_chunks
from fpmatch.gallery.fingers.finger import Finger
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.result import compare_prepared, named

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.lab.evaluation.databases.extraction import ExtractedSet
    from fpmatch.lab.evaluation.databases.protocol import Pairs
    from fpmatch.matching.result import Comparison, Matcher
    from fpmatch.templates.minutiae import Template

    Sides = Sequence[Sequence[Sequence[Template | None]]]
    Enrolled = Mapping[int, Sequence[int]]

PAIRS_PER_CHUNK: Final = 100

# One comparison; lengths in pixels of the reference, CPU time in microseconds. `reachable` is the
# similarity that half of the genuine comparisons of as much evidence reach.
OUTCOME: Final = np.dtype(
    [
        ("similarity", np.float64),
        ("pairs", np.int32),
        *((name, np.float64) for name in ("scale", "rotation_deg", "tx", "ty", "rms_px")),
        *((name, np.float64) for name in ("agreement", "overlap", "reachable")),
        ("reason", object),
        ("cpu_us", np.float64),
    ]
)


class _ImpressionComparer(Comparer[tuple[int, int, int]]):
    """Compare impressions by side, database and number; `enrolled` as for `compare_sets`.

    `names` are the names of the impressions.
    """

    def __init__(
        self,
        matcher: Matcher,
        sides: Sides,
        enrolled: Sequence[Enrolled] | None,
        names: Sequence[Sequence[str]],
    ) -> None:
        largest = max((sum(map(len, one)) for one in zip(*sides, strict=True)), default=0)
        super().__init__(matcher, capacity=largest)
        self._sides, self._enrolled, self._names = sides, enrolled, names
        self._fingers: dict[tuple[int, int], Finger | None] = {}

    def template(self, key: tuple[int, int, int]) -> Template | None:
        side, database, number = key
        return self._sides[side][database][number]

    def outcome(self, database: int, probe: int, reference: int) -> tuple[Any, ...]:
        """Return a row of `OUTCOME`."""
        try:
            return self._outcome(database, probe, reference)
        except MatcherError as error:
            raise named(error, *self._names_of(database, probe, reference)) from error

    def repeat(self, database: int, probe: int, reference: int, similarity: float) -> None:
        """Raise MatcherError where a plug-in now finds another similarity of a pair."""
        if self._enrolled is None:
            keys = (len(self._sides) - 1, database, probe), (0, database, reference)
            if all(self.template(key) is not None for key in keys):
                names = self._names_of(database, probe, reference)
                self.check_repeats(*keys, similarity, names)

    def _names_of(self, database: int, probe: int, reference: int) -> tuple[str, str]:
        names = self._names[database]
        return names[probe], names[reference]

    def _outcome(self, database: int, probe: int, reference: int) -> tuple[Any, ...]:
        a = self.prepare((len(self._sides) - 1, database, probe))
        b = self._reference(database, reference)
        if a is None or b is None:
            return (0.0, 0, *(math.nan,) * 5, 0.0, 0.0, -math.inf, NO_TEMPLATE, math.nan)
        start = time.process_time_ns()
        c: Comparison
        if isinstance(b, Finger):
            finger = b.compare(a)
            c = replace(finger.comparison, similarity=finger.score)
        else:
            c = compare_prepared(self.matcher, a, b)
        cpu_us = (time.process_time_ns() - start) / 1000.0
        t = c.transform
        moved = (math.nan,) * 4 if t is None else (t.scale, t.rotation_deg, t.tx, t.ty)
        measured = (c.rms_px, c.agreement, c.overlap, math.nan)
        return (c.similarity, len(c.pairs), *moved, *measured, c.reason, cpu_us)

    def reachable_of(
        self, database: int, probe: int, references: Sequence[int]
    ) -> NDArray[np.float64]:
        """Return the reachable similarities with impressions, or with the best of a finger."""
        key = len(self._sides) - 1, database, probe
        shown = [[k] if self._enrolled is None else self._enrolled[database][k] for k in references]
        reachable = self.reachable(key, [(0, database, k) for one in shown for k in one])
        return np.maximum.reduceat(reachable, np.cumsum([0, *map(len, shown)])[:-1])

    def _reference(self, database: int, number: int) -> Any:
        """Return an impression, or the finger for which it stands; None without a template."""
        if self._enrolled is None:
            return self.prepare((0, database, number))
        key = database, number
        if key not in self._fingers:
            shown = [self._sides[0][database][k] for k in self._enrolled[database][number]]
            kept = [template for template in shown if template is not None]
            curve = load_calibration(self.matcher.name)
            self._fingers[key] = Finger.of(kept, self.matcher, curve) if kept else None
        return self._fingers[key]


@dataclass(frozen=True, slots=True)
class _Chunk:
    database: int
    probe: NDArray[np.intp]
    reference: NDArray[np.intp]


def compare_sets(
    sets: Sequence[ExtractedSet],
    pairs: Sequence[Pairs],
    matcher: Matcher,
    *,
    workers: int | None = None,
    engine: Engine | None = None,
    progress: Progress = no_progress,
    probes: Sequence[ExtractedSet] | None = None,
    enrolled: Sequence[Enrolled] | None = None,
) -> list[NDArray[np.void]]:
    """Compare the chosen pairs of every database, one to one; return their `OUTCOME` arrays.

    Where a side has no template, the similarity is 0 and the CPU time not a number. `probes` are
    the same databases, extracted in another way, whose templates are the probes. `enrolled` maps,
    for each database, the reference of a pair to the impressions that are enrolled with it as one
    finger: the similarity is then the score of the finger, and all else that of its most similar
    impression. Raises a `MatcherError` if fingers are enrolled without a calibration. `workers` and
    `engine` are as for `fpmatch.gallery.engine.workers.run_chunks`, and the matcher must pickle.
    """
    sides = [
        [[e.template for e in extracted.extractions] for extracted in side]
        for side in ([sets] if probes is None else [sets, probes])
    ]
    chunks = [
        _Chunk(s, p.probe[k : k + PAIRS_PER_CHUNK], p.reference[k : k + PAIRS_PER_CHUNK])
        for s, p in enumerate(pairs)
        for k in range(0, len(p), PAIRS_PER_CHUNK)
    ]
    if enrolled is not None:
        load_calibration(matcher.name)  # to fail here, not in a worker
    total, done = sum(map(len, pairs)), 0

    def finished(chunk: _Chunk) -> None:
        nonlocal done
        done += chunk.probe.size
        progress("compare", done, total)

    progress("compare", 0, total)
    names = [[one.name for one in extracted.dataset.impressions] for extracted in sets]
    comparer = _ImpressionComparer(matcher, sides, enrolled, names)
    results = run_chunks(
        _compare_chunk, comparer, chunks, workers=workers, engine=engine, finished=finished
    )
    outcomes = np.concatenate(results) if results else np.empty(0, OUTCOME)
    return np.split(outcomes, np.cumsum([len(p) for p in pairs])[:-1])


def _compare_chunk(comparer: _ImpressionComparer, chunk: _Chunk) -> NDArray[np.void]:
    pairs = list(zip(chunk.probe.tolist(), chunk.reference.tolist(), strict=True))
    outcomes = np.array([comparer.outcome(chunk.database, *pair) for pair in pairs], OUTCOME)
    if pairs:
        comparer.repeat(chunk.database, *pairs[-1], outcomes["similarity"][-1])
    for probe in np.unique(chunk.probe).tolist():
        rows = chunk.probe == probe
        references = chunk.reference[rows].tolist()
        outcomes["reachable"][rows] = comparer.reachable_of(chunk.database, probe, references)
    return outcomes
