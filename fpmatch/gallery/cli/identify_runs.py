"""The three runs of `fpmatch identify`: probe by probe, by several fingers, and into a file."""

from __future__ import annotations

import os
import time
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fpmatch.cli.notes import say_errors, say_note, say_notes, say_slow_kernels, show
from fpmatch.cli.progress import ProgressBars
from fpmatch.errors import FpmatchError, MatcherError
from fpmatch.gallery.cli.identify_text import candidates_as_text, subjects_as_text, summary_as_text
from fpmatch.gallery.cli.notes import notes_as_json, say_damaged, say_failures
from fpmatch.printable import json_text, printable

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.listing.print_file import PrintFile
    from fpmatch.gallery.search.identification import Identification
    from fpmatch.gallery.search.search import Search, SearchOptions


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

    @contextmanager
    def opened(self, **stages: str) -> Iterator[tuple[Gallery, Search, str, ProgressBars]]:
        """Open the gallery, with its content, and its search; name damaged entries at the end."""
        from fpmatch.gallery.engine.engine import make_engine
        from fpmatch.gallery.gallery import open_gallery
        from fpmatch.gallery.search.search import Search

        say_slow_kernels()
        bars = ProgressBars({"prepare": "preparing prints", **stages})
        with open_gallery(self.gallery) as gallery, bars:
            content = gallery.content_hash()
            engine = make_engine(self.workers, self.scheduler)
            how: dict[str, Any] = {"progress": bars.show, "note": say_note}
            search = Search.open(gallery, self.matcher, engine=engine, **how)
            bars.close()
            yield gallery, search, content, bars
        say_damaged(gallery.name, gallery.damaged)

    def show(
        self, gallery: Gallery, search: Search, document: Mapping[str, Any], texts: Sequence[str]
    ) -> None:
        """Show the outcome of the run, as JSON or as texts."""
        about = {
            "gallery": gallery.name,
            "matcher": search.matcher.name,
            "enrolled": len(search),
            "damaged": len(gallery.damaged),
        }
        for text in [json_text({**about, **document})] if self.as_json else texts:
            show(text)


def identify_one_by_one(run: Run) -> int:
    """Show the candidates of each probe; return the exit status of the command."""
    from fpmatch.gallery.listing.prints import folder_reader, read_one_print
    from fpmatch.gallery.search.identify import identify_given
    from fpmatch.gallery.search.probes import notes_on_identical, read_hashed
    from fpmatch.matching.result import named
    from fpmatch.prints.reading import group_by_note

    probes: list[dict[str, Any]] = []
    noted: list[tuple[str, tuple[str, ...]]] = []
    failures: list[FpmatchError] = []
    reader = folder_reader(run.files, **run.reading)
    first: Identification | None = None
    with run.opened() as (gallery, search, _, _):
        for file in run.files:
            try:
                read = partial(read_one_print, file, reader)
                given, content = read_hashed(file.path, read)
            except FpmatchError as error:
                failures.append(error)
                continue
            start = time.perf_counter()
            try:
                probe, result = identify_given(search, given, run.options, workers=run.workers)
            except MatcherError as error:
                raise named(error, file.path) from error
            seconds, name, first = time.perf_counter() - start, str(file.path), first or result
            gallery.record("identify", probe=content, candidates=result.numbers)
            identical = notes_on_identical(gallery, probe.template, result.entries)
            noted.append((name, (*probe.notes, *identical)))
            probes.append(
                {
                    "probe": name,
                    "seconds": round(seconds, 4),
                    "passed_on": list(result.passed_on),
                    "candidates": result.candidate_dicts(),
                }
            )
            if not run.as_json:
                show(candidates_as_text(name, result, result.entries, seconds))
    say_notes(group_by_note(noted))
    say_errors(failures)
    if first is None:
        return 2
    document = {
        "compared": first.compared,
        "fingers": first.fingers,
        "effort": first.effort,
        "listed": run.options.listed,
        "probes": probes,
        "failures": list(map(str, failures)),
    }
    run.show(gallery, search, document, [])
    return 1 if failures else 0


def identify_by_fingers(run: Run, others: Sequence[PrintFile]) -> int:
    """Show the subjects whose fingers match one probe and prints of other fingers best."""
    import scipy.optimize  # noqa: F401  (which assigns probes to fingers, while time is taken)

    from fpmatch.gallery.listing.prints import extract_print, folder_reader
    from fpmatch.gallery.search.fused import identify_fused
    from fpmatch.gallery.search.probes import read_hashed
    from fpmatch.prints.reading import group_by_note

    if len(run.files) > 1:
        raise click.UsageError(f"--with goes with one PROBE, not with {len(run.files)}")
    files = [*run.files, *others]
    positions = [file.label.finger if file.label else "" for file in files]
    reader = folder_reader(files, **run.reading)
    hashed = [read_hashed(file.path, partial(extract_print, file, reader=reader)) for file in files]
    extracted = [made for made, _ in hashed]
    with run.opened() as (gallery, search, _, _):
        start = time.perf_counter()
        result = identify_fused(
            search,
            [one.template for one in extracted],
            options=run.options,
            positions=positions,
            workers=run.workers,
        )
        seconds = time.perf_counter() - start
        for _, content in hashed:
            gallery.record("identify", probe=content, candidates=result.numbers)
    names = [str(file.path) for file in files]
    say_notes(group_by_note(zip(names, (one.all_notes for one in extracted), strict=True)))
    document = {
        "compared": result.compared,
        "subjects": result.subjects,
        "effort": result.effort,
        "passed_on": list(result.passed_on),
        "probes": names,
        "fingers": positions,
        "seconds": round(seconds, 4),
        "candidates": result.candidate_dicts(names),
    }
    run.show(gallery, search, document, [subjects_as_text(names, result, result.entries, seconds)])
    return 0


def identify_to_file(run: Run, output: Path) -> int:
    """Write the candidates of all probes; return the exit status of the command."""
    from fpmatch.base.output import check_writable
    from fpmatch.gallery.batch.candidates import check_candidates_format, write_candidates
    from fpmatch.gallery.batch.sources import FolderSource
    from fpmatch.gallery.engine.engine import make_engine

    check_candidates_format(output)
    check_writable(output)
    above = run.places[0]
    if len(run.places) > 1:
        above = Path(os.path.commonpath([place.absolute() for place in run.places]))
    try:
        with run.opened(identify="searching") as (gallery, search, content, bars):
            done = write_candidates(
                gallery,
                search,
                FolderSource(above, run.files, **run.reading),
                output,
                run.options,
                content=content,
                engine=make_engine(run.workers, run.scheduler),
                progress=bars.show,
                once=True,
            )
    except KeyboardInterrupt:
        say_note("the same command resumes the run")
        raise
    if done.resumed == done.probes:
        say_note(f"{printable(done.output)}: done already")
    say_notes(done.noted)
    say_failures([f"{path}: {reason}" for path, reason in done.failures], "; the file has all")
    document = {
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
    run.show(gallery, search, document, [summary_as_text(done)])
    return 0 if not done.failed else 1 if done.failed < done.probes else 2
