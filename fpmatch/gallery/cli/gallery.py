"""`fpmatch gallery`: commands that show and change a gallery, and its audit."""

from __future__ import annotations

from dataclasses import asdict
from itertools import chain
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.cli.command import Group
from fpmatch.cli.notes import say_note, show, show_line
from fpmatch.cli.options import json_array_option, json_option
from fpmatch.cli.progress import ProgressBars
from fpmatch.errors import GalleryError
from fpmatch.gallery.cli.notes import json_lines, say_damaged
from fpmatch.gallery.cli.options import key_option
from fpmatch.printable import count, json_text, printable

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from fpmatch.gallery.listing.entry import Entry

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


def _summary_text(name: str, counted: Mapping[str, Any]) -> str:
    rows = {**counted, "keys": ", ".join(counted["keys"]) or "none"}
    lines = (f"  {key:<16}{value}" for key, value in rows.items())
    return "\n".join([printable(name), *lines])


@gallery.command(
    "list",
    epilog="""\b
Examples:
  fpmatch gallery list prints.db
  fpmatch gallery list prints.db --summary
  fpmatch gallery list prints.db --subject 101 --json
  fpmatch gallery list prints.db --failures
""",
)
@_ARGUMENT
@click.option("--summary", is_flag=True, help="Print counts alone; an object as JSON.")
@click.option("--subject", metavar="NAME", help="List the impressions of this subject only.")
@click.option("--failures", is_flag=True, help="List what could not be enrolled, and why.")
@json_array_option
@key_option
def list_(gallery: str, summary: bool, subject: str | None, failures: bool, as_json: bool) -> None:
    """List the impressions of GALLERY, what could not be enrolled, or its counts."""
    from fpmatch.gallery.gallery import open_gallery

    if summary + failures + (subject is not None) > 1:
        raise click.UsageError("--summary, --failures and --subject exclude each other")
    with open_gallery(gallery) as opened:
        if summary:
            counted, name = opened.summarize(), opened.name
            show(
                json_text({"gallery": name, **counted}) if as_json else _summary_text(name, counted)
            )
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
    from fpmatch.gallery.listing.entry import Label
    from fpmatch.gallery.store.audit import check_audit
    from fpmatch.gallery.tasks.consistency import check_fingers, find_damaged

    stages = {"read": "reading entries", "check": "comparing"}
    fault = ""
    with open_gallery(gallery) as opened, ProgressBars(stages) as bars:
        try:
            if subject is None:
                check_audit(opened)  # before this check becomes its last event
        except GalleryError as error:
            fault = "" if error.code == "no audit" else str(error)
        damaged = find_damaged(opened, subject=subject, progress=bars.show)
        checks = list(check_fingers(opened, subject=subject, progress=bars.show))
    doubtful = [check for check in checks if not check["consistent"]]
    if as_json:
        # of the same form as the checks of fingers, for programs that read these only
        rows = [
            {"subject": None, "finger": None, "consistent": False, "groups": [[number]]}
            | {"disagreements": [], "damaged": why}
            for number, why in damaged.items()
        ]
        show(json_text([*checks, *rows]))
    else:
        for one in doubtful:
            name = Label(one["subject"], one["finger"])
            sizes = ", ".join(str(len(group)) for group in one["groups"])
            show_line(f"{name}: groups of {sizes} impressions do not match each other")
            for pair in one["disagreements"]:
                first, second = pair["ids"]
                text = f"entry {second} does not match entry {first}, score {pair['score']:.1f}"
                show_line(f"  {text}")
        several = count(len(checks), "finger")
        for number, why in damaged.items():
            show_line(f"entry {number} is damaged: {why}")
        lost = f"; {count(len(damaged), 'damaged entry', 'damaged entries')}" if damaged else ""
        show(f"{several} with several impressions checked, {len(doubtful)} doubtful{lost}")
    if fault:
        say_note(fault)
    return 2 if fault else 1 if doubtful or damaged else 0


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


