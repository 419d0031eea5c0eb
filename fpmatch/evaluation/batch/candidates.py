"""Candidate lists of many probes in a file: searched on an engine, resumed after a kill."""

from __future__ import annotations

import hashlib
import time
from collections import deque
from contextlib import closing
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

from fpmatch._version import __version__
from fpmatch.engine.engine import serial
from fpmatch.engine.workers import Progress, no_progress
from fpmatch.evaluation.batch.candidate_rows import ProbeRows, candidate_file
from fpmatch.evaluation.batch.resumed_rows import ResumedRows, Rows
from fpmatch.evaluation.batch.sources import unpack
from fpmatch.evaluation.batch.store import Store
from fpmatch.gallery.candidates import identify_entries
from fpmatch.gallery.identify import candidate_list_size, check_limits
from fpmatch.gallery.search import ConsolidatedFingers
from fpmatch.gallery.search_pieces import batch_size, hold_search, searched_in_stages
from fpmatch.indexing.loss import DEFAULT_LOSS
from fpmatch.matching.calibration import load_calibration
from fpmatch.reading import group_by_note

if TYPE_CHECKING:
    import os
    from collections.abc import Generator, Iterator, Mapping, Sequence

    from fpmatch.engine.engine import Engine
    from fpmatch.evaluation.batch.sources import FolderSource, StoredTemplate
    from fpmatch.gallery.entry import Entry
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.identify import Identification
    from fpmatch.gallery.indexed_pieces import HeldIndexedSearch
    from fpmatch.gallery.prepared_search import CandidateListSize, Search
    from fpmatch.gallery.search_pieces import HeldSearch
    from fpmatch.matching.calibration import Calibration
    from fpmatch.templates.minutiae import Template

Listed = Literal["subjects", "fingers", "impressions"]

IDENTIFY: Final = "identify"
_FORMAT: Final = "2"  # of the state of an unfinished run


@dataclass(frozen=True, slots=True)
class Identified:
    """The outcome for one probe: `result` is None where it has no template.

    `entries` are those of the candidates; `number` is that of the probe among all.
    """

    number: int
    probe: StoredTemplate
    result: Identification | None = None
    entries: Sequence[Entry] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchOptions:
    """State what a search for a probe lists; see `fpmatch.gallery.identify.identify`."""

    count: int = 10
    threshold: float = 0.0
    listed: Listed = "subjects"
    consolidate: bool = False
    candidate_list: CandidateListSize = "auto"
    calibration: Calibration | None = None
    transforms: bool = False
    loss: float = DEFAULT_LOSS


@dataclass(frozen=True, slots=True)
class SearchSummary:
    """Counts, failures and times of a run of `write_candidates`.

    `resumed` and `failed` count probes: those of an earlier, interrupted run, and those without a
    template. `failures` are the paths and reasons of the latter in this run; `seconds` is the wall
    time of extraction and searches.
    """

    output: Path
    probes: int
    rows: int
    resumed: int
    failed: int
    failures: tuple[tuple[str, str], ...]
    noted: Mapping[str, tuple[str, ...]]
    seconds: float

    @property
    def rate(self) -> float:
        """Probes a second of this run; 0 where it searched for none."""
        made = self.probes - self.resumed
        return made / self.seconds if made and self.seconds else 0.0


