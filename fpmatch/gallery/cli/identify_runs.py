"""The three runs of `fpmatch identify`: probe by probe, by several fingers, and into a file."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import click

from fpmatch.cli import fast_imports
from fpmatch.cli.notes import (
    ProgressBars,
    notes_as_json,
    say_damaged,
    say_errors,
    say_failures,
    say_note,
    say_notes,
    say_slow_kernels,
    show,
)
from fpmatch.cli.options import requested_loss
from fpmatch.errors import FpmatchError
from fpmatch.printable import count, json_text, printable

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from fpmatch.gallery.batch.candidates import SearchSummary
    from fpmatch.gallery.batch.sources import FolderSource
    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.listing.entry import Entry
    from fpmatch.gallery.listing.print_file import PrintFile
    from fpmatch.gallery.search.identification import (
        Candidate,
        FusedIdentification,
        Identification,
        SubjectCandidate,
    )
    from fpmatch.gallery.search.search import CandidateListSize, Search, SearchOptions

PREPARE: Final = {"prepare": "preparing prints"}
_WORKERS_NEED: Final = (
    "fpmatch.gallery.batch.candidates",
    "fpmatch.matching.matchers.unit_circle",
)
_RATES: Final = f"  rank  score  {'FMR':<18}  by chance  "
_COLUMNS: Final = f"{_RATES}{'print':<12}  number  picture"
_SUBJECT_COLUMNS: Final = f"{_RATES}{'subject':<12}  fingers"


class Where(NamedTuple):
    """The gallery, the matcher, and the workers or the cluster that search."""

    gallery: str
    matcher: str
    workers: int | None
    scheduler: str | None

    def engine(self) -> Engine:
        """Return the engine of the workers, or of the cluster."""
        from fpmatch.gallery.engine.engine import make_engine

        return make_engine(self.workers, self.scheduler)

    def open_search(self, opened: Gallery, bars: ProgressBars, size: CandidateListSize) -> Search:
        """Prepare the prints of the gallery, which is open."""
        from fpmatch.gallery.search.opening import open_search

        return open_search(
            opened,
            self.matcher,
            engine=self.engine(),
            progress=bars.show,
            note=say_note,
            candidate_list=size,
            loss=requested_loss(),
        )


@dataclass(frozen=True, slots=True)
class Probes:
    """The prints to search for, in `places`; `reading` is the polarity, the dpi and the reader."""

    places: Sequence[Path]
    files: Sequence[PrintFile]
    reading: Mapping[str, Any]

    def source(self) -> FolderSource:
        """Return them as the probes of a batch, which are read later."""
        from fpmatch.gallery.batch.sources import FolderSource

        places, reading = self.places, self.reading
        above = (
            places[0]
            if len(places) == 1
            else Path(os.path.commonpath([p.absolute() for p in places]))
        )
        return FolderSource(
            above, self.files, reading["dpi"], reading["polarity"], reading["reader"]
        )


class _Answer(NamedTuple):
    """The outcome for one probe, with the entries of the candidates."""

    probe: Path
    result: Identification
    entries: Sequence[Entry]
    seconds: float
    notes: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return the object that ``--json`` prints."""
        return {
            "probe": str(self.probe),
            "seconds": round(self.seconds, 4),
            "passed_on": list(self.result.passed_on),
            "candidates": self.result.candidate_dicts(self.entries),
        }


def identify_one_by_one(
    where: Where, probes: Probes, options: SearchOptions, *, as_json: bool
) -> int:
    """Show the candidates of each probe; return the exit status of the command."""
    from fpmatch.gallery.gallery import open_gallery
    from fpmatch.prints.reading import group_by_note

    answers: list[_Answer] = []
    failures: list[FpmatchError] = []
    with open_gallery(where.gallery) as opened:
        say_slow_kernels()
        with ProgressBars(PREPARE) as bars:
            search = where.open_search(opened, bars, options.candidate_list)
        near = where.scheduler is None
        for answer in (_near if near else _far)(opened, search, where, probes, options):
            if isinstance(answer, FpmatchError):
                failures.append(answer)
                continue
            answers.append(answer)
            if not as_json:
                show(_candidates_as_text(answer))
        name, damaged = opened.name, opened.damaged
    say_damaged(name, damaged)
    say_notes(group_by_note((answer.probe, answer.notes) for answer in answers))
    say_errors(failures)
    if as_json and answers:
        document = {
            "gallery": name,
            "matcher": search.matcher.name,
            "enrolled": len(search),
            "damaged": len(damaged),
            "compared": answers[0].result.compared,
            "fingers": answers[0].result.fingers,
            "loss": answers[0].result.loss,
            "listed": options.listed,
            "probes": [answer.as_dict() for answer in answers],
            "failures": list(map(str, failures)),
        }
        show(json_text(document))
    return 2 if not answers else 1 if failures else 0


