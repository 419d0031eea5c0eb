"""The audit of a gallery: who did what, one line an event, chained by hashes in its database.

The event of a change is committed with the change. Each line contains the SHA-256 of the line
before it, so that a line that is changed, removed or inserted is found. That the last lines are
missing, or all were written anew, cannot be seen from the lines alone: keep their number and the
last hash elsewhere.
"""

from __future__ import annotations

import getpass
import hashlib
import os
import platform
from contextvars import ContextVar
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeVar

import sqlalchemy as sa

from fpmatch.base.parsing import ParseError, parse_json
from fpmatch.gallery.store.tables import AUDIT, ENTRY, GALLERY, parts
from fpmatch.printable import json_text

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping

    from fpmatch.gallery.store.database import Database

Result = TypeVar("Result")

ON: Final = "audit on"
OFF: Final = "audit off"
START: Final = "0" * 64  # what the first line contains in place of a hash
OPERATOR: Final = "FPMATCH_OPERATOR"  # environment variable: who uses the commands
_STATE_DIGITS: Final = 16  # of the random state of a gallery, in each event
_LABEL: Final = ("subject", "finger", "impression")
_client: ContextVar[str | None] = ContextVar("fpmatch_client", default=None)


def is_on(connection: sa.Connection) -> bool:
    """Return whether a gallery keeps an audit now."""
    last = _last(connection)
    return last is not None and (_parsed(last[1]) or {}).get("action") != OFF


def switch(gallery: Database, *, on: bool) -> bool:
    """Let a gallery keep an audit from now on, or none any more; return whether that is new."""
    with gallery.changing() as connection:
        if is_on(connection) == on:
            return False
        AUDIT.create(connection, checkfirst=True)
        _append(connection, ON if on else OFF, {})
    return True


def record(connection: sa.Connection, action: str, **details: Any) -> None:
    """Append an event, if the gallery keeps an audit, within `Database.changing`.

    `details` are JSON values, never pictures or templates; see `labels_of`.
    """
    if is_on(connection):
        _append(connection, action, details)


def ranges(numbers: Iterable[int]) -> str:
    """Return numbers of entries as text that is short for many.

    Examples
    --------
    >>> ranges([3, 1, 2, 7])
    '1-3,7'
    """
    spans: list[list[int]] = []
    for number in sorted(numbers):
        if spans and number == spans[-1][1] + 1:
            spans[-1][1] = number
        else:
            spans.append([number, number])
    return ",".join(str(a) if a == b else f"{a}-{b}" for a, b in spans)


def labels_of(
    connection: sa.Connection, *, numbers: Collection[int] = (), contents: Collection[bytes] = ()
) -> list[dict[str, Any]]:
    """Return numbers and labels of entries, for an event; none where there is no audit.

    They are chosen by number or by the SHA-256 of their pictures, which is added then.
    """
    if not is_on(connection):
        return []
    column = ENTRY.c.content if contents else ENTRY.c.id
    chosen: list[Any] = list(contents or numbers)
    names = (ENTRY.c.id, ENTRY.c.subject, ENTRY.c.finger, ENTRY.c.impression, ENTRY.c.content)
    labels = []
    for part in parts(chosen):
        query = sa.select(*names).where(column.in_(part)).order_by(ENTRY.c.id)
        for number, *cells, content in connection.execute(query):
            shown = [cell if isinstance(cell, str) else repr(cell) for cell in cells]  # if damaged
            label = dict(zip(_LABEL, shown, strict=True))
            picture = {"sha256": content.hex()} if contents else {}
            labels.append({"number": number, **label, **picture})
    return labels


def events_of(gallery: Database) -> Iterator[tuple[int, str, dict[str, Any]]]:
    """Yield number, hash and event of each line, checked against the line before it.

    Raises GalleryError, which names the line, if one was changed, removed or inserted ("changed"),
    or is "damaged"; or if the gallery never kept an audit ("no audit").
    """
    with gallery.reading() as connection:
        if _last(connection) is None:
            why = "keeps no audit; `fpmatch gallery audit switch GALLERY on` turns it on"
            raise gallery.error(why, "no audit")
    previous, before = START, 0
    for rows, _ in gallery.pages(sa.select(AUDIT), AUDIT.c.number):
        for number, line in rows:
            event = _parsed(line)
            if event is None:
                raise gallery.error(f"line {number} is damaged", "damaged")
            if number != before + 1 or event.get("previous") != previous:
                why = f"line {number} does not follow the line before it: a line was changed, "
                why += "removed or inserted"
                raise gallery.error(why, "changed")
            previous, before = _hash_of(line), number
            yield number, previous, event