def write_candidates(
    gallery: Gallery,
    search: Search,
    probes: FolderSource,
    output: str | os.PathLike[str],
    options: SearchOptions,
    *,
    content: str,
    engine: Engine | None = None,
    progress: Progress = no_progress,
    save_every_s: float = 0.5,
) -> SearchSummary:
    """Search for many probes and write their candidates.

    The file is the same, byte by byte, with every engine and however often the run was
    interrupted; its state is kept beside the output until that is complete.

    Parameters
    ----------
    gallery : Gallery
        The open gallery; its audit, if it keeps one, records each search.
    search : Search
        Of this gallery, from `fpmatch.gallery.search.open_search`.
    probes : FolderSource
        The prints to identify.
    output : path-like
        The ``.csv`` or ``.jsonl`` to write or replace; see
        `fpmatch.evaluation.batch.candidate_rows`.
    options : SearchOptions
        What is listed.
    content : str
        The gallery's `content_hash` from before the search was opened: a run of another content is
        not resumed.
    engine : Engine, optional
        Where the work is done, entered here (default: in this process).
    progress : callable
        Called with stage "identify" and numbers of probes.
    save_every_s : float
        Seconds of work between two saved positions, about.

    Raises
    ------
    ScoringError
        If a different run of this output is unfinished.
    MatcherError
        As `fpmatch.gallery.identify.identify`.
    OutputError
        If the output cannot be written.
    FpmatchError
        If the gallery cannot be read or the engine broke down.
    """
    target = Path(output)
    form = candidate_file(
        target, gallery=gallery.name, matcher=search.matcher.name, listed=options.listed
    )
    impressions = options.listed == "impressions"
    check_limits(
        options.count,
        options.threshold,
        options.loss,
        impressions=impressions,
        consolidated=options.consolidate,
    )
    staged = searched_in_stages(search, options.candidate_list)
    search = search if staged else search.whole
    candidate_list_size(search, options.candidate_list)  # before a file is made
    curve = options.calibration or load_calibration(search.matcher.name)
    run = {
        "format": _FORMAT,
        "version of fpmatch": __version__,
        "matcher": search.matcher.name,
        "calibration": curve.as_json(),
        "number of candidates": repr(options.count),
        "threshold": repr(options.threshold),
        "list": repr((options.listed, options.consolidate, options.transforms)),
        "candidate list": repr(options.candidate_list),
        "loss": repr(options.loss if staged else None),
        "gallery": gallery.name,
        "content of the gallery": content,
        "set of probes": probes.content_hash,
        "paths of the probes": hashlib.sha256(repr(probes.paths).encode()).hexdigest(),
    }
    size, total = batch_size(len(search), staged=staged), len(probes.paths)
    failures: list[tuple[str, str]] = []
    noted: list[tuple[str, tuple[str, ...]]] = []

    def rows_from(start: int) -> Generator[Rows, None, None]:
        with (
            hold_search(place, search, options.candidate_list) as held,
            closing(identify_each(gallery, held, probes, options, place, start * size)) as each,
        ):
            while batch := list(islice(each, size)):
                lines: list[bytes] = []
                for one in batch:
                    path = probes.paths[one.number]
                    if one.result is None:
                        failures.append((path, one.probe.reason))
                    noted.append((path, one.probe.all_notes))
                    lines += form.lines(ProbeRows(path, one.result, one.entries, one.probe.reason))
                failed = sum(one.result is None for one in batch)
                yield Rows(b"".join(lines), len(batch), len(lines), failed)

    with engine or serial() as place, Store(target, run) as store:
        begun = time.perf_counter()
        rows = ResumedRows(store, form.header, -(-total // size), save_every_s)
        start, end = rows.write(rows_from, lambda at: progress(IDENTIFY, at.pairs, total))
    return SearchSummary(
        output=target,
        probes=total,
        rows=end.rows,
        resumed=start.pairs,
        failed=end.failed,
        failures=tuple(failures),
        noted=group_by_note(noted),
        seconds=time.perf_counter() - begun,
    )


def identify_each(
    gallery: Gallery,
    held: HeldSearch | HeldIndexedSearch,
    probes: FolderSource,
    options: SearchOptions,
    engine: Engine,
    start: int = 0,
) -> Generator[Identified, None, None]:
    """Yield the outcome for each probe from number `start` on, in order.

    Templates are extracted and compared by the workers of an engine, which is entered and holds the
    search; the audit of the gallery records each search before it is yielded.
    """
    search = held.search
    curve = options.calibration or load_calibration(search.matcher.name)
    consolidated = ConsolidatedFingers(gallery, search, curve) if options.consolidate else None
    staged = searched_in_stages(search, options.candidate_list)
    size = batch_size(len(search), staged=staged)
    pending: deque[list[tuple[int, StoredTemplate, Template | None]]] = deque()

    def batches(templates: Iterator[StoredTemplate]) -> Iterator[list[Any]]:
        numbered = enumerate(templates, start)
        while batch := list(islice(numbered, size)):
            pending.append([(k, *_opened(one)) for k, one in batch])
            yield [search.matcher.prepare(t) for _, _, t in pending[-1] if t is not None]

    limits: dict[str, Any] = {
        "count": options.count,
        "candidate_list": options.candidate_list,
        "loss": options.loss,
    }
    # a comparison with the consolidated template may raise a score
    least = 0.0 if options.consolidate else options.threshold
    with (
        closing(probes.templates(engine, range(start, len(probes.paths)))) as templates,
        closing(held.answers(batches(templates), threshold=least, **limits)) as answered,
    ):
        for answers in answered:
            left = iter(answers)
            for number, stored, template in pending.popleft():
                if template is None:
                    yield Identified(number, stored)
                    continue
                result, entries = identify_entries(
                    gallery,
                    held.answered(next(left)),
                    template,
                    by_subject=options.listed == "subjects",
                    impressions=options.listed == "impressions",
                    threshold=options.threshold,
                    transforms=options.transforms,
                    calibration=curve,
                    consolidated=consolidated,
                    workers=1,
                    **limits,
                )
                found = [candidate.number for candidate in result.candidates]
                gallery.record(IDENTIFY, probe=Path(probes.paths[number]), candidates=found)
                yield Identified(number, stored, result, entries)


def _opened(stored: StoredTemplate) -> tuple[StoredTemplate, Template | None]:
    """Return a probe with its template, None where it has none."""
    return stored, None if stored.data is None else unpack(stored.data)
