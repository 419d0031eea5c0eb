"""`fpmatch enrol`: pictures become entries of a gallery."""

from __future__ import annotations

import time
from contextlib import ExitStack
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import click

from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_notes, say_slow_kernels, show
from fpmatch.cli.options import MIRROR, RECORD, json_option, reading_options
from fpmatch.cli.progress import ProgressBars
from fpmatch.gallery.cli.notes import notes_as_json, say_failures
from fpmatch.gallery.cli.options import (
    check_where,
    key_option,
    places_argument,
    scheduler_option,
    workers_option,
)
from fpmatch.printable import count, json_text, printable

if TYPE_CHECKING:
    from fpmatch.gallery.tasks.enrol import Enrolment
    from fpmatch.image.io.grey import RawSize
    from fpmatch.image.quality.polarity import Polarity


@click.command(
    cls=Command,
    details="""
A MANIFEST is a CSV file with the columns path and subject, and perhaps finger, impression and dpi,
which lists prints. The entries of another gallery are enrolled with their labels: templates by the
million are best kept in one.

Each file is enrolled once, whatever its name: an interrupted run continues when it is started
again, and two may enrol at the same time. Prints that are added to subjects that existed before are
counted, and named where they match none of them.

A pattern is a regular expression with the group subject and, where names contain them, the groups
finger and impression. It must match the end of the path, without its extension, from the beginning
of a name on. The default is that of FVC's names, as 101_3.tif.

\b
More examples:
  fpmatch enrol prints.db monday.db tuesday.db
  fpmatch enrol prints.db scans --scheduler tcp://host:8786
  fpmatch enrol prints.db ada bob --pattern '(?P<subject>\\w+)/(?P<finger>\\w+)-(?P<impression>\\d)'
""",
    epilog="""\b
Examples:
  fpmatch enrol prints.db prints
  fpmatch enrol postgresql://me@host/prints /scans/monday /scans/tuesday
  fpmatch enrol prints.db manifest.csv --min-quality 40
  fpmatch enrol prints.db prints --encrypt --key file:keys.txt

Exit status: 0 when all are enrolled, 1 when some could not be (`fpmatch gallery list GALLERY
--failures` lists them with the reasons), 2 when the run could not be done.
""",
)
@click.argument("gallery")
@places_argument("places", metavar="FILE|DIR|MANIFEST|GALLERY...")
@click.option("--pattern", metavar="REGEX", help="Pattern of file names; see --help-all.")
@reading_options
@RECORD
@MIRROR
@click.option(
    "--min-quality",
    metavar="N",
    type=click.IntRange(0, 100),
    default=0,
    show_default=False,
    help="Refuse images of lower quality, 0 to 100, as fpmatch inspect shows it.",
)
@click.option(
    "--strict",
    is_flag=True,
    hidden=True,
    help="Refuse prints that match none of up to eight other impressions of their finger: they are "
    "of another finger or of another part of the skin (see fpmatch gallery check); and prints that "
    "are probably two in one, or that no finger can have. Otherwise these, and the former of "
    "subjects that existed before, are named and enrolled.",
)
@click.option(
    "--audit",
    is_flag=True,
    hidden=True,
    help="Let GALLERY keep an audit of who does what with it (see fpmatch gallery audit).",
)
@click.option(
    "--encrypt",
    is_flag=True,
    help="Encrypt the gallery that is made with the current key of --key; refuse one that is not "
    "encrypted.",
)
@workers_option
@scheduler_option
@json_option
@key_option
def enrol(
    gallery: str,
    places: tuple[str, ...],
    pattern: str | None,
    dpi: float | None,
    polarity: Polarity,
    min_quality: int,
    strict: bool,
    encrypt: bool,
    audit: bool,
    raw: tuple[RawSize, ...],
    record: int | None,
    mirror: bool,
    workers: int | None,
    scheduler: str | None,
    as_json: bool,
) -> int:
    """Enrol prints in GALLERY: a file, or the URL of a PostgreSQL database.

    A print is an image or a template; of a folder, its images are enrolled or, if it has none, its
    templates, else the prints of its subfolders, one a finger, or one a subject with one a finger
    in it. A MANIFEST lists prints in a CSV file; the entries of another GALLERY are enrolled, too.
    The gallery is made where it is missing; an interrupted run continues when it is started again.
    """
    check_where(workers, scheduler)
    from fpmatch.gallery.encryption.keys import load_keys
    from fpmatch.gallery.engine.engine import make_engine
    from fpmatch.gallery.gallery import open_gallery
    from fpmatch.gallery.listing.entry import NamePattern
    from fpmatch.gallery.listing.manifest import kind_of
    from fpmatch.gallery.listing.prints import find_prints
    from fpmatch.gallery.store.audit import switch
    from fpmatch.gallery.tasks import enrol as work
    from fpmatch.gallery.tasks.enrol import Enrolment
    from fpmatch.prints.reading import PrintReader

    if encrypt:
        load_keys()  # before any work
    galleries = [place for place in places if kind_of(place) == "gallery"]
    others = [place for place in places if place not in galleries]
    if not others and (pattern is not None or dpi is not None or min_quality):
        why = "--pattern, --dpi and --min-quality are not for the entries of galleries"
        raise click.UsageError(why)
    names = None if pattern is None else NamePattern(pattern)
    prints = find_prints(others, dpi, pattern=names)
    if len(prints) > 1:
        say_slow_kernels()
    start = time.perf_counter()
    with ExitStack() as stack:
        sources = [stack.enter_context(open_gallery(place)) for place in galleries]
        engine = stack.enter_context(make_engine(workers, scheduler))
        opened = stack.enter_context(open_gallery(gallery, create=True, encrypt=encrypt))
        bars = stack.enter_context(ProgressBars({"enrol": "enrolling"}))
        if audit:
            switch(opened, on=True)
        done = Enrolment(opened, strict=strict)
        for source in sources:
            work.enrol_gallery(opened, source, progress=bars.show, into=done)
        if others:
            work.enrol(
                opened,
                prints,
                pattern=names,
                engine=engine,
                progress=bars.show,
                into=done,
                min_quality=min_quality,
                polarity=polarity,
                dpi=dpi,
                reader=PrintReader(raw, quiet=True, record=record, mirror=mirror),
            )
        impressions, subjects = len(opened), opened.subjects()
        name = opened.name
    seconds = time.perf_counter() - start
    say_notes(done.noted)
    failed = [f"{one.source}: {one.reason}" for one in done.failures]
    say_failures(failed, f"; `fpmatch gallery list {name} --failures` shows all")
    unmatched = [f"{one.source}: {one.reason}" for one in done.unmatched]
    say_failures(unmatched, "; --json lists all", word="no match")
    if as_json:
        document = _as_dict(done) | {"seconds": round(seconds, 3)}
        sizes = {"impressions": impressions, "subjects": subjects}
        show(json_text({"gallery": name, **document, **sizes}))
    else:
        show(_as_text(done, seconds))
        held = f"{count(impressions, 'impression')} of {count(subjects, 'subject')}"
        show(f"{printable(name)}: {held}")
    return 1 if done.failures else 0


