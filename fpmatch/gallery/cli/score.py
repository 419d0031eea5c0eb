"""`fpmatch score`: all comparisons of two batches, in a file."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_note, say_notes, say_slow_kernels, show
from fpmatch.cli.options import (
    file_option,
    json_option,
    matcher_option,
    output_option,
    reading_options,
)
from fpmatch.cli.progress import ProgressBars
from fpmatch.gallery.cli.notes import notes_as_json, say_failures
from fpmatch.gallery.cli.options import (
    check_where,
    key_option,
    pattern_option,
    scheduler_option,
    workers_option,
)
from fpmatch.printable import count, json_text, printable

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.gallery.batch.score import ScoreSummary
    from fpmatch.image.io.grey import RawSize
    from fpmatch.image.quality.polarity import Polarity

_STAGES: Final = {
    "references": "reading references",
    "probes": "reading probes",
    "compare": "comparing pairs",
}
_SIDE: Final = "DIR|MANIFEST|GALLERY"


@click.command(
    cls=Command,
    details="""
A side is a folder or manifest of images, whose templates are extracted, or of templates, or a
gallery. Folders are read as by fpmatch evaluate, but prints may have any name.

\b
Columns, as those of fpmatch evaluate --scores:
  matcher, set      the matcher; the database
  probe, reference  the prints: file names of a folder, paths of a manifest, labels of a gallery
  genuine           1 or 0: same finger or not; empty where neither the list of pairs states it,
                    nor the sides are the same prints or both manifests
  similarity        the matcher's own, to the last bit; of matcher paper the share of the smaller
                    print's minutiae that are paired, where more than rho (0.6) is a match
  score             -10 log10 of the false match rate, 0 to 100; empty without a calibration
  decision          match, no match or inconclusive, at the default threshold
  reason            where there is no similarity: which print has no template, and why
  probe_quality, reference_quality
                    quality of the images, 0 to 100; empty for templates

\b
Order of the rows:
  That of the list; without one, every probe with the first 256 references, one probe after the
  other, then every probe with the next 256.

\b
Interrupted:
  The same command resumes the run, and writes the same file. Until that is complete, the state
  is kept in OUT.unfinished.
""",
    epilog="""\b
Examples:
  fpmatch score --references enrolled --probes seized -o scores.csv
  fpmatch score --references prints.db --probes seized -o hits.csv --threshold 40
  fpmatch score --references prints --probes prints --pairs list.csv -o scores.csv
  fpmatch score --references prints.db --probes seized -o scores.csv --scheduler tcp://host:8786

Exit status: 0 when every pair has a similarity, 1 when some prints have no template (their pairs
are rows with the reason), 2 when the run could not be done.
""",
)
@click.option(
    "--references",
    metavar=_SIDE,
    required=True,
    help="Folder of prints, manifest (CSV with path and subject), or gallery (file or URL).",
)
@click.option("--probes", metavar=_SIDE, required=True, help="The same for the other side.")
@output_option(metavar="OUT.csv", help="File of scores.")
@file_option(
    "--pairs",
    metavar="LIST",
    help="Score these pairs only: columns probe, reference and perhaps genuine (1 or 0).  "
    "[default: all]",
)
@pattern_option
@click.option(
    "--threshold", type=float, metavar="SCORE", help="Keep only rows of this score or more."
)
@matcher_option
@file_option(
    "--calibration",
    metavar="FILE",
    hidden=True,
    help="Score as fitted by fpmatch calibrate.  [default: the matcher's own]",
)
@reading_options
@workers_option
@scheduler_option
@json_option
@key_option
def score(
    references: str,
    probes: str,
    output: Path,
    pattern: str | None,
    matcher: str,
    calibration: Path | None,
    dpi: float | None,
    polarity: Polarity,
    raw: tuple[RawSize, ...],
    workers: int | None,
    scheduler: str | None,
    as_json: bool,
    **choice: Any,
) -> int:
    """Score probes against references, each with each, and write a row a pair.

    The rows are the same with processes of this machine and with a Dask cluster, whose workers may
    join and leave.
    """
    from fpmatch.gallery.batch import score as scoring
    from fpmatch.gallery.engine.engine import make_engine
    from fpmatch.gallery.listing.entry import NamePattern
    from fpmatch.matching.calibration import load_calibration
    from fpmatch.matching.registry import get_matcher
    from fpmatch.prints.reading import ASSUMED_DPI, PrintReader

    check_where(workers, scheduler)
    fitted = load_calibration(get_matcher(matcher).name, calibration) if calibration else None
    say_slow_kernels()
    try:
        with make_engine(workers, scheduler) as engine, ProgressBars(_STAGES) as bars:
            done = scoring.score(
                references,
                probes,
                output,
                matcher=matcher,
                calibration=fitted,
                engine=engine,
                progress=bars.show,
                once=True,
                dpi=dpi,
                polarity=polarity,
                reader=PrintReader(raw, quiet=True),
                pattern=None if pattern is None else NamePattern(pattern),
                **choice,
            )
    except KeyboardInterrupt:
        say_note("the same command resumes the run")
        raise
    if done.resumed == done.pairs:
        say_note(f"{printable(done.output)}: done already")
    say_notes({ASSUMED_DPI: done.dpi_assumed, **done.noted} if done.dpi_assumed else done.noted)
    if done.identical:
        pairs = [f"{probe} with {reference}" for probe, reference in done.identical_pairs]
        shown = f"{'; '.join(pairs[:3])}{' and others' * (done.identical > len(pairs[:3]))}"
        say_note(f"{count(done.identical, 'pair')} of identical prints: {shown}")
    say_failures([f"{one.side}: {one.name}: {one.reason}" for one in done.failures])
    show(json_text(_as_dict(done)) if as_json else _as_text(done))
    return 1 if done.failures or done.failed_pairs else 0


def _as_text(done: ScoreSummary) -> str:
    sides = f"{count(done.probes, 'probe')} against {count(done.references, 'reference')}"
    pairs = [f"{count(done.pairs, 'pair')}"]
    pairs += [f"{done.resumed} of them before"] if done.resumed else []
    pairs += [f"{done.failed_pairs} without a score"] if done.failed_pairs else []
    rate = f" ({done.rate:.0f} a second)" if done.rate else ""
    return "\n".join(
        [
            f"{sides}: {', '.join(pairs)}: {done.seconds:.1f} s{rate}",
            f"{printable(done.output)}: {count(done.rows, 'row')}",
        ]
    )


def _as_dict(done: ScoreSummary) -> dict[str, Any]:
    return {
        "output": str(done.output),
        "references": done.references,
        "probes": done.probes,
        "pairs": done.pairs,
        "rows": done.rows,
        "resumed": done.resumed,
        "failed_pairs": done.failed_pairs,
        "failures": [asdict(failure) for failure in done.failures],
        "dpi_assumed": len(done.dpi_assumed),
        "notes": notes_as_json(done.noted),
        "identical": {"pairs": done.identical, "first": list(map(list, done.identical_pairs))},
        "seconds": round(done.seconds, 3),
        "pairs_per_second": round(done.rate, 1),
    }
