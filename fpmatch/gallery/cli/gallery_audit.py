"""`fpmatch gallery audit`: the audit of a gallery."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any, Final

import click

from fpmatch.cli.command import Group
from fpmatch.cli.notes import show as print_text
from fpmatch.cli.notes import show_line
from fpmatch.cli.options import json_array_option, json_option
from fpmatch.gallery.cli.notes import json_lines
from fpmatch.printable import count, json_text, printable

_HASH_DIGITS: Final = 64
_GALLERY: Final = click.argument("gallery")


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
    """


@audit.command(
    epilog="""\b
Examples:
  fpmatch gallery audit show prints.db
  fpmatch gallery audit show prints.db --json | jq '.[] | select(.action == "remove")'
"""
)
@_GALLERY
@json_array_option
def show(gallery: str, as_json: bool) -> None:
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
  fpmatch gallery audit verify prints.db --expect 1204:5d0c2a...

All entries are read. That the last lines are missing, or that all were written anew, cannot be seen
from the audit alone, but from a number of lines and the last hash that were noted elsewhere:
--expect compares them.

Exit status: 0 when the audit is whole, 2 when a line was changed, removed or inserted, or the
gallery was changed without an event.
"""
)
@_GALLERY
@click.option(
    "--expect",
    metavar="N:HASH",
    callback=_expected,
    help="Check that line N has this hash: that an earlier state is a part of this one.",
)
@json_option
def verify(gallery: str, expect: tuple[int, str] | None, as_json: bool) -> None:
    """Check the audit of GALLERY and its entries; print the number of events and the last hash."""
    from fpmatch.gallery.gallery import open_gallery
    from fpmatch.gallery.store.audit import check_audit

    with open_gallery(gallery) as opened:
        state = check_audit(opened, expect=expect)
        opened.check_rows()
    words = f"{count(state.events, 'event')}, last hash {state.last}"
    print_text(json_text(asdict(state)) if as_json else words)


@audit.command(
    epilog="""\b
Examples:
  fpmatch gallery audit switch prints.db on
  fpmatch gallery audit switch prints.db off --yes
"""
)
@_GALLERY
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


def _as_text(event: dict[str, Any]) -> str:
    known = ("time", "client", "action")
    time, client, action = (printable(event.get(key, "-")) for key in known)
    details = {k: v for k, v in event.items() if k not in {*known, "previous", "state"}}
    return f"{time}  {client}  {action}  {json_text(details, indent=None)}"
