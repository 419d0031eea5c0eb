"""Candidate lists of many probes in a file: searched on an engine, resumed after a kill.

A CSV file has the columns `COLUMNS`: a row for each candidate of a probe, best first, and one row
without a candidate, but with the reason, for a probe that has none or has no template. Each line of
a file of JSON lines is what ``fpmatch identify --json`` prints for one probe, but for the time and
the damaged entries, and with the same reason.
"""

from __future__ import annotations

import hashlib
import time
from collections import deque
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch._version import __version__
from fpmatch.errors import ImageReadError, OutputError
from fpmatch.gallery.batch.compare import Rows
from fpmatch.gallery.batch.score_file import csv_lines
from fpmatch.gallery.batch.sources import unpack
from fpmatch.gallery.batch.unfinished import Unfinished, finished_before, remember
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.gallery.search.entries import BATCH, identify_each
from fpmatch.gallery.search.identification import OF_SEARCHES
from fpmatch.gallery.search.probes import sha256_of
from fpmatch.printable import json_text
from fpmatch.prints.reading import group_by_note

if TYPE_CHECKING:
    import os
    from collections.abc import Generator, Iterator, Mapping, Sequence

    from fpmatch.gallery.batch.sources import FolderSource, StoredTemplate
    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.listing.entry import Entry
    from fpmatch.gallery.search.identification import Identification
    from fpmatch.gallery.search.search import Search, SearchOptions
    from fpmatch.templates.minutiae import Template

IDENTIFY: Final = "identify"
_FORMAT: Final = "4"  # of the state of an unfinished run
OF_CANDIDATES: Final = (
    *("rank", "id", "subject", "finger", "impression", "source", "score", "fmr", "extrapolated"),
    *("expected_false_matches", "impressions", "impression_score"),
)
COLUMNS: Final = ("probe", *OF_CANDIDATES, *OF_SEARCHES, "reason")
NO_CANDIDATE: Final = "no candidate"
JSON_LINES: Final = ".jsonl"
FORMATS: Final = (".csv", JSON_LINES)


@dataclass(frozen=True, slots=True)
class Identified:
    """The outcome for a probe: `result` is None where there is no template, with the reason.

    `entries` are those of the candidates.
    """

    path: str
    reason: str
    notes: tuple[str, ...]
    result: Identification | None = None
    entries: Sequence[Entry] = ()


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
    once: bool = False,
) -> SearchSummary:
    """Search for many probes and write their candidates.

    The file is the same, byte by byte, with every engine and however often the run was
    interrupted; its state is kept beside the output until that is complete.

    The `search` is of the open `gallery`, whose audit, if it keeps one, records each search, and
    `content` is the gallery's `content_hash` from before the search was opened: a run of another
    content is not resumed. The `engine` is entered here (default: this process); `progress` is
    called with stage "identify" and numbers of probes; `once` is as for
    `fpmatch.gallery.batch.score.score`.

    Raises ScoringError if a different run of this output is unfinished; OutputError if the output
    cannot be written; MatcherError as `fpmatch.gallery.search.identify.identify`; other
    FpmatchErrors if the gallery cannot be read or the engine broke down.
    """
    target = Path(output)
    check_candidates_format(target)
    about = {"gallery": gallery.name, "matcher": search.matcher.name, "listed": options.listed}
    options = options.checked(search.matcher)
    run = _description(search, options) | {
        "gallery": gallery.name,
        "content of the gallery": content,
        "set of probes": probes.content_hash,
        "paths of the probes": hashlib.sha256(repr(probes.paths).encode()).hexdigest(),
    }
    total = len(probes.paths)
    if once and (end := finished_before(target, run)) is not None:
        return SearchSummary(target, total, end.rows, end.pairs, end.failed, (), {}, 0.0)
    failures: list[tuple[str, str]] = []
    noted: list[tuple[str, tuple[str, ...]]] = []

    def rows_from(start: int) -> Generator[Rows, None, None]:
        with closing(
            identify_probes(gallery, search, probes, options, place, start * BATCH)
        ) as each:
            while batch := list(islice(each, BATCH)):
                failed = [(one.path, one.reason) for one in batch if one.result is None]
                failures.extend(failed)
                noted.extend((one.path, one.notes) for one in batch)
                if is_json_lines(target):
                    lines = [_json_line(one, about) for one in batch]
                else:
                    lines = [csv_lines([row]) for one in batch for row in _rows(one)]
                yield Rows(b"".join(lines), len(batch), len(lines), len(failed))

    with engine or serial() as place, Unfinished(target, run) as unfinished:
        begun = time.perf_counter()
        header = b"" if is_json_lines(target) else csv_lines([COLUMNS])
        report = partial(progress, IDENTIFY)
        start, end = unfinished.write(header, rows_from, lambda at: report(at.pairs, total))
    if once:
        remember(target, run, end)
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