def _near(
    gallery: Gallery, search: Search, where: Where, probes: Probes, options: SearchOptions
) -> Iterator[_Answer | FpmatchError]:
    """Yield the outcome for each probe, searched for by threads, or why it cannot be read."""
    from fpmatch.gallery.listing.prints import extract_print, folder_reader
    from fpmatch.gallery.search.consolidated import ConsolidatedFingers
    from fpmatch.gallery.search.entries import identify_entries

    consolidated = None
    if options.consolidate:
        consolidated = ConsolidatedFingers(gallery, search, options.calibration)
    reader = folder_reader(probes.files, **probes.reading)
    for file in probes.files:
        try:
            probe = extract_print(file, reader=reader)
        except FpmatchError as error:
            yield error
            continue
        start = time.perf_counter()
        result, entries = identify_entries(
            gallery,
            search,
            probe.template,
            options,
            consolidated=consolidated,
            workers=where.workers,
        )
        seconds = time.perf_counter() - start
        numbers = [candidate.number for candidate in result.candidates]
        gallery.record("identify", probe=file.path, candidates=numbers)
        yield _Answer(file.path, result, entries, seconds, probe.all_notes)


def _far(
    gallery: Gallery, search: Search, where: Where, probes: Probes, options: SearchOptions
) -> Iterator[_Answer | FpmatchError]:
    """Yield the same outcomes as `_near`, of a cluster; seconds are those of waiting."""
    from fpmatch.gallery.batch.candidates import identify_probes

    with where.engine() as engine:
        start = time.perf_counter()
        for one in identify_probes(gallery, search, probes.source(), options, engine):
            path, seconds = Path(one.path), time.perf_counter() - start
            if one.result is None:
                yield FpmatchError(one.reason, path=path)
            else:
                yield _Answer(path, one.result, one.entries, seconds, one.notes)
            start = time.perf_counter()


def identify_by_fingers(
    where: Where,
    probes: Probes,
    others: Sequence[PrintFile],
    positions: Sequence[str],
    options: SearchOptions,
    *,
    as_json: bool,
) -> int:
    """Show the subjects whose fingers match one probe and prints of other fingers best."""
    from fpmatch.gallery.gallery import open_gallery
    from fpmatch.gallery.listing.prints import extract_print, folder_reader
    from fpmatch.gallery.search.entries import identify_entries_fused
    from fpmatch.prints.reading import group_by_note

    with fast_imports():
        import scipy.optimize  # noqa: F401  (which assigns probes to fingers, while time is taken)

    if not others:
        raise click.UsageError("--finger goes with --with")
    if len(probes.files) > 1:
        raise click.UsageError(f"--with goes with one PROBE, not with {len(probes.files)}")
    files = [*probes.files, *others]
    if positions and len(positions) != len(files):
        names_given = count(len(positions), "name")
        raise click.UsageError(f"--finger names all prints: {len(files)}, not {names_given}")
    known = [file.label.finger if file.label else "" for file in files]
    reader = folder_reader(files, **probes.reading)
    extracted = [extract_print(file, reader=reader) for file in files]
    with open_gallery(where.gallery) as opened:
        say_slow_kernels()
        with ProgressBars(PREPARE) as bars:
            search = where.open_search(opened, bars, options.candidate_list)
        start = time.perf_counter()
        result, entries = identify_entries_fused(
            opened,
            search,
            [one.template for one in extracted],
            positions=positions or known,
            count=options.count,
            threshold=options.threshold,
            calibration=options.calibration,
            candidate_list=options.candidate_list,
            loss=options.loss,
            engine=None if where.scheduler is None else where.engine(),
            workers=where.workers,
        )
        seconds = time.perf_counter() - start
        numbers = [f.number for candidate in result.candidates for f in candidate.fingers]
        for file in files:
            opened.record("identify", probe=file.path, candidates=numbers)
        name, damaged = opened.name, opened.damaged
    say_damaged(name, damaged)
    say_notes(
        group_by_note(
            (file.path, one.all_notes) for file, one in zip(files, extracted, strict=True)
        )
    )
    names = [str(file.path) for file in files]
    document = {
        "gallery": name,
        "matcher": result.matcher,
        "enrolled": len(search),
        "damaged": len(damaged),
        "compared": result.compared,
        "subjects": result.subjects,
        "loss": result.loss,
        "passed_on": list(result.passed_on),
        "probes": names,
        "fingers": list(positions or known),
        "seconds": round(seconds, 4),
        "candidates": result.candidate_dicts(entries, names),
    }
    show(json_text(document) if as_json else _subjects_as_text(names, result, entries, seconds))
    return 0


