"""Compare the chosen pairs of whole databases with one matcher."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.engine.workers import Progress, no_progress, run_chunks
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.finger import Finger

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.engine.engine import Engine
    from fpmatch.evaluation.extraction import ExtractedSet
    from fpmatch.evaluation.protocol import Pairs
    from fpmatch.matching.finger import FingerComparison
    from fpmatch.matching.result import Comparison, Matcher
    from fpmatch.minutiae import Template

PAIRS_PER_CHUNK: Final = 100

# What is kept of each comparison; lengths in pixels of the reference, CPU time in microseconds.
OUTCOME: Final = np.dtype(
    [
        ("similarity", np.float64),
        ("pairs", np.int32),
        ("scale", np.float64),
        ("rotation_deg", np.float64),
        ("tx", np.float64),
        ("ty", np.float64),
        ("rms_px", np.float64),
        ("agreement", np.float64),
        ("overlap", np.float64),
        ("reason", object),
        ("cpu_us", np.float64),
    ]
)
_NOTHING: Final = float("nan")
NO_TEMPLATE: Final = "no template"


@dataclass(slots=True)
class _Bench:
    """Hold all templates, and what the matcher prepared of those of the set at hand.

    `templates` are those of the references and, where they are others, those of the probes.
    `enrolled` is as for `compare_sets`.
    """

    matcher: Matcher
    templates: list[list[list[Template | None]]]
    enrolled: Sequence[Mapping[int, Sequence[int]]] | None = None
    set_at_hand: int = -1
    prepared: dict[tuple[int, int], Any] = field(default_factory=dict)
    fingers_of: int = -1
    fingers: dict[int, Finger | None] = field(default_factory=dict)

    def probe(self, set_index: int, impression: int) -> Any:
        """Return one impression as a probe, prepared; None where it has no template."""
        return self._get(len(self.templates) - 1, set_index, impression)

    def reference(self, set_index: int, impression: int) -> Any:
        """Return one impression as a reference, prepared; None where it has no template.

        Where fingers are enrolled, return the finger for which the impression stands.
        """
        if self.enrolled is None:
            return self._get(0, set_index, impression)
        if set_index != self.fingers_of:
            self.fingers_of = set_index
            self.fingers.clear()
        if impression not in self.fingers:
            templates = self.templates[0][set_index]
            shown = [templates[k] for k in self.enrolled[set_index][impression]]
            kept = [one for one in shown if one is not None]
            curve = load_calibration(self.matcher.name)
            finger = Finger.of(kept, self.matcher, curve) if kept else None
            self.fingers[impression] = finger
        return self.fingers[impression]

    def compare(self, probe: Any, reference: Any) -> Comparison:
        """Compare two impressions, or an impression with a finger, whose score then counts."""
        if self.enrolled is None:
            comparison: Comparison = self.matcher.compare(probe, reference)
            return comparison
        found: FingerComparison = reference.compare(probe)
        return replace(found.comparison, similarity=found.score)

    def _get(self, side: int, set_index: int, impression: int) -> Any:
        if set_index != self.set_at_hand:
            self.set_at_hand = set_index
            self.prepared.clear()
        key = side, impression
        if key not in self.prepared:
            template = self.templates[side][set_index][impression]
            self.prepared[key] = None if template is None else self.matcher.prepare(template)
        return self.prepared[key]


@dataclass(frozen=True, slots=True)
class _Chunk:
    set_index: int
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
    enrolled: Sequence[Mapping[int, Sequence[int]]] | None = None,
) -> list[NDArray[np.void]]:
    """Compare the chosen pairs of every database.

    Parameters
    ----------
    sets : sequence of ExtractedSet
        The databases.
    pairs : sequence of Pairs
        The pairs to compare in each.
    matcher : Matcher
        The matcher; it is sent to the workers, so it must pickle.
    workers : int, optional
        Processes to use (default: one a core).
    engine : Engine, optional
        As for `fpmatch.engine.workers.run_chunks`.
    progress : callable
        Told of stage "compare", in pairs.
    probes : sequence of ExtractedSet, optional
        The same databases, extracted in another way, whose templates are the probes (default: those
        of `sets`).
    enrolled : sequence of mapping of int to sequence of int, optional
        For each database, by the reference of a pair, the impressions that are enrolled with it as
        one finger. The similarity is then the score of the finger, and all else that of its most
        similar impression.

    Returns
    -------
    list of ndarray of `OUTCOME`
        One array a database, in the order of its pairs. Where a side has no template, the
        similarity is 0 and the CPU time not a number.

    Raises
    ------
    MatcherError
        If fingers are enrolled and the matcher has no calibration.
    """
    templates = [
        [[e.template for e in extracted.extractions] for extracted in side]
        for side in ([sets] if probes is None else [sets, probes])
    ]
    chunks = [
        _Chunk(s, p.probe[k : k + PAIRS_PER_CHUNK], p.reference[k : k + PAIRS_PER_CHUNK])
        for s, p in enumerate(pairs)
        for k in range(0, len(p), PAIRS_PER_CHUNK)
    ]
    if enrolled is not None:
        load_calibration(matcher.name)  # so that it is missed here, not in a worker
    total, done = sum(map(len, pairs)), 0

    def finished(chunk: _Chunk) -> None:
        nonlocal done
        done += chunk.probe.size
        progress("compare", done, total)

    progress("compare", 0, total)
    results = run_chunks(
        _compare_chunk,
        _Bench(matcher, templates, enrolled),
        chunks,
        workers=workers,
        engine=engine,
        finished=finished,
    )
    outcomes = np.concatenate(results) if results else np.empty(0, OUTCOME)
    return np.split(outcomes, np.cumsum([len(p) for p in pairs])[:-1])


def _compare_chunk(bench: _Bench, chunk: _Chunk) -> NDArray[np.void]:
    outcomes = np.empty(chunk.probe.size, OUTCOME)
    for row, (i, j) in enumerate(zip(chunk.probe.tolist(), chunk.reference.tolist(), strict=True)):
        probe, reference = bench.probe(chunk.set_index, i), bench.reference(chunk.set_index, j)
        if probe is None or reference is None:
            outcomes[row] = _no_template()
            continue
        start = time.process_time_ns()
        comparison = bench.compare(probe, reference)
        cpu_us = (time.process_time_ns() - start) / 1000.0
        outcomes[row] = _as_outcome(comparison, cpu_us)
    return outcomes


def _as_outcome(comparison: Comparison, cpu_us: float) -> tuple[Any, ...]:
    t = comparison.transform
    moved = (_NOTHING,) * 4 if t is None else (t.scale, t.rotation_deg, t.tx, t.ty)
    return (
        comparison.similarity,
        len(comparison.pairs),
        *moved,
        comparison.rms_px,
        comparison.agreement,
        comparison.overlap,
        comparison.reason,
        cpu_us,
    )


def _no_template() -> tuple[Any, ...]:
    return (0.0, 0, *(_NOTHING,) * 5, 0.0, 0.0, NO_TEMPLATE, _NOTHING)