def _description(search: Search, options: SearchOptions) -> dict[str, str]:
    """Return what must be the same of a run that is resumed: the search and its options."""
    assert options.calibration is not None
    return {
        "format": _FORMAT,
        "version of fpmatch": __version__,
        "matcher": search.matcher.name,
        "calibration": options.calibration.as_json(),
        "number of candidates": repr(options.count),
        "threshold": repr((options.threshold, options.by_chance)),
        "list": repr((options.listed, options.transforms)),
        "effort": repr(options.effort if search.preselected else None),
    }


def identify_probes(
    gallery: Gallery,
    search: Search,
    probes: FolderSource,
    options: SearchOptions,
    engine: Engine,
    start: int = 0,
) -> Generator[Identified, None, None]:
    """Yield the outcome for each probe from number `start` on, in order.

    Templates are extracted and compared by the workers of an engine, which is entered; the audit of
    the gallery records each search before it is yielded.
    """
    pending: deque[StoredTemplate] = deque()
    names = probes.paths[start:]
    audited = gallery.keeps_audit()
    before = [sha256_of(Path(path)) if audited else None for path in names]

    def opened(templates: Iterator[StoredTemplate]) -> Iterator[Template | None]:
        for stored in templates:
            pending.append(stored)
            yield None if stored.data is None else unpack(stored.data)

    with (
        closing(probes.templates(engine, range(start, len(probes.paths)))) as templates,
        closing(
            identify_each(gallery, search, opened(templates), options, engine, names)
        ) as outcomes,
    ):
        for path, content, outcome in zip(names, before, outcomes, strict=True):
            stored = pending.popleft()
            if outcome is None:
                yield Identified(path, stored.reason, stored.all_notes)
                continue
            result, entries = outcome
            if audited and sha256_of(Path(path)) != content:
                raise ImageReadError("was changed while it was searched for", path=path)
            gallery.record(IDENTIFY, probe=content, candidates=result.numbers)
            yield Identified(path, stored.reason, stored.all_notes, result, entries)


def check_candidates_format(output: Path) -> None:
    """Raise an OutputError unless a file of candidates can have this name."""
    if output.suffix.lower() not in FORMATS:
        raise OutputError(f"{output}: candidates are written as {' or '.join(FORMATS)}")


def is_json_lines(output: Path) -> bool:
    """Return whether the name of a file is that of JSON lines."""
    return output.suffix.lower() == JSON_LINES


def _rows(probe: Identified) -> Iterator[list[object]]:
    """Yield the rows of CSV of a probe."""
    nobody, result = [""] * len(OF_CANDIDATES), probe.result
    if result is None:
        yield [probe.path, *nobody, *[""] * len(OF_SEARCHES), probe.reason]
        return
    stages = ["" if result.effort is None else result.effort, " ".join(map(str, result.passed_on))]
    about = [result.enrolled, result.compared, result.fingers, *stages]
    listed = result.candidate_dicts(probe.entries)
    for candidate in listed:
        candidate["extrapolated"] = int(candidate["extrapolated"])
        yield [probe.path, *(candidate[name] for name in OF_CANDIDATES), *about, ""]
    if not listed:
        yield [probe.path, *nobody, *about, NO_CANDIDATE]


def _json_line(probe: Identified, about: Mapping[str, str]) -> bytes:
    """Return the document of a probe on a line; one without a template has no numbers.

    All documents have the members `about` the search.
    """
    result, reason = probe.result, probe.reason or None
    document: dict[str, Any] = dict.fromkeys(OF_SEARCHES)
    candidates: list[dict[str, Any]] = []
    if result is not None:
        document = result.as_dict()
        candidates = result.candidate_dicts(probe.entries)
        reason = None if candidates else NO_CANDIDATE
    document = {"probe": probe.path, **about, **document}
    document |= {"candidates": candidates, "reason": reason}
    return f"{json_text(document, indent=None)}\n".encode()
