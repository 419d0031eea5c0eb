"""`fpmatch identify --with`: the subjects whose fingers match several probes best."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.cli import fast_imports
from fpmatch.cli.notes import say_damaged, say_note, say_notes, say_slow_kernels, show
from fpmatch.cli.options import requested_loss
from fpmatch.cli.progress import ProgressBars
from fpmatch.printable import json_text, printable
from fpmatch.text_table import count

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from fpmatch.gallery.identify import Identification
    from fpmatch.gallery.identify_fused import FusedIdentification
    from fpmatch.gallery.listing.entry import Entry
    from fpmatch.gallery.listing.print_file import PrintFile
    from fpmatch.matching.calibration import Calibration


_COLUMNS: Final = f"  rank  score  {'FMR':<18}  by chance  {'subject':<12}  fingers"


def identify_by_fingers(
    gallery: str,
    probes: Sequence[PrintFile],
    others: Sequence[PrintFile],
    positions: Sequence[str],
    reading: Mapping[str, Any],
    *,
    matcher: str,
    curve: Calibration,
    workers: int | None,
    scheduler: str | None,
    as_json: bool,
    **limits: Any,
) -> int:
    """Run the command with one probe and prints of other fingers; `reading` is of the reader."""
    from fpmatch.gallery.candidates import identify_entries_fused
    from fpmatch.gallery.engine.engine import make_engine
    from fpmatch.gallery.gallery import open_gallery
    from fpmatch.gallery.listing.prints import extract_print, folder_reader
    from fpmatch.gallery.search import open_search
    from fpmatch.reading import group_by_note

    with fast_imports():
        import scipy.optimize  # noqa: F401  (which assigns probes to fingers, while time is taken)

    if not others:
        raise click.UsageError("--finger goes with --with")
    if len(probes) > 1:
        raise click.UsageError(f"--with goes with one PROBE, not with {len(probes)}")
    files = [*probes, *others]
    if positions and len(positions) != len(files):
        names_given = count(len(positions), "name")
        raise click.UsageError(f"--finger names all prints: {len(files)}, not {names_given}")
    known = [file.label.finger if file.label else "" for file in files]
    reader = folder_reader(files, **reading)
    extracted = [extract_print(file, reader=reader) for file in files]
    with open_gallery(gallery) as opened:
        say_slow_kernels()
        with ProgressBars({"prepare": "preparing prints"}) as bars:
            search = open_search(
                opened,
                matcher,
                engine=make_engine(workers, scheduler),
                progress=bars.show,
                note=say_note,
                candidate_list=limits["candidate_list"],
                loss=requested_loss(),
            )
        start = time.perf_counter()
        result, entries = identify_entries_fused(
            opened,
            search,
            [one.template for one in extracted],
            positions=positions or known,
            calibration=curve,
            engine=None if scheduler is None else make_engine(None, scheduler),
            workers=workers,
            **limits,
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
    show(json_text(document) if as_json else _as_text(names, result, entries, seconds))
    return 0


def _as_text(
    probes: Sequence[str],
    result: FusedIdentification,
    entries: Mapping[int, Entry],
    seconds: float,
) -> str:
    from fpmatch.drawing.words import odds

    of_all = f" of {result.enrolled}" if result.preselected else ""
    compared = f"{result.compared}{of_all} {'print' if result.enrolled == 1 else 'prints'} compared"
    head = f"{' with '.join(map(printable, probes))}: {compared} in {seconds:.2f} s"
    head += in_stages(result)
    if not result.candidates:
        return f"{head}, no candidate"
    smallest, extrapolated = result.smallest_measured_fmr, False
    lines = [head, _COLUMNS]
    for one in result.candidates:
        beyond = one.fmr < smallest
        extrapolated |= beyond
        rate = f"{odds(one.fmr)}{' *' if beyond else ''}"
        fingers = (f"{printable(entries[f.number].label)} {f.score:.1f}" for f in one.fingers)
        lines.append(
            f"  {one.rank:>4}  {one.score:>5.1f}  {rate:<18}  {one.expected_false:>9.2g}  "
            f"{printable(one.subject):<12}  {', '.join(fingers)}"
        )
    if extrapolated:
        lines.append(f"  * extrapolated: measured up to {odds(smallest)}")
    return "\n".join(lines)


def in_stages(result: Identification | FusedIdentification) -> str:
    """Return what a search in stages has passed on, for which loss; "" for another."""
    if result.loss is None:
        return ""
    by_index, by_descriptors = (f"{passed:,}" for passed in result.passed_on[:2])
    return f" (loss {100 * result.loss:g}%: {by_index} by index, {by_descriptors} by descriptors)"