@gallery.command(
    details="""
On SQLite the file is rewritten; meanwhile the disk must have room for a second copy, and no other
program may use the gallery: if one holds it for a minute, the command ends. On PostgreSQL its
tables are rewritten by VACUUM FULL, which only their owner may do; the server's write-ahead log and
backups keep what they have. What versions up to 0.2 removed, which did not overwrite it, is erased.

With --encrypt, the source of the keys has the new key first, as `fpmatch key --add` puts it,
and the key that the gallery uses. A gallery that is not encrypted is encrypted; nothing of its
plain templates is left in its files. Other programs wait meanwhile. A run that is killed has
changed nothing, or all: start it again.
""",
    epilog="""\b
Examples:
  fpmatch gallery rewrite prints.db
  fpmatch gallery rewrite prints.db --encrypt --key file:keys.txt

Exit status: 0 when it is done, 1 when some templates are damaged, which are left as they are, 2
when it could not be done; the gallery is whole then.
""",
)
@_ARGUMENT
@click.option("--encrypt", is_flag=True, help="Seal all templates with the current key of --key.")
@json_option
@key_option
def rewrite(gallery: str, encrypt: bool, as_json: bool) -> int:
    """Rewrite GALLERY without free space, or with its templates encrypted.

    Without --encrypt, traces of removed prints in its index are erased, too.
    """
    from fpmatch.gallery.gallery import free_space, open_gallery, rotate

    with open_gallery(gallery) as opened, ProgressBars({"rotate": "encrypting"}) as bars:
        name, text = opened.name, f"{opened.name}: rewritten"
        document = dict[str, Any]()
        if encrypt:
            document = rotate(opened, progress=bars.show)
            sealed = count(document["sealed"], "template")
            text = f"{name}: encrypted with key {document['key']}; {sealed} rewritten"
        else:
            free_space(opened)
    damaged = document.get("damaged", [])
    for one in damaged:
        say_note(f"{name}: entry {one['id']}, left as it is: {one['reason']}")
    show(json_text({"gallery": name, **document}) if as_json else printable(text))
    return 1 if damaged else 0


@gallery.group(
    cls=Group,
    epilog="""\b
Examples:
  fpmatch gallery audit show prints.db
  fpmatch gallery audit verify prints.db
  fpmatch gallery audit switch prints.db on

The client of an event is the name of a token of the server; for commands it is the user of the
system and the host, after the name in FPMATCH_OPERATOR if that is set. Times are UTC.
""",
)
def audit() -> None:
    """Show and verify who did what with a gallery, and when; switch this on or off.

    The audit of a GALLERY contains who enrolled, searched, compared, listed, removed or exported
    what, by commands and over HTTP; the event of a change is stored together with the change. It
    contains neither pictures nor templates. An action whose event cannot be stored is not done.
    """


@audit.command(
    "show",
    epilog="""\b
Examples:
  fpmatch gallery audit show prints.db
  fpmatch gallery audit show prints.db --json | jq '.[] | select(.action == "remove")'
""",
)
@_ARGUMENT
@json_array_option
def show_(gallery: str, as_json: bool) -> None:
    """Print the events in the audit of GALLERY."""
    from fpmatch.gallery.gallery import open_gallery
    from fpmatch.gallery.store.audit import events_of

    with open_gallery(gallery) as opened:
        events = (event for _, _, event in events_of(opened))
        for line in json_lines(events) if as_json else map(_as_text, events):
            show_line(line)


@audit.command(
    epilog="""\b
Examples:
  fpmatch gallery audit verify prints.db
  fpmatch gallery audit verify prints.db --expect 1204 5d0c2a...

All entries are read. That the last lines are missing, or that all were written anew, cannot be seen
from the audit alone, but from a number of lines and the last hash that were noted elsewhere:
--expect compares them.

Exit status: 0 when the audit is whole, 2 when a line was changed, removed or inserted, or the
gallery was changed without an event.
"""
)
@_ARGUMENT
@click.option(
    "--expect",
    metavar="N HASH",
    type=(click.IntRange(0), str),
    help="Check that line N has this hash: that an earlier state is a part of this one.",
)
@json_option
def verify(gallery: str, expect: tuple[int, str] | None, as_json: bool) -> None:
    """Check the audit of GALLERY and its entries; print the number of events and the last hash."""
    from fpmatch.gallery.gallery import open_gallery
    from fpmatch.gallery.store.audit import check_audit

    with open_gallery(gallery) as opened:
        events, last = check_audit(opened, expect=expect)
        opened.check_rows()
    words = f"{count(events, 'event')}, last hash {last}"
    show(json_text({"events": events, "last": last}) if as_json else words)


@audit.command(
    "switch",
    epilog="""\b
Examples:
  fpmatch gallery audit switch prints.db on
  fpmatch gallery audit switch prints.db off
""",
)
@_ARGUMENT
@click.argument("state", metavar="on|off", type=click.Choice(["on", "off"]))
def switch_(gallery: str, state: str) -> None:
    """Let GALLERY keep an audit from now on, or, after a last event, none any more."""
    from fpmatch.gallery.gallery import open_gallery
    from fpmatch.gallery.store.audit import switch

    with open_gallery(gallery) as opened:
        changed = switch(opened, on=state == "on")
        show_line(f"{opened.name}: audit {state}{'' if changed else ', as it was before'}")


def _as_text(event: dict[str, Any]) -> str:
    known = ("time", "client", "action")
    time, client, action = (printable(event.get(key, "-")) for key in known)
    details = {k: v for k, v in event.items() if k not in {*known, "previous", "state"}}
    return f"{time}  {client}  {action}  {json_text(details, indent=None)}"
