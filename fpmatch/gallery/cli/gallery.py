"""`fpmatch gallery`: commands that show and change a gallery."""

from __future__ import annotations

from dataclasses import asdict
from itertools import chain
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.cli.command import Group
from fpmatch.cli.notes import say_note, show, show_line
from fpmatch.cli.options import json_array_option
from fpmatch.cli.progress import ProgressBars
from fpmatch.errors import GalleryError
from fpmatch.gallery.cli.gallery_audit import audit
from fpmatch.gallery.cli.gallery_rewrite import rewrite
from fpmatch.gallery.cli.notes import json_lines, say_damaged
from fpmatch.gallery.cli.options import key_option
from fpmatch.printable import count, json_text, printable

if TYPE_CHECKING:
    from collections.abc import Iterable

    from fpmatch.gallery.listing.entry import Entry, GallerySummary

_HEADER: Final = f"number  {'print':<16}  {'dpi':>5}  minutiae  picture"
_ARGUMENT: Final = click.argument("gallery")


@click.group(
    cls=Group,
    epilog="""\b
Examples:
  fpmatch gallery list prints.db
  fpmatch gallery list prints.db --summary
  fpmatch gallery check prints.db
  fpmatch gallery rewrite prints.db --encrypt --key file:keys.txt
  fpmatch gallery list postgresql://me@host/prints
""",
)
def gallery() -> None:
    """Show, check and change a gallery, which `fpmatch enrol` makes.

    A gallery is a file, or the URL of a PostgreSQL database.
    """


def _summary_text(name: str, s: GallerySummary) -> str:
    n = max(s.impressions, 1)
    failures = f"{count(s.failures, 'picture')} could not be enrolled" if s.failures else "none"
    damaged = [("Damaged", f"{count(s.damaged, 'entry', 'entries')}, not counted here")]
    rows = [
        ("Impressions", f"{s.impressions} of {count(s.subjects, 'subject')}"),
        ("Resolution", ", ".join(f"{k} at {dpi:g} dpi" for dpi, k in s.dpi.items()) or "none"),
        ("Minutiae", f"{s.minutiae}, {s.minutiae / n:.0f} an impression"),
        ("Templates", f"{s.template_bytes} bytes, {s.template_bytes / n:.0f} an impression"),
        ("Failures", failures),
        *[("Encryption", f"key {key}") for key in s.keys],
        ("Format", f"version {s.version}"),
        *(damaged if s.damaged else []),
    ]
    return "\n".join([printable(name), *(f"  {label:<12}{text}" for label, text in rows)])


@gallery.command(
    "list",
    details="""\b
Columns:
  number   of the entry, for fpmatch gallery remove
  print    its label: subject, finger and impression, joined by _
  dpi      resolution
  minutiae how many
  picture  that was enrolled
""",
    epilog="""\b
Examples:
  fpmatch gallery list prints.db
  fpmatch gallery list prints.db --summary
  fpmatch gallery list prints.db --subject 101 --json
  fpmatch gallery list prints.db --failures
""",
)
@_ARGUMENT
@click.option("--summary", is_flag=True, help="Print counts and sizes alone; an object as JSON.")
@click.option("--subject", metavar="NAME", help="List the impressions of this subject only.")
@click.option("--failures", is_flag=True, help="List what could not be enrolled, and why.")
@json_array_option
@key_option
def list_(gallery: str, summary: bool, subject: str | None, failures: bool, as_json: bool) -> None:
    """List the impressions of GALLERY, what could not be enrolled, or its counts and sizes."""
    from fpmatch.gallery.gallery import open_gallery
    from fpmatch.gallery.store.summary import summarize

    if summary + failures + (subject is not None) > 1:
        raise click.UsageError("--summary, --failures and --subject exclude each other")
    with open_gallery(gallery) as opened:
        if summary:
            counted, name = summarize(opened), opened.name
            document = {"gallery": name, **counted.as_dict()}
            show(json_text(document) if as_json else _summary_text(name, counted))
            return
        opened.record("list", subject=subject, failures=failures)
        if failures:
            failed = opened.failures()
            rows: Iterable[dict[str, Any]] = map(asdict, failed)
            lines: Iterable[str] = (f"{one.source}: {one.reason}" for one in failed)
        else:
            entries = opened.entries(subject=subject)
            rows, lines = (entry.as_dict() for entry in entries), map(_entry_line, entries)
            lines = chain([_HEADER], lines)
        for line in json_lines(rows) if as_json else lines:
            show_line(line)
        say_damaged(opened.name, opened.damaged)


def _entry_line(entry: Entry) -> str:
    return (
        f"{entry.id:>6}  {printable(entry.label):<16}  {entry.dpi:>5g}  {entry.minutiae:>8}  "
        f"{printable(entry.source)}"
    )


