"""The three runs of `fpmatch identify`: probe by probe, by several fingers, and into a file."""

from __future__ import annotations

import os
import time
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch.cli.notes import say_errors, say_note, say_notes, say_slow_kernels, show
from fpmatch.cli.progress import ProgressBars
from fpmatch.errors import FpmatchError, MatcherError
from fpmatch.gallery.cli.notes import notes_as_json, say_damaged, say_failures
from fpmatch.printable import count, json_text, printable
from fpmatch.prints.report import odds

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.listing.entry import PrintFile
    from fpmatch.gallery.search.identification import (
        Candidate,
        FusedIdentification,
        Identification,
        SubjectCandidate,
    )
    from fpmatch.gallery.search.search import Search, SearchOptions
    from fpmatch.prints.reading import GivenPrint

_RATES: Final = f"  rank  score  {'FMR':<18}  by chance  "
_COLUMNS: Final = f"{_RATES}{'print':<12}  number  picture"
_SUBJECT_COLUMNS: Final = f"{_RATES}{'subject':<12}  fingers"


@dataclass(frozen=True, slots=True)
class Run:
    """Where is searched, by so many `workers` or the cluster of a `scheduler`, and for what."""

    gallery: str
    matcher: str
    workers: int | None
    scheduler: str | None
    dpi: float | None
    options: SearchOptions
    as_json: bool

    @contextmanager
    def opened(self, **stages: str) -> Iterator[tuple[Gallery, Search, ProgressBars]]:
        """Open the gallery and its search; name damaged entries at the end."""
        from fpmatch.gallery.engine.engine import make_engine
        from fpmatch.gallery.gallery import open_gallery
        from fpmatch.gallery.search.search import Search

        say_slow_kernels()
        bars = ProgressBars({"prepare": "preparing prints", **stages})
        with open_gallery(self.gallery) as gallery, bars:
            engine = make_engine(self.workers, self.scheduler)
            how: dict[str, Any] = {"progress": bars.show, "note": say_note}
            search = Search(gallery, self.matcher, engine=engine, **how)
            bars.close()
            yield gallery, search, bars
        say_damaged(gallery.name, gallery.damaged)

    def reader(self, files: Sequence[PrintFile]) -> Callable[[PrintFile], tuple[GivenPrint, str]]:
        """Return the function that reads a probe, and the SHA-256 of its file."""
        from fpmatch.gallery.listing.prints import folder_reader, read_one_print
        from fpmatch.gallery.search.probes import read_hashed
        from fpmatch.prints.reading import PrintReader

        read = folder_reader(files, dpi=self.dpi, reader=PrintReader(quiet=True))
        return lambda file: read_hashed(file.path, lambda: read_one_print(file, read))

    def show(self, gallery: Gallery, search: Search, document: Mapping[str, Any]) -> None:
        """Show the outcome of the run as JSON."""
        about = {
            "gallery": gallery.name,
            "matcher": search.matcher.name,
            "enrolled": len(search),
            "damaged": len(gallery.damaged),
        }
        show(json_text({**about, **document}))


def identify_one_by_one(run: Run, files: Sequence[PrintFile]) -> int:
    """Show the candidates of each probe; return the exit status of the command."""
    from fpmatch.base.plugins import named
    from fpmatch.gallery.search.identify import identify_given
    from fpmatch.gallery.search.probes import notes_on_identical
    from fpmatch.prints.reading import group_by_note

    probes: list[dict[str, Any]] = []
    noted: list[tuple[str, tuple[str, ...]]] = []
    failures: list[FpmatchError] = []
    read = run.reader(files)
    first: Identification | None = None
    with run.opened() as (gallery, search, _):
        for file in files:
            try:
                given, content = read(file)
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
                rows = [
                    f"{printable(one.label):<12}  {one.id:>6}  {printable(one.source)}"
                    for one in result.entries
                ]
                show(_as_text([name], result, seconds, _COLUMNS, rows))
    say_notes(group_by_note(noted))
    say_errors(failures)
    if first is None:
        return 2
    if run.as_json:
        document = {
            "compared": first.compared,
            "fingers": first.fingers,
            "effort": first.effort,
            "listed": run.options.listed,
            "probes": probes,
            "failures": list(map(str, failures)),
        }
        run.show(gallery, search, document)
    return 1 if failures else 0