def _as_text(done: Enrolment, seconds: float) -> str:
    """Return a line on what was enrolled, and one on prints of subjects that existed before."""
    total = done.enrolled + done.known + len(done.failures)
    counts = [f"enrolled {done.enrolled} of {count(total, 'picture')}"]
    counts += [f"{done.known} were enrolled before"] if done.known else []
    counts += [f"{len(done.failures)} failed"] if done.failures else []
    rate = f" ({done.enrolled / seconds:.1f} a second)" if done.enrolled else ""
    line = f"{', '.join(counts)}: {seconds:.1f} s{rate}"
    if not done.added:
        return line
    added = count(sum(done.added.values()), "impression")
    existing = f"{count(len(done.added), 'subject')} that existed before"
    return f"{line}\n{added} added to {existing}; {len(done.unmatched)} of them match no other"


def _as_dict(done: Enrolment) -> dict[str, Any]:
    from fpmatch.prints.reading import ASSUMED_DPI

    noted = dict(done.noted)
    return {
        "enrolled": done.enrolled,
        "known": done.known,
        "failed": len(done.failures),
        "failures": [asdict(failure) for failure in done.failures],
        "dpi_assumed": len(noted.pop(ASSUMED_DPI, ())),
        "notes": notes_as_json(noted),
        "added": {"impressions": sum(done.added.values()), "subjects": len(done.added)},
        "unmatched": [asdict(one) for one in done.unmatched],
    }
