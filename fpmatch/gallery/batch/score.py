"""Scores of whole batches: probes against references, streamed to a file, resumed after a kill."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch._version import __version__
from fpmatch.gallery.batch.compare import ComparisonTask, PairComparer, Print
from fpmatch.gallery.batch.plan import (
    AllPairs,
    PrintNames,
    find_identical_pairs,
    iterate_pairs,
    listed_pairs,
)
from fpmatch.gallery.batch.score_file import HEADER, check_format
from fpmatch.gallery.batch.sources import open_source
from fpmatch.gallery.batch.unfinished import Unfinished, finished_before, remember
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.matching.calibration import is_calibrated, load_calibration
from fpmatch.matching.decision import Rule
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher
from fpmatch.prints.reading import group_by_note

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator, Sequence

    from fpmatch.gallery.batch.compare import Rows
    from fpmatch.gallery.batch.plan import PairChunk, Plan
    from fpmatch.gallery.batch.sources import PrintSource, StoredTemplate
    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Matcher

    AnySource = PrintSource | str | os.PathLike[str]
    _Stored = dict[str, tuple[PrintSource, Sequence[int]]]  # prints by the name of their side

IDENTICAL_NAMED: Final = 20  # pairs of identical prints that a summary names
REFERENCES: Final = "references"
PROBES: Final = "probes"
COMPARE: Final = "compare"
_FORMAT: Final = "9"  # of the state of an unfinished run


def calibration_of(matcher: str) -> Calibration | None:
    """Return the package's own calibration of a matcher; None where there is none."""
    return load_calibration(matcher) if is_calibrated(matcher) else None


@dataclass(frozen=True, slots=True)
class ImageFailure:
    """Name a print of a side that has no template, and the reason."""

    side: str
    name: str
    reason: str


@dataclass(frozen=True, slots=True)
class ScoreSummary:
    """Counts, failures and times of a run of `score`.

    `references` and `probes` count the prints that were needed, `resumed` the pairs that an
    earlier, interrupted run had compared, and `failed_pairs` the rows without a score because a
    print has no template. `seconds` is the wall time of the comparisons, without extraction.
    `identical` is the number of pairs whose prints have the same frame and minutiae, and
    `identical_pairs` has the names of probe and reference of the first of them.
    """

    output: Path
    references: int
    probes: int
    pairs: int
    rows: int
    resumed: int
    failed_pairs: int
    failures: tuple[ImageFailure, ...]
    dpi_assumed: tuple[str, ...]
    seconds: float
    noted: dict[str, tuple[str, ...]] = field(default_factory=dict)
    identical: int = 0
    identical_pairs: tuple[tuple[str, str], ...] = ()

    @property
    def rate(self) -> float:
        """Comparisons a second of this run; 0 where it made none."""
        made = self.pairs - self.resumed
        return made / self.seconds if made and self.seconds else 0.0


