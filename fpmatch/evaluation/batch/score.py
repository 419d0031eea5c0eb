"""Scores of whole batches: probes against references, streamed to a file, resumed after a kill."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fpmatch._version import __version__
from fpmatch.engine.engine import serial
from fpmatch.engine.workers import Progress, no_progress
from fpmatch.errors import MatcherError, OutputError, number_text
from fpmatch.evaluation.batch.decision import calibration_of
from fpmatch.evaluation.batch.fingers import check_fingers, write_fingers
from fpmatch.evaluation.batch.pair_list import print_names
from fpmatch.evaluation.batch.plan import AllPairs, ListedPairs, find_identical_pairs
from fpmatch.evaluation.batch.run import Comparing, RowWriter, SideRows, collect
from fpmatch.evaluation.batch.score_file import check_format
from fpmatch.evaluation.batch.sources import open_source
from fpmatch.evaluation.batch.store import Store
from fpmatch.matching.calibration import MAX_SCORE
from fpmatch.matching.matchers import DEFAULT_MATCHER, get_matcher
from fpmatch.output import check_writable
from fpmatch.reading import group_by_note

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fpmatch.engine.engine import Engine
    from fpmatch.evaluation.batch.plan import Plan
    from fpmatch.evaluation.batch.sources import PrintSource
    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Matcher

    AnySource = PrintSource | str | os.PathLike[str]

IDENTICAL_NAMED: Final = 20  # pairs of identical prints that a summary names
REFERENCES: Final = "references"
PROBES: Final = "probes"
_FORMAT: Final = "6"  # of the state of an unfinished run


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
    fingers: Path | None = None
    finger_rows: int | None = None
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
    fingers: str | os.PathLike[str] | None = None,
    dpi: float | None = None,
    engine: Engine | None = None,
    progress: Progress = no_progress,
    save_every_s: float = 0.5,
) -> ScoreSummary:
    """Score probes against references and write a row a pair.

    The rows are the same, byte by byte, with every engine and however often the run was
    interrupted; its state is kept beside the output until that is complete.

    Parameters
    ----------
    references, probes : PrintSource or path-like or str
        Folders of prints, manifests or galleries; see `open_source`.
    output : path-like
        The ``.csv`` or ``.parquet`` to write or replace; see `fpmatch.evaluation.batch.score_file`.
    pairs : path-like or Plan, optional
        A list of the pairs to score (see `ListedPairs`); by default all (see `AllPairs`).
    matcher : str or Matcher
        The matcher, or its name.
    calibration : Calibration, optional
        Turns similarities into scores (default: the package's own for the matcher).
    threshold : float, optional
        Keep only rows whose score is at least this, and those without a score.
    fingers : path-like, optional
        A CSV file for the scores of fingers, too, which need all rows: not with a threshold.
    dpi : float, optional
        Resolution of all images of folders, in dots per inch.
    engine : Engine, optional
        Where the work is done, entered here (default: in this process).
    progress : callable
        Called with the stages "references", "probes" (in prints) and "compare" (in pairs).
    save_every_s : float
        Seconds of work between two saved positions, about.

    Raises
    ------
    ScoringError
        If the list of pairs is malformed, or a different run of this output is unfinished.
    MatcherError
        If the matcher is unknown, or there is a threshold but no calibration, or it is not in
        0..100; or finger scores are requested with a threshold or without a calibration.
    OutputError
        If the output cannot be written.
    FpmatchError
        If a side cannot be opened or the engine broke down.

    Examples
    --------
    >>> from fpmatch.evaluation.batch.score import score
    >>> score("enrolled", "seized", "scores.csv", threshold=40).rows  # doctest: +SKIP
    12
    """
    target = Path(output)
    check_format(target)
    chosen = get_matcher(matcher) if isinstance(matcher, str) else matcher
    calibration = calibration or calibration_of(chosen.name)
    _check_threshold(threshold, calibration, chosen.name)
    sides = {REFERENCES: _opened(references, dpi), PROBES: _opened(probes, dpi)}
    plan = _planned(pairs, sides)
    if fingers is not None:
        if threshold is not None or calibration is None:
            raise MatcherError(
                "scores of fingers need the scores of all their impressions: no threshold, and a "
                "matcher that has a calibration"
            )
        if Path(fingers).resolve() == target.resolve():
            raise OutputError(f"{fingers}: both the scores of pairs and those of fingers")
        check_writable(fingers)
        check_fingers(len(sides[PROBES].names), sides[REFERENCES].fingers)
    run = {
        "format": _FORMAT,
        "version of fpmatch": __version__,
        "matcher": chosen.name,
        "calibration": calibration.as_json() if calibration else "",
        "threshold": repr(threshold),
        "set of references": sides[REFERENCES].content_hash,
        "set of probes": sides[PROBES].content_hash,
        "list of pairs": plan.identity,
    }
    one, other = sides[PROBES], sides[REFERENCES]
    same = (one.place, one.content_hash) == (other.place, other.content_hash)
    needed = {REFERENCES: plan.references, PROBES: plan.probes}
    key = {REFERENCES: REFERENCES, PROBES: PROBES}  # of each side in the store
    if same:
        needed = {REFERENCES: sorted({*plan.references, *plan.probes})}
        key[PROBES] = REFERENCES
    with engine or serial() as place, Store(target, run) as store:
        for name, numbers in needed.items():
            collect(store, name, sides[name], numbers, place, progress)
        failed = {side: store.failures(key[side]) for side in sides}
        assumed = {_full_name(sides[k], n) for k in needed for n in store.assumed(k)}
        noted = group_by_note(
            (_full_name(sides[k], n), notes) for k in needed for n, notes in store.notes(k).items()
        )
        graded = {side: store.qualities(key[side]) for side in sides}
        rows_of = {
            k: SideRows(s.names, s.fingers, failed[k], graded[k], getattr(s, "labels", None))
            for k, s in sides.items()
        }
        comparing = Comparing(
            store=store,
            plan=plan,
            probes=key[PROBES],
            references=key[REFERENCES],
            matcher=chosen,
            writer=RowWriter(
                matcher=chosen.name,
                database=one.title if same else f"{one.title} against {other.title}",
                probes=rows_of[PROBES],
                references=rows_of[REFERENCES],
                same=same,
                calibration=calibration,
                threshold=threshold,
                rho=getattr(chosen, "rho", None) if threshold is None else None,
            ),
            save_every_s=save_every_s,
        )
        probed, referenced = (store.digests(key[side]) for side in (PROBES, REFERENCES))
        identical, first = find_identical_pairs(plan, probed, referenced, IDENTICAL_NAMED)
        begun = time.perf_counter()
        start, end = comparing.run(place, progress)
    finger_rows = None
    if fingers is not None:
        names = one.names, other.names, other.fingers
        finger_rows = write_fingers(target, Path(fingers), *names, same=same)
    return ScoreSummary(
        output=target,
        references=len(plan.references),
        probes=len(plan.probes),
        pairs=end.pairs,
        rows=end.rows,
        resumed=start.pairs,
        failed_pairs=end.failed,
        failures=tuple(failure for k in needed for failure in _failures(k, sides[k], failed[k])),
        dpi_assumed=tuple(sorted(assumed)),
        seconds=time.perf_counter() - begun,
        noted=noted,
        fingers=None if fingers is None else Path(fingers),
        finger_rows=finger_rows,
        identical=identical,
        identical_pairs=tuple((one.names[i], other.names[j]) for i, j in first),
    )


def _failures(name: str, side: PrintSource, failed: dict[int, str]) -> Iterator[ImageFailure]:
    """Yield the prints of a side without a template, and damaged entries without a name."""
    for number, reason in failed.items():
        yield ImageFailure(name, side.names[number], reason)
    for number, why in getattr(side, "damaged", {}).items():
        yield ImageFailure(name, f"entry {number}", f"damaged: {why}")


def _full_name(side: PrintSource, number: int) -> str:
    return f"{side.place}: {side.names[number]}"


def _opened(side: AnySource, dpi: float | None) -> PrintSource:
    return open_source(side, dpi=dpi) if isinstance(side, str | os.PathLike) else side


def _planned(pairs: str | os.PathLike[str] | Plan | None, sides: dict[str, PrintSource]) -> Plan:
    probes, references = sides[PROBES], sides[REFERENCES]
    if pairs is None:
        return AllPairs(len(probes.names), len(references.names))
    if isinstance(pairs, str | os.PathLike):
        names = (print_names(side.place, side.names) for side in (probes, references))
        return ListedPairs(pairs, *names)
    return pairs


def _check_threshold(
    threshold: float | None, calibration: Calibration | None, matcher: str
) -> None:
    if threshold is None:
        return
    if not 0 <= threshold <= MAX_SCORE:
        raise MatcherError(f"threshold must lie in 0..{MAX_SCORE:g}, not {number_text(threshold)}")
    if calibration is None:
        raise MatcherError(
            f"matcher {matcher!r} has no calibration, so its scores cannot be compared with a "
            "threshold; see fpmatch calibrate"
        )
