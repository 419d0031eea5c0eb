"""The three runs of `fpmatch identify`: probe by probe, by several fingers, and into a file."""

from __future__ import annotations

import os
import time
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import click

from fpmatch.cli.notes import say_errors, say_note, say_notes, say_slow_kernels, show
from fpmatch.cli.progress import ProgressBars
from fpmatch.errors import FpmatchError, MatcherError
from fpmatch.gallery.cli.identify_text import candidates_as_text, subjects_as_text, summary_as_text
from fpmatch.gallery.cli.notes import notes_as_json, say_damaged, say_failures
from fpmatch.printable import count, json_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from fpmatch.gallery.batch.candidates import SearchSummary
    from fpmatch.gallery.batch.sources import FolderSource
    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.listing.entry import Entry
    from fpmatch.gallery.listing.print_file import PrintFile
    from fpmatch.gallery.search.identification import Identification
    from fpmatch.gallery.search.search import Search, SearchOptions

PREPARE: Final = {"prepare": "preparing prints"}


@dataclass(frozen=True, slots=True)
class Run:
    """What is searched for, and where.

    The probes are `files`, in `places`; `reading` is their polarity, their dpi and the reader. They
    are searched for by so many `workers`, or by the cluster of a `scheduler`.
    """

    gallery: str
    matcher: str
    workers: int | None
    scheduler: str | None
    places: Sequence[Path]
    files: Sequence[PrintFile]
    reading: Mapping[str, Any]
    options: SearchOptions
    as_json: bool

    def engine(self) -> Engine:
        """Return the engine of the workers, or of the cluster."""
        from fpmatch.gallery.engine.engine import make_engine

        return make_engine(self.workers, self.scheduler)

    def source(self) -> FolderSource:
        """Return the probes as a batch, whose prints are read later."""
        from fpmatch.gallery.batch.sources import FolderSource

        above = self.places[0]
        if len(self.places) > 1:
            above = Path(os.path.commonpath([place.absolute() for place in self.places]))
        return FolderSource(above, self.files, **self.reading)

    @contextmanager
    def opened(self) -> Iterator[Gallery]:
        """Open the gallery; its damaged entries are named when it is closed."""
        from fpmatch.gallery.gallery import open_gallery

        with open_gallery(self.gallery) as gallery:
            yield gallery
        say_damaged(gallery.name, gallery.damaged)

    def prepared(self, gallery: Gallery, bars: ProgressBars) -> Search:
        """Prepare the prints of the gallery, which is open."""
        from fpmatch.gallery.search.opening import open_search

        return open_search(
            gallery,
            self.matcher,
            engine=self.engine(),
            progress=bars.show,
            note=say_note,
        )

    def about(self, gallery: Gallery, search: Search) -> dict[str, Any]:
        """Return how all documents begin that ``--json`` prints."""
        return {
            "gallery": gallery.name,
            "matcher": search.matcher.name,
            "enrolled": len(search),
            "damaged": len(gallery.damaged),
        }


