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
from fpmatch.gallery.search.identification import OF_SEARCHES
from fpmatch.gallery.search.identify import identify_each
from fpmatch.gallery.search.probes import sha256_of
from fpmatch.printable import json_text
from fpmatch.prints.reading import group_by_note

if TYPE_CHECKING:
    import os
    from collections.abc import Generator, Iterator, Mapping

    from fpmatch.gallery.batch.sources import FolderSource, StoredTemplate
    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.search.identification import Identification
    from fpmatch.gallery.search.search import Search, SearchOptions
    from fpmatch.templates.minutiae import Template

    _Outcome = Identification | None  # None for a probe without a template

IDENTIFY: Final = "identify"
_FORMAT: Final = "5"  # of the state of an unfinished run
OF_CANDIDATES: Final = (
    *("rank", "id", "subject", "finger", "impression", "source", "score", "fmr", "extrapolated"),
    *("expected_false_matches", "impressions", "impression_score"),
)
COLUMNS: Final = ("probe", *OF_CANDIDATES, *OF_SEARCHES, "reason")
NO_CANDIDATE: Final = "no candidate"
JSON_LINES: Final = ".jsonl"
FORMATS: Final = (".csv", JSON_LINES)


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
    search: Search,
    probes: FolderSource,
    output: str | os.PathLike[str],
    options: SearchOptions,
    *,
    engine: Engine | None = None,
    progress: Progress = no_progress,
) -> SearchSummary:
    """Search for many probes and write their candidates.

    The file is the same, byte by byte, with every engine and however often the run was
    interrupted; its state is kept beside the output until that is complete. A finished run is
    remembered in the user's cache; where its output is there as it was written, nothing is done.

    The audit of the searched gallery, if it keeps one, records each search; a run of another
    content is not resumed. The `engine` is entered here (default: this process); `progress` is
    called with stage "identify" and numbers of probes.

    Raises ScoringError if a different run of this output is unfinished; OutputError if the output
    cannot be written; MatcherError as `fpmatch.gallery.search.identify.identify`; other
    FpmatchErrors if the gallery cannot be read or the engine broke down.
    """
    target, gallery = Path(output), search.gallery
    check_candidates_format(target)
    about = {"gallery": gallery.name, "matcher": search.matcher.name, "listed": options.listed}
    options = options.checked(search.matcher)
    assert options.calibration is not None
    run = {
        "format": _FORMAT,
        "version of fpmatch": __version__,
        "matcher": search.matcher.name,
        "calibration": options.calibration.as_json(),
        "number of candidates": repr(options.count),
        "threshold": repr((options.threshold, options.by_chance)),
        "list": repr((options.listed, options.transforms)),
        "effort": repr(options.effort if search.preselected else None),
        "gallery": gallery.name,
        "content of the gallery": search.content,
        "set of probes": probes.content_hash,
        "paths of the probes": hashlib.sha256(repr(probes.paths).encode()).hexdigest(),
    }
    total = len(probes.paths)
    if (end := finished_before(target, run)) is not None:
        return SearchSummary(target, total, end.rows, end.pairs, end.failed, (), {}, 0.0)
    as_lines = _json_lines if is_json_lines(target) else _csv_lines
    failures: list[tuple[str, str]] = []
    noted: list[tuple[str, tuple[str, ...]]] = []

    def rows_from(start: int) -> Generator[Rows, None, None]:
        with closing(_identify(search, probes, options, place, start)) as searched:
            for path, stored, outcome in searched:
                noted.append((path, stored.all_notes))
                if outcome is None:
                    failures.append((path, stored.reason))
                lines = list(as_lines(path, stored, outcome, about))
                yield Rows(b"".join(lines), 1, len(lines), int(outcome is None))

    with engine or serial() as place, Unfinished(target, run) as unfinished:
        begun = time.perf_counter()
        header = b"" if is_json_lines(target) else csv_lines([COLUMNS])
        report = partial(progress, IDENTIFY)
        start, end = unfinished.write(header, rows_from, lambda at: report(at.pairs, total))
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


def _identify(
    search: Search, probes: FolderSource, options: SearchOptions, engine: Engine, start: int
) -> Generator[tuple[str, StoredTemplate, _Outcome], None, None]:
    """Yield path, template and outcome of each probe from number `start` on, in order.

    Templates are extracted and compared by the workers of an engine, which is entered; the audit of
    the gallery records each search before it is yielded.
    """
    pending: deque[StoredTemplate] = deque()
    names = probes.paths[start:]
    audited = search.gallery.keeps_audit()
    before = [sha256_of(Path(path)) if audited else None for path in names]
    templates = probes.templates(engine, range(start, len(probes.paths)))

    def opened() -> Iterator[tuple[str, Template | None]]:
        for name, stored in zip(names, templates, strict=True):
            pending.append(stored)
            yield name, None if stored.data is None else unpack(stored.data)

    with (
        closing(templates),
        closing(identify_each(search, opened(), options, engine)) as outcomes,
    ):
        for path, content, outcome in zip(names, before, outcomes, strict=True):
            if outcome is not None and audited:
                if sha256_of(Path(path)) != content:
                    raise ImageReadError("was changed while it was searched for", path=path)
                search.gallery.record(IDENTIFY, probe=content, candidates=outcome.numbers)
            yield path, pending.popleft(), outcome


def check_candidates_format(output: Path) -> None:
    """Raise an OutputError unless a file of candidates can have this name."""
    if output.suffix.lower() not in FORMATS:
        raise OutputError(f"{output}: candidates are written as {' or '.join(FORMATS)}")


def is_json_lines(output: Path) -> bool:
    """Return whether the name of a file is that of JSON lines."""
    return output.suffix.lower() == JSON_LINES


def _csv_lines(path: str, stored: StoredTemplate, outcome: _Outcome, _: object) -> Iterator[bytes]:
    """Yield the lines of CSV of a probe."""
    nobody = [""] * len(OF_CANDIDATES)
    if outcome is None:
        yield csv_lines([[path, *nobody, *[""] * len(OF_SEARCHES), stored.reason]])
        return
    stages = [
        "" if outcome.effort is None else outcome.effort,
        " ".join(map(str, outcome.passed_on)),
    ]
    searched = [outcome.enrolled, outcome.compared, outcome.fingers, *stages]
    listed = outcome.candidate_dicts()
    for candidate in listed:
        candidate["extrapolated"] = int(candidate["extrapolated"])
        yield csv_lines([[path, *(candidate[name] for name in OF_CANDIDATES), *searched, ""]])
    if not listed:
        yield csv_lines([[path, *nobody, *searched, NO_CANDIDATE]])


def _json_lines(
    path: str, stored: StoredTemplate, outcome: _Outcome, about: Mapping[str, str]
) -> Iterator[bytes]:
    """Yield the document of a probe as a line; one without a template has no numbers.

    All documents have the members `about` the search.
    """
    document: dict[str, Any] = dict.fromkeys(OF_SEARCHES)
    candidates, reason = list[dict[str, Any]](), stored.reason or None
    if outcome is not None:
        document, candidates = outcome.as_dict(), outcome.candidate_dicts()
        reason = None if candidates else NO_CANDIDATE
    document = {"probe": path, **about, **document, "candidates": candidates, "reason": reason}
    yield f"{json_text(document, indent=None)}\n".encode()
