"""The audit of a gallery: a table of the lines of `audit_chain`, in its database.

The event of a change is committed with the change. Triggers refuse to change or remove lines; who
owns the database can remove the triggers, too, but not restore the chain up to a hash noted before.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from fpmatch.gallery.store.audit_chain import (
    START,
    AuditError,
    AuditState,
    check_chain,
    current_client,
    event_line,
    hash_of,
    parse_line,
)
from fpmatch.gallery.store.tables import ENTRY, GALLERY, parts

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping

    from fpmatch.gallery.store.database import Database

ON: Final = "audit on"
OFF: Final = "audit off"
AUDIT: Final = sa.Table(
    "fpmatch_audit",
    sa.MetaData(),  # not of the tables that every gallery has
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("line", sa.Text, nullable=False),
)
_STATE_DIGITS: Final = 16  # of the random state of a gallery, in each event
_LINES_PER_READ: Final = 1000
_REFUSED: Final = "the audit of a gallery is only appended to"
_SQLITE_TRIGGERS: Final = (
    *(
        f"CREATE TRIGGER fpmatch_audit_{event} BEFORE {event} ON fpmatch_audit "
        f"BEGIN SELECT RAISE(ABORT, '{_REFUSED}'); END"
        for event in ("update", "delete")
    ),
    "CREATE TRIGGER fpmatch_audit_insert BEFORE INSERT ON fpmatch_audit "  # or replace
    "WHEN EXISTS (SELECT 1 FROM fpmatch_audit WHERE number >= NEW.number) "
    f"BEGIN SELECT RAISE(ABORT, '{_REFUSED}'); END",
)
_POSTGRESQL_TRIGGERS: Final = (
    "CREATE FUNCTION fpmatch_audit_refuse() RETURNS trigger LANGUAGE plpgsql AS "
    f"$$ BEGIN RAISE EXCEPTION '{_REFUSED}'; END $$",
    "CREATE TRIGGER fpmatch_audit_refuse BEFORE UPDATE OR DELETE OR TRUNCATE ON fpmatch_audit "
    "FOR EACH STATEMENT EXECUTE FUNCTION fpmatch_audit_refuse()",
)


def is_on(connection: sa.Connection) -> bool:
    """Return whether a gallery keeps an audit now."""
    last = _last(connection)
    return last is not None and _event(last[1]).get("action") != OFF


def lock(connection: sa.Connection) -> None:
    """Let no other transaction write to the gallery until this one ends."""
    connection.execute(sa.select(GALLERY.c.id).with_for_update())


def turn_on(gallery: Database) -> bool:
    """Let a gallery keep an audit from now on; return whether it did not before."""
    with gallery.writing() as connection:
        lock(connection)
        if is_on(connection):
            return False
        if not sa.inspect(connection).has_table(AUDIT.name):
            AUDIT.create(connection)
            sqlite = connection.dialect.name == "sqlite"
            for statement in _SQLITE_TRIGGERS if sqlite else _POSTGRESQL_TRIGGERS:
                connection.exec_driver_sql(statement)
        _append(connection, ON, {})
    return True


def turn_off(gallery: Database) -> bool:
    """Let a gallery keep no audit any more, as its last event; return whether it did before."""
    with gallery.writing() as connection:
        lock(connection)
        if not is_on(connection):
            return False
        _append(connection, OFF, {})
    return True


def record(connection: sa.Connection, action: str, **details: Any) -> None:
    """Append an event, if the gallery keeps an audit, within a transaction that has its `lock`.

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
            label = dict(zip(("subject", "finger", "impression"), shown, strict=True))
            picture = {"sha256": content.hex()} if contents else {}
            labels.append({"number": number, **label, **picture})
    return labels


def audit_lines(gallery: Database) -> Iterator[bytes]:
    """Yield the lines of a gallery's audit; GalleryError (code "no audit") if it never kept one."""
    after = 0
    while True:
        with gallery.reading() as connection:
            if not after and _last(connection) is None:
                why = "keeps no audit; `fpmatch gallery audit switch GALLERY on` turns it on"
                raise gallery.error(why, "no audit")
            query = sa.select(AUDIT.c.number, AUDIT.c.line).where(AUDIT.c.number > after)
            rows = connection.execute(query.order_by(AUDIT.c.number).limit(_LINES_PER_READ)).all()
        for number, line in rows:
            yield str(line).encode("utf-8", "replace") + b"\n"
            after = number
        if len(rows) < _LINES_PER_READ:
            return


def check_audit(gallery: Database, *, expect: tuple[int, str] | None = None) -> AuditState:
    """Check the audit of a gallery, as `check_chain`, and that its last change has its event."""
    with gallery.reading() as connection:
        last = _last(connection)
        state = _state(connection) if last is not None else ""
    checked = check_chain(audit_lines(gallery), gallery.name, expect=expect)
    event = {} if last is None else _event(last[1])
    if event.get("action") != OFF and event.get("state") != state:
        why = "was changed after the last event, and not by this fpmatch: no event states it"
        raise AuditError(why, path=gallery.name, code="unrecorded")
    return checked


def _state(connection: sa.Connection) -> str:
    return str(connection.scalar(sa.select(GALLERY.c.state)))[:_STATE_DIGITS]


def _event(line: str) -> dict[str, Any]:
    """Return the event of a line; an empty one where the line is damaged."""
    return parse_line(line.encode() + b"\n") or {}


def _last(connection: sa.Connection) -> tuple[int, str] | None:
    """Return number and text of the last line; None where there is none."""
    if not sa.inspect(connection).has_table(AUDIT.name):
        return None
    query = sa.select(AUDIT.c.number, AUDIT.c.line).order_by(AUDIT.c.number.desc()).limit(1)
    row = connection.execute(query).first()
    return None if row is None else (int(row.number), str(row.line))


def _append(connection: sa.Connection, action: str, details: Mapping[str, Any]) -> None:
    number, line = _last(connection) or (0, "")
    previous = hash_of(line.encode() + b"\n") if number else START
    stated = {**details, "state": _state(connection)}
    added = event_line(previous, current_client(), action, stated).decode().removesuffix("\n")
    connection.execute(AUDIT.insert().values(number=number + 1, line=added))