def identify_by_fingers(run: Run, files: Sequence[PrintFile]) -> int:
    """Show the subjects whose fingers match prints of different fingers best."""
    import scipy.optimize  # noqa: F401  (which assigns probes to fingers, while time is taken)

    from fpmatch.gallery.search.fused import identify_fused
    from fpmatch.prints.reading import group_by_note

    names = [str(file.path) for file in files]
    positions = [file.label.finger if file.label else "" for file in files]
    given, contents = zip(*map(run.reader(files), files), strict=True)
    with run.opened() as (gallery, search, _):
        start = time.perf_counter()
        result = identify_fused(
            search,
            [one.template for one in given],
            options=run.options,
            positions=positions,
            workers=run.workers,
        )
        seconds = time.perf_counter() - start
        for content in contents:
            gallery.record("identify", probe=content, candidates=result.numbers)
    say_notes(group_by_note(zip(names, (one.notes for one in given), strict=True)))
    if run.as_json:
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
        run.show(gallery, search, document)
        return 0
    rows = []
    for candidate in result.candidates:
        fingers = [
            f"{printable(result.entries[one.number].label)} {one.score:.1f}"
            for one in candidate.fingers
        ]
        rows.append(f"{printable(candidate.subject):<12}  {', '.join(fingers)}")
    show(_as_text(names, result, seconds, _SUBJECT_COLUMNS, rows))
    return 0


def identify_to_file(
    run: Run, places: Sequence[Path], files: Sequence[PrintFile], output: Path
) -> int:
    """Write the candidates of all probes; return the exit status of the command."""
    from fpmatch.base.output import check_writable
    from fpmatch.gallery.batch.candidates import (
        check_candidates_format,
        is_json_lines,
        write_candidates,
    )
    from fpmatch.gallery.batch.sources import FolderSource
    from fpmatch.gallery.engine.engine import make_engine
    from fpmatch.prints.reading import PrintReader

    check_candidates_format(output)
    check_writable(output)
    above = places[0]
    if len(places) > 1:
        above = Path(os.path.commonpath([place.absolute() for place in places]))
    try:
        with run.opened(identify="searching") as (gallery, search, bars):
            done = write_candidates(
                search,
                FolderSource(above, files, run.dpi, "auto", PrintReader(quiet=True)),
                output,
                run.options,
                engine=make_engine(run.workers, run.scheduler),
                progress=bars.show,
            )
    except KeyboardInterrupt:
        say_note("the same command resumes the run")
        raise
    place = printable(done.output)
    if done.resumed == done.probes:
        say_note(f"{place}: done already")
    say_notes(done.noted)
    say_failures([f"{path}: {reason}" for path, reason in done.failures], "; the file has all")
    if run.as_json:
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
        run.show(gallery, search, document)
    else:
        counts = [count(done.probes, "probe")]
        counts += [f"{done.resumed} of them before"] if done.resumed else []
        counts += [f"{done.failed} without a template"] if done.failed else []
        rate = f" ({done.rate:.1f} a second)" if done.rate else ""
        rows = count(done.rows, "line" if is_json_lines(output) else "row")
        show(f"{', '.join(counts)}: {done.seconds:.1f} s{rate}\n{place}: {rows}")
    return 0 if not done.failed else 1 if done.failed < done.probes else 2


def _as_text(
    probes: Sequence[str],
    result: Identification | FusedIdentification,
    seconds: float,
    columns: str,
    rows: Sequence[str],
) -> str:
    """Return a line on the search, and the candidates, each with its rates and its row."""
    of_all = f" of {result.enrolled}" if result.preselected else ""
    compared = f"{result.compared}{of_all} {'print' if result.enrolled == 1 else 'prints'} compared"
    stages = ""
    if result.effort is not None:
        passed = zip(result.passed_on, ("index", "descriptors"), strict=True)
        numbers = ", ".join(f"{prints:,} by {stage}" for prints, stage in passed)
        stages = f" (effort {result.effort}: {numbers})"
    head = f"{' with '.join(map(printable, probes))}: {compared} in {seconds:.2f} s{stages}"
    if not rows:
        return f"{head}, no candidate"
    lines = [head, columns]
    candidates: Sequence[Candidate | SubjectCandidate] = result.candidates
    marked = [result.is_extrapolated(candidate) for candidate in candidates]
    for candidate, mark, row in zip(candidates, marked, rows, strict=True):
        rate = f"{odds(candidate.fmr)}{' *' * mark}"
        lines.append(
            f"  {candidate.rank:>4}  {candidate.score:>5.1f}  {rate:<18}  "
            f"{candidate.expected_false:>9.2g}  {row}"
        )
    if any(marked):
        lines.append(f"  * extrapolated: measured up to {odds(result.smallest_measured_fmr)}")
    return "\n".join(lines)