def score(
    references: AnySource,
    probes: AnySource,
    output: str | os.PathLike[str],
    *,
    pairs: str | os.PathLike[str] | Plan | None = None,
    matcher: str | Matcher = DEFAULT_MATCHER,
    calibration: Calibration | None = None,
    threshold: float | None = None,
    engine: Engine | None = None,
    progress: Progress = no_progress,
    once: bool = False,
    lasting: bool = True,
    **reading: Any,
) -> ScoreSummary:
    """Score probes against references and write a row a pair.

    The rows are the same, byte by byte, with every engine and however often the run was
    interrupted; its state is kept beside the output until that is complete.

    The sides are folders of prints, manifests or galleries, and `reading`, as ``dpi=500``, is as
    for `open_source`. The output is a ``.csv`` file. The `pairs` come from a
    list (see `listed_pairs`) or all (see `AllPairs`). Only rows whose score, by the
    `calibration` (default: the package's own for the matcher), reaches the `threshold` are kept,
    and those without a score. The `engine` is entered here (default: this process); `progress`
    is called with the stages "references", "probes" (in prints) and "compare" (in pairs). With
    `once` a finished run is remembered in the user's cache; where its output is there as it was
    written, nothing is done again. `lasting` is as for
    `fpmatch.gallery.batch.unfinished.Unfinished`.

    Raises ScoringError if the list of pairs is malformed, or a different run of this output is
    unfinished; MatcherError if the matcher is unknown, or a threshold does not go with the
    calibration; OutputError if the output cannot be written; other FpmatchErrors if a side
    cannot be opened or the engine broke down.

    Examples
    --------
    >>> from fpmatch.gallery.batch.score import score
    >>> score("enrolled", "seized", "scores.csv", threshold=40).rows  # doctest: +SKIP
    12
    """
    target = Path(output)
    check_format(target)
    chosen = get_matcher(matcher) if isinstance(matcher, str) else matcher
    calibration = calibration or calibration_of(chosen.name)
    if threshold is not None:
        calibration = Rule.of(chosen, threshold, calibration).calibration
    if isinstance(pairs, str | os.PathLike):
        reading["names"] = {name for row in iterate_pairs(pairs) for name in row[1:3]}
    other, one = _opened(references, reading), _opened(probes, reading)
    plan = _planned(pairs, one, other)
    run = {
        "format": _FORMAT,
        "version of fpmatch": __version__,
        "matcher": chosen.name,
        "calibration": calibration.as_json() if calibration else "",
        "threshold": repr(threshold),
        "set of references": other.content_hash,
        "set of probes": one.content_hash,
        "list of pairs": plan.identity,
    }
    if once and (end := finished_before(target, run)) is not None:
        sizes = len(plan.references), len(plan.probes), end.pairs, end.rows, end.pairs, end.failed
        return ScoreSummary(target, *sizes, (), (), 0.0)
    same = (one.place, one.content_hash) == (other.place, other.content_hash)
    stored: _Stored = {REFERENCES: (other, plan.references), PROBES: (one, plan.probes)}
    if same:  # stored once
        stored = {REFERENCES: (other, sorted({*plan.references, *plan.probes}))}
    of_probes = REFERENCES if same else PROBES
    with engine or serial() as place, Unfinished(target, run, lasting=lasting) as store:
        for name, (side, numbers) in stored.items():
            store.collect(name, numbers, partial(side.templates, place), partial(progress, name))
        known = {name: store.prints(name) for name in stored}
        both = known[of_probes], known[REFERENCES]
        identical, first = find_identical_pairs(plan, *both, IDENTICAL_NAMED)
        database = one.title if same else f"{one.title} against {other.title}"
        begun = time.perf_counter()
        comparer = PairComparer(
            chosen, database, same=same, calibration=calibration, threshold=threshold
        )
        sides = (of_probes, one), (REFERENCES, other)

        def rows_from(chunk: int) -> Generator[Rows, None, None]:
            return place.map(PairComparer.rows, comparer, _tasks(store, plan.chunks(chunk), sides))

        start, end = store.write(
            HEADER, rows_from, lambda at: progress(COMPARE, at.pairs, len(plan))
        )
    if once:
        remember(target, run, end)
    return ScoreSummary(
        output=target,
        references=len(plan.references),
        probes=len(plan.probes),
        pairs=end.pairs,
        rows=end.rows,
        resumed=start.pairs,
        failed_pairs=end.failed,
        seconds=time.perf_counter() - begun,
        identical=identical,
        identical_pairs=tuple((one.names[i], other.names[j]) for i, j in first),
        **_about_prints(stored, known),
    )


def _about_prints(stored: _Stored, known: dict[str, dict[int, StoredTemplate]]) -> dict[str, Any]:
    """Return what a summary states about the prints that a run has read."""
    failures: list[ImageFailure] = []
    assumed = set[str]()
    noted: list[tuple[str, tuple[str, ...]]] = []
    for name, (side, _) in stored.items():
        for number, one in known[name].items():
            place = f"{side.place}: {side.names[number]}"
            if one.reason:
                failures.append(ImageFailure(name, side.names[number], one.reason))
            if one.dpi_assumed:
                assumed.add(place)
            noted.append((place, one.notes))
        for number, why in getattr(side, "damaged", {}).items():
            failures.append(ImageFailure(name, f"entry {number}", f"damaged: {why}"))
    return {
        "failures": tuple(failures),
        "dpi_assumed": tuple(sorted(assumed)),
        "noted": group_by_note(noted),
    }


def _tasks(
    store: Unfinished, chunks: Iterator[PairChunk], sides: Sequence[tuple[str, PrintSource]]
) -> Iterator[ComparisonTask]:
    """Yield chunks of pairs with their prints, each print of a chunk once."""
    for chunk in chunks:
        needed = [np.unique(side).tolist() for side in (chunk.probe, chunk.reference)]
        prints: dict[str, dict[int, Print]] = {}
        for (key, side), numbers in zip(sides, needed, strict=True):
            kept = prints.setdefault(key, {})
            labels = getattr(side, "labels", None)
            for n, one in store.prints(key, [n for n in numbers if n not in kept]).items():
                label = None if labels is None else labels[n]
                kept[n] = Print(side.names[n], side.fingers[n], label, one)
        yield ComparisonTask(
            chunk,
            *(
                {n: prints[key][n] for n in some}
                for (key, _), some in zip(sides, needed, strict=True)
            ),
        )


def _opened(side: AnySource, reading: dict[str, Any]) -> PrintSource:
    return open_source(side, **reading) if isinstance(side, str | os.PathLike) else side


def _planned(
    pairs: str | os.PathLike[str] | Plan | None, probes: PrintSource, references: PrintSource
) -> Plan:
    if pairs is None:
        return AllPairs(len(probes.names), len(references.names))
    if isinstance(pairs, str | os.PathLike):
        names = (PrintNames(side.place, side.names) for side in (probes, references))
        return listed_pairs(pairs, *names)
    return pairs
