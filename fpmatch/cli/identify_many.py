"""`fpmatch identify -o`: the candidates of many probes, in a file."""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch.cli.notes import (
    notes_as_json,
    say_damaged,
    say_failures,
    say_note,
    say_notes,
    show,
)
from fpmatch.cli.options import requested_loss
from fpmatch.cli.progress import ProgressBars
from fpmatch.printable import json_text, printable
from fpmatch.text_table import count

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.evaluation.batch.candidates import SearchOptions, SearchSummary
    from fpmatch.evaluation.batch.sources import FolderSource
    from fpmatch.gallery.listing.print_file import PrintFile

STAGES: Final = {"prepare": "preparing prints", "identify": "searching"}
WORKERS_NEED: Final = (
    "fpmatch.evaluation.batch.candidates",
    "fpmatch.matching.matchers.unit_circle",
)


def probe_source(
    places: Sequence[Path], files: Sequence[PrintFile], **reading: Any
) -> FolderSource:
    """Return the prints of some places as the probes of a batch; they are read later."""
    from fpmatch.evaluation.batch.sources import FolderSource

    above = (
        places[0] if len(places) == 1 else Path(os.path.commonpath([p.absolute() for p in places]))
    )
    return FolderSource(above, files, reading["dpi"], reading["polarity"], reading["reader"])


def identify_to_file(
    gallery: str,
    probes: FolderSource,
    output: Path,
    options: SearchOptions,
    *,
    matcher: str,
    workers: int | None,
    scheduler: str | None,
    as_json: bool,
) -> int:
    """Write the candidates of all probes; return the exit status of the command."""
    from fpmatch.evaluation.batch.candidate_rows import check_candidates_format
    from fpmatch.evaluation.batch.candidates import write_candidates
    from fpmatch.gallery.engine.engine import make_engine
    from fpmatch.gallery.engine.local import start_fork_server
    from fpmatch.gallery.gallery import open_gallery
    from fpmatch.gallery.search import open_search
    from fpmatch.output import check_writable

    check_candidates_format(output)
    check_writable(output)
    if scheduler is None:
        start_fork_server(workers, *WORKERS_NEED)
    engine = partial(make_engine, workers, scheduler)
    try:
        with open_gallery(gallery) as opened, ProgressBars(STAGES) as bars:
            content = opened.content_hash()
            search = open_search(
                opened,
                matcher,
                engine=engine(),
                progress=bars.show,
                note=say_note,
                candidate_list=options.candidate_list,
                loss=requested_loss(),
            )
            done = write_candidates(
                opened,
                search,
                probes,
                output,
                options,
                content=content,
                engine=engine(),
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
        show(json_text({**shown, "damaged": len(damaged), **_as_dict(done)}))
    else:
        show(_as_text(done))
    return 0 if not done.failed else 1 if done.failed < done.probes else 2


def _as_text(done: SearchSummary) -> str:
    from fpmatch.evaluation.batch.candidate_rows import is_json_lines

    counts = [count(done.probes, "probe")]
    counts += [f"{done.resumed} of them before"] if done.resumed else []
    counts += [f"{done.failed} without a template"] if done.failed else []
    rate = f" ({done.rate:.1f} a second)" if done.rate else ""
    head = f"{', '.join(counts)}: {done.seconds:.1f} s{rate}"
    what = "line" if is_json_lines(done.output) else "row"
    return f"{head}\n{printable(done.output)}: {count(done.rows, what)}"


def _as_dict(done: SearchSummary) -> dict[str, Any]:
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
