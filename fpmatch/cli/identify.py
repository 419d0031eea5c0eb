"""`fpmatch identify`: the enrolled prints that are most like a probe."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.cli.polarity import polarity_option
from fpmatch.cli.progress import ProgressBars
from fpmatch.cli.raw import raw_option
from fpmatch.cli.reading import read_print
from fpmatch.cli.words import count
from fpmatch.errors import FpmatchError
from fpmatch.matching.matchers import DEFAULT_MATCHER
from fpmatch.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from fpmatch.gallery.entry import Entry
    from fpmatch.gallery.identify import Candidate, Identification, Shortlist
    from fpmatch.image.io.raw import RawSize
    from fpmatch.image.quality.polarity import Polarity

_STAGES: Final = {"prepare": "preparing prints"}


@dataclass(frozen=True, slots=True)
class _Found:
    """What was found for one probe, the entries of its candidates, and the time it took."""

    probe: Path
    result: Identification
    entries: list[Entry]
    seconds: float


def _shortlist_size(ctx: click.Context, param: click.Parameter, value: str) -> Shortlist:
    """Return a number from 1 on, or `auto` or `off`."""
    if value == "auto":
        return "auto"
    if value == "off":
        return "off"
    if not value.isdecimal() or int(value) < 1:
        raise click.BadParameter(f"{value!r} is not a number from 1 on, auto or off")
    return int(value)


@click.command(
    epilog="""\b
Columns:
  score      -10 log10 of the FMR, 0 to 100; of a finger, from all its impressions together
  FMR        share of comparisons with other fingers, of as many impressions, that score as high
  by chance  so many of the fingers searched would score as high if the finger were not enrolled
  print      subject, finger and impression; of a finger, its most similar impression
  number     of the entry, as `fpmatch gallery list` shows it
  picture    that was enrolled

\b
Examples:
  fpmatch identify prints.db probe.tif
  fpmatch identify prints.db probes -k 3 --threshold 40 --json
  fpmatch identify postgresql://me@host/prints probe.tif --transform
  fpmatch identify prints.db probe.tif --impressions
  fpmatch identify touches.db probe.tif --consolidate