class _Answer(NamedTuple):
    """The outcome for one probe, with the entries of the candidates."""

    probe: str
    result: Identification
    entries: Sequence[Entry]
    seconds: float
    notes: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return the object that ``--json`` prints."""
        return {
            "probe": self.probe,
            "seconds": round(self.seconds, 4),
            "passed_on": list(self.result.passed_on),
            "candidates": self.result.candidate_dicts(self.entries),
        }


def identify_one_by_one(run: Run) -> int:
    """Show the candidates of each probe; return the exit status of the command."""
    from fpmatch.prints.reading import group_by_note

    answers: list[_Answer] = []
    failures: list[FpmatchError] = []
    with run.opened() as gallery:
        say_slow_kernels()
        with ProgressBars(PREPARE) as bars:
            search = run.prepared(gallery, bars)
        for answer in (_near if run.scheduler is None else _far)(gallery, search, run):
            if isinstance(answer, FpmatchError):
                failures.append(answer)
                continue
            answers.append(answer)
            if not run.as_json:
                show(
                    candidates_as_text(answer.probe, answer.result, answer.entries, answer.seconds)
                )
    say_notes(group_by_note((answer.probe, answer.notes) for answer in answers))
    say_errors(failures)
    if run.as_json and answers:
        first = answers[0].result
        document = {
            **run.about(gallery, search),
            "compared": first.compared,
            "fingers": first.fingers,
            "effort": first.effort,
            "listed": run.options.listed,
            "probes": [answer.as_dict() for answer in answers],
            "failures": list(map(str, failures)),
        }
        show(json_text(document))
    return 2 if not answers else 1 if failures else 0


def _near(gallery: Gallery, search: Search, run: Run) -> Iterator[_Answer | FpmatchError]:
    """Yield the outcome for each probe, searched for by threads, or why it cannot be read."""
    from fpmatch.gallery.listing.prints import folder_reader, read_one_print
    from fpmatch.gallery.search.entries import identify_given
    from fpmatch.matching.result import named

    reader = folder_reader(run.files, **run.reading)
    for file in run.files:
        try:
            given = read_one_print(file, reader)
        except FpmatchError as error:
            yield error
            continue
        start = time.perf_counter()
        try:
            probe, result, entries = identify_given(
                gallery, search, given, run.options, workers=run.workers
            )
        except MatcherError as error:
            raise named(error, file.path) from error
        seconds = time.perf_counter() - start
        gallery.record("identify", probe=file.path, candidates=result.numbers)
        yield _Answer(str(file.path), result, entries, seconds, probe.notes)


def _far(gallery: Gallery, search: Search, run: Run) -> Iterator[_Answer | FpmatchError]:
    """Yield the same outcomes as `_near`, of a cluster; seconds are those of waiting."""
    from fpmatch.gallery.batch.candidates import identify_probes

    with run.engine() as engine:
        start = time.perf_counter()
        for one in identify_probes(gallery, search, run.source(), run.options, engine):
            seconds = time.perf_counter() - start
            if one.result is None:
                yield FpmatchError(one.reason, path=one.path)
            else:
                yield _Answer(one.path, one.result, one.entries, seconds, one.notes)
            start = time.perf_counter()


def identify_by_fingers(run: Run, others: Sequence[PrintFile], positions: Sequence[str]) -> int:
    """Show the subjects whose fingers match one probe and prints of other fingers best."""
    import scipy.optimize  # noqa: F401  (which assigns probes to fingers, while time is taken)

    from fpmatch.gallery.listing.prints import extract_print, folder_reader
    from fpmatch.gallery.search.entries import identify_entries_fused
    from fpmatch.prints.reading import group_by_note

    files = [*run.files, *others]
    positions = _positions(run.files, others, positions)
    reader = folder_reader(files, **run.reading)
    extracted = [extract_print(file, reader=reader) for file in files]
    with run.opened() as gallery:
        say_slow_kernels()
        with ProgressBars(PREPARE) as bars:
            search = run.prepared(gallery, bars)
        start = time.perf_counter()
        result, entries = identify_entries_fused(
            gallery,
            search,
            [one.template for one in extracted],
            options=run.options,
            positions=positions,
            workers=run.workers,
        )
        seconds = time.perf_counter() - start
        for file in files:
            gallery.record("identify", probe=file.path, candidates=result.numbers)
    names = [str(file.path) for file in files]
    say_notes(group_by_note(zip(names, (one.all_notes for one in extracted), strict=True)))
    document = {
        **run.about(gallery, search),
        "compared": result.compared,
        "subjects": result.subjects,
        "effort": result.effort,
        "passed_on": list(result.passed_on),
        "probes": names,
        "fingers": list(positions),
        "seconds": round(seconds, 4),
        "candidates": result.candidate_dicts(entries, names),
    }
    show(json_text(document) if run.as_json else subjects_as_text(names, result, entries, seconds))
    return 0


def _positions(
    probes: Sequence[PrintFile], others: Sequence[PrintFile], given: Sequence[str]
) -> Sequence[str]:
    """Return which finger each print is of: as given, or else as its manifest names it."""
    if not others:
        raise click.UsageError("--finger goes with --with")
    if len(probes) > 1:
        raise click.UsageError(f"--with goes with one PROBE, not with {len(probes)}")
    files = [*probes, *others]
    if given and len(given) != len(files):
        names_given = count(len(given), "name")
        raise click.UsageError(f"--finger names all prints: {len(files)}, not {names_given}")
    return given or [file.label.finger if file.label else "" for file in files]


def identify_to_file(run: Run, output: Path) -> int:
    """Write the candidates of all probes; return the exit status of the command."""
    from fpmatch.base.output import check_writable
    from fpmatch.gallery.batch.candidates import check_candidates_format, write_candidates

    check_candidates_format(output)
    check_writable(output)
    try:
        stages = PREPARE | {"identify": "searching"}
        with run.opened() as gallery, ProgressBars(stages) as bars:
            content = gallery.content_hash()
            search = run.prepared(gallery, bars)
            done = write_candidates(
                gallery,
                search,
                run.source(),
                output,
                run.options,
                content=content,
                engine=run.engine(),
                progress=bars.show,
            )
    except KeyboardInterrupt:
        say_note("the same command resumes the run")
        raise
    say_notes(done.noted)
    say_failures([f"{path}: {reason}" for path, reason in done.failures], "; the file has all")
    if run.as_json:
        show(json_text({**run.about(gallery, search), **_summary_as_dict(done)}))
    else:
        show(summary_as_text(done))
    return 0 if not done.failed else 1 if done.failed < done.probes else 2


def _summary_as_dict(done: SearchSummary) -> dict[str, Any]:
    """Return the members that ``--json`` prints of a run into a file."""
    return {
        "output": str(done.output),
        "probes": done.probes,
        "rows": done.rows,
        "resumed": done.resumed,
        "failed": done.failed,
        "failures": [{"probe": path, "reason": reason} for path, reason in done.failures],
        "notes": notes_as_json(done.noted),
        "seconds": round(done.seconds, 3),
        "probes_per_second": round(done.rate, 2),
    }