@gallery.command(
    epilog="""\b
Examples:
  fpmatch gallery check prints.db
  fpmatch gallery check prints.db --subject 101 --json

Exit status: 0 when the impressions of every finger are linked by matches, 1 when those of some
finger are not or an entry is damaged, 2 when the gallery cannot be checked, or entries were lost or
exchanged.
"""
)
@_ARGUMENT
@click.option("--subject", metavar="NAME", help="Check the fingers of this subject only.")
@json_array_option
@key_option
def check(gallery: str, subject: str | None, as_json: bool) -> int:
    """Find fingers whose impressions in GALLERY do not match each other, and damaged entries.

    The impressions of each finger are compared with each other. Listed are fingers whose
    impressions fall into groups without a match between them, with the best-scoring pair between
    the largest group and each other: a group may be of another finger. Small touches of one finger
    that share no skin do not match either. Damaged entries, which every command skips, are listed
    with reasons; `fpmatch gallery remove` removes them, and the prints can be enrolled again.
    """
    from fpmatch.gallery.gallery import open_gallery
    from fpmatch.gallery.store.audit import AuditError, check_audit
    from fpmatch.gallery.tasks.consistency import check_fingers, find_damaged

    stages = {"read": "reading entries", "check": "comparing"}
    faults: list[str] = []
    with open_gallery(gallery) as opened, ProgressBars(stages) as bars:
        if subject is None:
            if fault := opened.structure_fault():
                lost = "entries may be missing, or under other names; restore a copy"
                faults.append(f"{opened.name}: the database is damaged ({fault}): {lost}")
            try:
                check_audit(opened)  # before this check becomes its last event
            except AuditError as error:
                faults.append(str(error))
            except GalleryError as error:
                if error.code != "no audit":
                    raise
        damaged = find_damaged(opened, subject=subject, progress=bars.show)
        wanted = None
        if subject is not None:
            entries = map(opened.find_entry, opened.numbers_of(subject))
            wanted = {entry.label.subject for entry in entries if entry is not None}
        checks = list(check_fingers(opened, subjects=wanted, progress=bars.show))
    doubtful = [check for check in checks if not check.consistent]
    if as_json:
        # of the same form as the checks of fingers, for programs that read these only
        rows = [
            {"subject": None, "finger": None, "consistent": False, "groups": [[number]]}
            | {"disagreements": [], "damaged": why}
            for number, why in damaged.items()
        ]
        show(json_text([*(check.as_dict() for check in checks), *rows]))
    else:
        for one in doubtful:
            sizes = ", ".join(str(len(group)) for group in one.groups)
            show_line(f"{one.name}: groups of {sizes} impressions do not match each other")
            for pair in one.disagreements:
                show_line(f"  {pair}")
        several = count(len(checks), "finger")
        for number, why in damaged.items():
            show_line(f"entry {number} is damaged: {why}")
        lost = f"; {count(len(damaged), 'damaged entry', 'damaged entries')}" if damaged else ""
        show(f"{several} with several impressions checked, {len(doubtful)} doubtful{lost}")
    for fault in faults:
        say_note(fault)
    return 2 if faults else 1 if doubtful or damaged else 0


@gallery.command(
    epilog="""\b
Examples:
  fpmatch gallery remove prints.db 17 18
  fpmatch gallery remove prints.db --subject 101
  fpmatch gallery remove prints.db --failures
"""
)
@_ARGUMENT
@click.argument("numbers", metavar="[NUMBER]...", nargs=-1, type=int)
@click.option("--subject", metavar="NAME", help="Remove all impressions of this subject.")
@click.option("--failures", is_flag=True, help="Clear the list of what could not be enrolled.")
def remove(gallery: str, numbers: tuple[int, ...], subject: str | None, failures: bool) -> None:
    """Remove impressions from GALLERY.

    Each NUMBER is one that `fpmatch gallery list` shows; all are removed, or none.
    """
    from fpmatch.gallery.gallery import open_gallery

    if not numbers and subject is None and not failures:
        raise click.UsageError("nothing to remove: give a NUMBER, --subject or --failures")
    with open_gallery(gallery) as opened:
        chosen = [*numbers, *([] if subject is None else opened.numbers_of(subject))]
        removed = opened.remove(chosen) if chosen else 0
        cleared = opened.clear_failures() if failures else 0
        left, name = len(opened), opened.name
    done = [f"removed {count(removed, 'impression')}"] if chosen else []
    done += [f"cleared {count(cleared, 'failure')}"] if failures else []
    show_line(f"{', '.join(done)}; {count(left, 'impression')} left: {name}")


gallery.add_command(audit)
gallery.add_command(rewrite)