def check_audit(gallery: Database, *, expect: tuple[int, str] | None = None) -> tuple[int, str]:
    """Check the audit of a gallery, and its entries against their events.

    Returns the number of lines and the hash of the last. With `expect`, an earlier state of these,
    it is checked that it is a part of this one.
    Raises GalleryError as `events_of`, and with these codes: "changed" if the line of that number
    has another hash, "shortened" if there are fewer lines, "unrecorded" if the last change has no
    event, "exchanged" if an entry has not the label and the picture that were enrolled with its
    number, "missing" or "removed" if an entry, or its removal, was undone without an event.
    """
    with gallery.reading() as connection:
        state = _state(connection)
    number, last, event = 0, START, dict[str, Any]()
    stated = _Stated({}, set(), set())
    for number, last, event in events_of(gallery):
        try:
            stated.follow(event)
        except (KeyError, TypeError) as error:
            raise gallery.error(f"line {number} is damaged", "damaged") from error
        if expect is not None and number == expect[0] and last != expect[1].lower():
            why = f"line {number} is not the one expected: the lines up to it were written anew"
            raise gallery.error(why, "changed")
    if expect is not None and number < expect[0]:
        why = f"has {number} lines, not the {expect[0]} expected: the last ones were removed"
        raise gallery.error(why, "shortened")
    with gallery.reading() as connection:
        unchanged = _state(connection) == state
    if unchanged and event.get("action") != OFF and event.get("state") != state:
        why = "was changed after the last event, and not by this fpmatch: no event states it"
        raise gallery.error(why, "unrecorded")
    query = sa.select(ENTRY.c.id, *(ENTRY.c[name] for name in _LABEL), ENTRY.c.content)
    for rows, _ in gallery.pages(query, ENTRY.c.id):
        for entry, *label, content in rows:
            if entry in stated.removed:
                raise gallery.error(f"entry {entry} was removed, and is there again", "removed")
            own = _identity(label, bytes(content).hex())
            if stated.enrolled.pop(entry, own) != own:
                why = f"entry {entry} is not the print that was enrolled with this number"
                raise gallery.error(why, "exchanged")
    for entry in stated.enrolled.keys() - stated.unsure if unchanged else ():
        raise gallery.error(f"entry {entry} is missing, and no event states its removal", "missing")
    return number, last


class _Stated(NamedTuple):
    """What events state of entries: their label and picture, hashed, by number.

    Entries with `unsure` numbers may have been removed while no audit was kept.
    """

    enrolled: dict[int, bytes]
    removed: set[int]
    unsure: set[int]

    def follow(self, event: Mapping[str, Any]) -> None:
        match event["action"]:
            case "enrol":
                for one in event["entries"]:
                    label = [one[name] for name in _LABEL]
                    self.enrolled[one["number"]] = _identity(label, one["sha256"])
            case "remove":
                for one in event["entries"]:
                    self.enrolled.pop(one["number"], None)
                    self.removed.add(one["number"])
            case "audit off":
                self.unsure.update(self.enrolled)


def _identity(label: list[Any], sha256: str) -> bytes:
    """Return a hash of the label and the picture of an entry."""
    return hashlib.sha256(repr((label, sha256)).encode()).digest()[:16]


def _hash_of(line: str) -> str:
    """Return the hash by which the next line refers to a line."""
    return hashlib.sha256(f"{line}\n".encode("utf-8", "replace")).hexdigest()


def _parsed(line: object) -> dict[str, Any] | None:
    """Return the event of a line, or None where it is damaged."""
    try:
        event = parse_json(str(line).encode("utf-8", "replace"))
    except ParseError:
        return None
    return event if isinstance(event, dict) else None


def _state(connection: sa.Connection) -> str:
    return str(connection.scalar(sa.select(GALLERY.c.state)))[:_STATE_DIGITS]


def _last(connection: sa.Connection) -> tuple[int, str] | None:
    """Return number and text of the last line; None where there is none."""
    if not sa.inspect(connection).has_table(AUDIT.name):
        return None
    row = connection.execute(sa.select(AUDIT).order_by(AUDIT.c.number.desc()).limit(1)).first()
    return None if row is None else (int(row.number), str(row.line))


def _append(connection: sa.Connection, action: str, details: Mapping[str, Any]) -> None:
    number, line = _last(connection) or (0, "")
    event = {
        "time": datetime.now(UTC).isoformat(timespec="milliseconds"),
        "client": current_client(),
        "action": action,
        **details,
        "state": _state(connection),
        "previous": _hash_of(line) if number else START,
    }
    added = json_text(event, indent=None)
    connection.execute(AUDIT.insert().values(number=number + 1, line=added))


def act_as(client: str, work: Callable[..., Result], *args: Any) -> Result:
    """Return ``work(*args)``, done for a client.

    Examples
    --------
    >>> act_as("ada", current_client)
    'ada'
    """
    token = _client.set(client)
    try:
        return work(*args)
    finally:
        _client.reset(token)


def current_client() -> str:
    """Return who requests this: of `act_as`, else $FPMATCH_OPERATOR, else user and host."""
    if (named := _client.get()) is not None:
        return named
    system = f"{_system_user()}@{platform.node() or 'localhost'}"
    operator = os.environ.get(OPERATOR, "").strip()
    return f"{operator} ({system})" if operator else system


def _system_user() -> str:
    """Return the user of this process as the system has it, not its environment."""
    try:
        import pwd  # noqa: PLC0415  (not on Windows)
    except ImportError:
        return getpass.getuser()
    try:
        return pwd.getpwuid(os.getuid()).pw_name
    except KeyError:
        return str(os.getuid())