def identify_to_file(
    where: Where, probes: FolderSource, output: Path, options: SearchOptions, *, as_json: bool
) -> int:
    """Write the candidates of all probes; return the exit status of the command."""
    from fpmatch.base.output import check_writable
    from fpmatch.gallery.batch.candidates import check_candidates_format, write_candidates
    from fpmatch.gallery.engine.local import start_fork_server
    from fpmatch.gallery.gallery import open_gallery

    check_candidates_format(output)
    check_writable(output)
    if where.scheduler is None:
        start_fork_server(where.workers, *_WORKERS_NEED)
    try:
        stages = PREPARE | {"identify": "searching"}
        with open_gallery(where.gallery) as opened, ProgressBars(stages) as bars:
            content = opened.content_hash()
            search = where.open_search(opened, bars, options.candidate_list)
            done = write_candidates(
                opened,
                search,
                probes,
                output,
                options,
                content=content,
                engine=where.engine(),
                progress=bars.show,
            )
            name, damaged = opened.name, opened.damaged
    except KeyboardInterrupt:
        say_note("the same command resumes the run")
        raise
    say_damaged(name, damaged)
    say_notes(done.noted)
    say_failures([f"{path}: {reason}" for path, reason in done.failures], "; the file has all")
    if as_json:
        shown = {"gallery": name, "matcher": search.matcher.name, "enrolled": len(search)}
        show(json_text({**shown, "damaged": len(damaged), **_summary_as_dict(done)}))
    else:
        show(_summary_as_text(done))
    return 0 if not done.failed else 1 if done.failed < done.probes else 2


def _summary_as_text(done: SearchSummary) -> str:
    """Return what is shown of a run into a file."""
    from fpmatch.gallery.batch.candidates import is_json_lines

    counts = [count(done.probes, "probe")]
    counts += [f"{done.resumed} of them before"] if done.resumed else []
    counts += [f"{done.failed} without a template"] if done.failed else []
    rate = f" ({done.rate:.1f} a second)" if done.rate else ""
    head = f"{', '.join(counts)}: {done.seconds:.1f} s{rate}"
    what = "line" if is_json_lines(done.output) else "row"
    return f"{head}\n{printable(done.output)}: {count(done.rows, what)}"


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


def _candidates_as_text(answer: _Answer) -> str:
    """Return the candidates for one probe."""
    lines = []
    for candidate, entry in zip(answer.result.candidates, answer.entries, strict=True):
        lines.append(
            f"{_rates(answer.result, candidate)}{printable(entry.label):<12}  {entry.id:>6}  "
            f"{printable(entry.source)}"
        )
        lines += [f"        {line}" for line in _transform_lines(candidate)]
    return _as_text([str(answer.probe)], answer.result, answer.seconds, _COLUMNS, lines)


def _subjects_as_text(
    probes: Sequence[str],
    result: FusedIdentification,
    entries: Mapping[int, Entry],
    seconds: float,
) -> str:
    """Return the candidates for several probes."""
    lines = []
    for one in result.candidates:
        fingers = (f"{printable(entries[f.number].label)} {f.score:.1f}" for f in one.fingers)
        lines.append(f"{_rates(result, one)}{printable(one.subject):<12}  {', '.join(fingers)}")
    return _as_text(probes, result, seconds, _SUBJECT_COLUMNS, lines)


def _as_text(
    probes: Sequence[str],
    result: Identification | FusedIdentification,
    seconds: float,
    columns: str,
    lines: Sequence[str],
) -> str:
    """Return lines of candidates under a line on the search."""
    from fpmatch.prints.words import odds

    of_all = f" of {result.enrolled}" if result.preselected else ""
    compared = f"{result.compared}{of_all} {'print' if result.enrolled == 1 else 'prints'} compared"
    stages = ""
    if result.loss is not None:
        by_index, by_descriptors = (f"{passed:,}" for passed in result.passed_on[:2])
        loss = f"loss {100 * result.loss:g}%"
        stages = f" ({loss}: {by_index} by index, {by_descriptors} by descriptors)"
    head = f"{' with '.join(map(printable, probes))}: {compared} in {seconds:.2f} s{stages}"
    if not lines:
        return f"{head}, no candidate"
    smallest = result.smallest_measured_fmr
    extrapolated = any(one.fmr < smallest for one in result.candidates)
    note = [f"  * extrapolated: measured up to {odds(smallest)}"] if extrapolated else []
    return "\n".join([head, columns, *lines, *note])


def _rates(
    result: Identification | FusedIdentification, candidate: Candidate | SubjectCandidate
) -> str:
    """Return how a line on a candidate begins."""
    from fpmatch.prints.words import odds

    rate = f"{odds(candidate.fmr)}{' *' if candidate.fmr < result.smallest_measured_fmr else ''}"
    return (
        f"  {candidate.rank:>4}  {candidate.score:>5.1f}  {rate:<18}  "
        f"{candidate.expected_false:>9.2g}  "
    )


def _transform_lines(candidate: Candidate) -> list[str]:
    """Return the line on the transform of a candidate, if it is to be shown."""
    from fpmatch.prints.report import transform_in_words

    comparison = candidate.comparison
    if comparison is None:
        return []
    if comparison.transform is None:
        return [f"no transform: {comparison.reason}"]
    pairs = count(len(comparison.pairs), "pair")
    return [f"{transform_in_words(comparison.transform)}; {pairs}, {comparison.rms_px:.1f} px rms"]