Exit status: 0 when every probe was searched for, 1 when some could not be read, 2 when none could.
"""
)
@click.argument("gallery")
@click.argument(
    "probes", metavar="PROBE...", nargs=-1, required=True, type=click.Path(path_type=Path)
)
@click.option(
    "-k",
    "candidates",
    metavar="N",
    type=click.IntRange(min=1),
    default=10,
    show_default=True,
    help="List so many candidates, at most.",
)
@click.option(
    "--threshold",
    type=float,
    metavar="SCORE",
    default=0.0,
    help="Leave out candidates that score less, 0 to 100; this command ranks and does not decide.",
)
@click.option("--transform", "transforms", is_flag=True, help="Tell how the probe lies on each.")
@click.option(
    "--impressions",
    is_flag=True,
    help="List impressions, each by its own score, instead of fingers, by the score of all their "
    "impressions together.",
)
@click.option(
    "--consolidate",
    is_flag=True,
    help="Compare each candidate also with the consolidated template of its impressions, and rank "
    "the candidates anew.",
)
@click.option("--dpi", type=float, help="Resolution of the probes, in dots per inch.")
@polarity_option
@raw_option
@click.option("--matcher", default=DEFAULT_MATCHER, show_default=True, help="Matcher to use.")
@click.option(
    "--calibration",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="Scores as `fpmatch calibrate` has fitted them to prints of your own.",
)
@click.option(
    "--shortlist",
    metavar="N|auto|off",
    callback=_shortlist_size,
    default="auto",
    show_default=True,
    help="Compare the probe with the N prints that the codes of all of them favour; auto: with all "
    "of up to 20,000 prints, of more with 1 in 100, but 1,000 at least, in which are about 99 % of "
    "the prints that comparing all would find; off: with all.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    help="Processes that prepare the gallery.  [default: all cores]",
)
@click.pass_context
def identify(
    ctx: click.Context,
    /,
    gallery: str,
    probes: tuple[Path, ...],
    candidates: int,
    threshold: float,
    transforms: bool,
    dpi: float | None,
    polarity: Polarity,
    raw: tuple[RawSize, ...],
    matcher: str,
    calibration: Path | None,
    shortlist: Shortlist,
    impressions: bool,
    consolidate: bool,
    as_json: bool,
    workers: int | None,
) -> None:
    """Rank the fingers of GALLERY by how well they match each PROBE: image, template or folder.

    GALLERY is a file that `fpmatch enrol` made, or the URL of a PostgreSQL database. It is
    prepared when it is searched for the first time, and when it has changed.
    """
    from fpmatch.engine.engine import processes
    from fpmatch.gallery import identify as work
    from fpmatch.gallery.consolidated import ConsolidatedFingers
    from fpmatch.gallery.gallery import open_gallery
    from fpmatch.gallery.prints import extract_print, find_prints, folder_reader
    from fpmatch.gallery.search import open_search
    from fpmatch.matching.calibration import load_calibration

    if impressions and consolidate:
        raise click.UsageError("--consolidate ranks fingers: not with --impressions")
    curve = load_calibration(matcher, calibration)
    files = find_prints(probes, dpi)
    reader = folder_reader(files, polarity=polarity, dpi=dpi, reader=partial(read_print, raw=raw))
    done: list[_Found] = []
    failures: list[FpmatchError] = []
    assumed: list[Path] = []
    with open_gallery(gallery) as opened:
        with ProgressBars(_STAGES) as bars:
            search = open_search(opened, matcher, engine=processes(workers), progress=bars.show)
        together = ConsolidatedFingers(opened, search, curve) if consolidate else None
        for file in files:
            try:
                probe = extract_print(file, reader=reader)
            except FpmatchError as error:
                failures.append(error)
                continue
            if probe.dpi_assumed:
                assumed.append(file.path)
            start = time.perf_counter()
            result = work.identify(
                search,
                probe.template,
                count=candidates,
                threshold=threshold,
                transforms=transforms,
                calibration=curve,
                shortlist=shortlist,
                impressions=impressions,
                together=together,
            )
            seconds = time.perf_counter() - start
            entries = [opened.entry(candidate.number) for candidate in result.candidates]
            done.append(_Found(file.path, result, entries, seconds))
            if not as_json:
                click.echo(_in_words(done[-1]))
        name = opened.name
    _note(assumed, failures)
    if not done:
        ctx.exit(2)
    if as_json:
        document = {
            "gallery": name,
            "matcher": matcher,
            "enrolled": len(search),
            "compared": done[0].result.compared,
            "fingers": done[0].result.fingers,
            "listed": "impressions" if impressions else "fingers",
            "probes": [_as_dict(found) for found in done],
            "failures": [str(failure) for failure in failures],
        }
        click.echo(json.dumps(document, indent=2, allow_nan=False))
    ctx.exit(1 if failures else 0)


def _note(assumed: list[Path], failures: list[FpmatchError]) -> None:
    """Say on stderr what was assumed and what failed."""
    if assumed:
        others = f" and {count(len(assumed) - 1, 'other')}" if len(assumed) > 1 else ""
        click.echo(
            f"fpmatch: note: {assumed[0]}{others} taken for {STANDARD_DPI:g} dpi: nothing tells "
            "the resolution (--dpi does)",
            err=True,
        )
    for failure in failures:
        click.echo(f"fpmatch: error: {failure}", err=True)


def _in_words(found: _Found) -> str:
    from fpmatch.drawing.words import odds

    result = found.result
    compared = f"{count(result.compared, 'print')} compared in {found.seconds:.2f} s"
    if result.shortlisted:
        compared += f", the shortlist of {result.enrolled}"
    if not result.candidates:
        return f"{found.probe}: {compared}, no candidate"
    lines = [
        f"{found.probe}: {compared}",
        f"  rank  score  {'FMR':<18}  by chance  {'print':<12}  number  picture",
    ]
    extrapolated = False
    for candidate, entry in zip(result.candidates, found.entries, strict=True):
        beyond = candidate.fmr < result.fmr_reach
        extrapolated |= beyond
        rate = f"{odds(candidate.fmr)}{' *' if beyond else ''}"
        lines.append(
            f"  {candidate.rank:>4}  {candidate.score:>5.1f}  {rate:<18}  "
            f"{candidate.expected_false:>9.2g}  {entry.label!s:<12}  {entry.id:>6}  {entry.source}"
        )
        lines += [f"        {line}" for line in _transform_lines(candidate)]
    if extrapolated:
        lines.append(f"  * extrapolated: measured up to {odds(result.fmr_reach)}")
    return "\n".join(lines)


def _transform_lines(candidate: Candidate) -> list[str]:
    from fpmatch.report import transform_in_words

    comparison = candidate.comparison
    if comparison is None:
        return []
    if comparison.transform is None:
        return [f"no transform: {comparison.reason}"]
    pairs = count(len(comparison.pairs), "pair")
    return [f"{transform_in_words(comparison.transform)}; {pairs}, {comparison.rms_px:.1f} px rms"]


def _as_dict(found: _Found) -> dict[str, Any]:
    from fpmatch.gallery.documents import candidate_document

    return {
        "probe": str(found.probe),
        "seconds": round(found.seconds, 4),
        "candidates": [
            candidate_document(candidate, entry, found.result.fmr_reach)
            for candidate, entry in zip(found.result.candidates, found.entries, strict=True)
        ],
    }
