"""`fpmatch gallery audit`: the audit of a gallery, or a file of its lines."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.cli.command import Group
from fpmatch.cli.notes import show as print_text
from fpmatch.cli.notes import show_line
from fpmatch.cli.options import json_array_option, json_option
from fpmatch.gallery.cli.notes import json_lines
from fpmatch.printable import count, json_text, printable

if TYPE_CHECKING:
    from collections.abc import Iterator
    from contextlib import AbstractContextManager

    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.store.audit_chain import AuditState

_HASH_DIGITS: Final = 64


def _expected(
    ctx: click.Context, param: click.Parameter, value: str | None
) -> tuple[int, str] | None:
    """Return the number and the hash that an option contains."""
    if value is None:
        return None
    number, _, digest = value.partition(":")
    if not (number.isascii() and number.isdecimal() and len(digest) == _HASH_DIGITS):
        raise click.BadParameter(f"{value!r} is not of the form NUMBER:HASH, as verify prints it")
    return int(number[:18]), digest.lower()


@click.group(
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

    A LOG is a file of such lines as `show --lines` prints.
    """


_PLACE: Final = click.argument("place", metavar="GALLERY|LOG")


@audit.command(
    epilog="""\b
Examples:
  fpmatch gallery audit show prints.db
  fpmatch gallery audit show audit.jsonl --json | jq '.[] | select(.action == "remove")'
"""
)
@_PLACE
@click.option(
    "--lines",
    is_flag=True,
    hidden=True,
    help="Print the lines as they are stored: a file of them can be kept elsewhere and verified.",
)
@json_array_option
def show(place: str, lines: bool, as_json: bool) -> None:
    """Print the events in the audit of a GALLERY, or in a LOG."""
    from fpmatch.gallery.store.audit_chain import follow_chain

    with _opened(place) as gallery:
        if lines:
            for line in _lines(place, gallery):
                show_line(line.decode("ascii", "backslashreplace").removesuffix("\n"))
            return
        events = (event for _, _, event in follow_chain(_lines(place, gallery), place))
        for text in json_lines(events) if as_json else map(_as_text, events):
            print_text(text)


@audit.command(
    epilog="""\b
Examples:
  fpmatch gallery audit verify prints.db
  fpmatch gallery audit verify prints.db --expect 1204:5d0c...

Each line contains the hash of the line before it. That the last lines are missing shows only if the
number of lines and the last hash, which this command prints, were noted elsewhere: --expect
compares them.

Exit status: 0 when the audit is whole, 2 when a line was changed, removed or inserted, or the
gallery was changed without an event.
"""
)
@_PLACE
@click.option(
    "--expect",
    metavar="N:HASH",
    callback=_expected,
    help="Check that line N has this hash: that an earlier state is a part of this one.",
)
@json_option
def verify(place: str, expect: tuple[int, str] | None, as_json: bool) -> None:
    """Check all lines of the audit of a GALLERY, or of a LOG; print their number and last hash."""
    with _opened(place) as gallery:
        state = _check(place, gallery, expect)
    if as_json:
        print_text(json_text(asdict(state)))
    else:
        show_line(f"{count(state.events, 'event')}, last hash {state.last}")


@audit.command(
    epilog="""\b
Examples:
  fpmatch gallery audit switch prints.db on
  fpmatch gallery audit switch prints.db off --yes
"""
)
@click.argument("gallery")
@click.argument("state", metavar="on|off", type=click.Choice(["on", "off"]))
@click.option("--yes", is_flag=True, help="Confirm off, which becomes the last event.")
def switch(gallery: str, state: str, yes: bool) -> None:
    """Let GALLERY keep an audit from now on, or none any more."""
    from fpmatch.gallery.gallery import open_gallery
    from fpmatch.gallery.store.audit import turn_off, turn_on

    if yes and state == "on":
        raise click.UsageError("--yes confirms off")
    if state == "off" and not yes:
        raise click.UsageError("off ends the audit, which then shows nothing more: add --yes")
    with open_gallery(gallery) as opened:
        changed = (turn_on if state == "on" else turn_off)(opened)
        show_line(f"{opened.name}: audit {state}{'' if changed else ', as it was before'}")


def _opened(place: str) -> AbstractContextManager[Gallery | None]:
    """Return the gallery at a place; None where it is a log."""
    from fpmatch.gallery.gallery import open_gallery
    from fpmatch.gallery.listing.kinds import kind_of

    return open_gallery(place) if kind_of(place) == "gallery" else nullcontext()


def _lines(place: str, gallery: Gallery | None) -> Iterator[bytes]:
    from fpmatch.gallery.store.audit import audit_lines
    from fpmatch.gallery.store.audit_chain import log_lines

    return log_lines(place) if gallery is None else audit_lines(gallery)


def _check(place: str, gallery: Gallery | None, expect: tuple[int, str] | None) -> AuditState:
    from fpmatch.gallery.store.audit import check_audit
    from fpmatch.gallery.store.audit_chain import check_audit_log

    if gallery is None:
        return check_audit_log(place, expect=expect)
    state = check_audit(gallery, expect=expect)
    gallery.check_rows()
    return state


def _as_text(event: dict[str, Any]) -> str:
    known = ("time", "client", "action")
    time, client, action = (printable(event.get(key, "-")) for key in known)
    details = {k: v for k, v in event.items() if k not in {*known, "previous", "state"}}
    return f"{time}  {client}  {action}  {json_text(details, indent=None)}"
