"""History of a gallery: the states it has had, and the entries that were removed from it.

What is derived from a gallery follows its changes by this, at a cost that does not grow with the
gallery. Triggers of the database write it, so that it has the changes of earlier versions and of
other programs, too. It contains no name and no template, only numbers of entries and random states.
A gallery of an earlier version has none before its next change.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Final

import sqlalchemy as sa
from sqlalchemy.exc import DBAPIError

from fpmatch.gallery.store.tables import ENTRY, GALLERY

UNKNOWN: Final = -1
"""Number of the last removal where a gallery has no history."""

_metadata = sa.MetaData()  # not of the tables that every gallery has

STATE: Final = sa.Table(
    "fpmatch_state",
    _metadata,
    sa.Column("state", sa.Text, primary_key=True),  # of the gallery, now or before
    sqlite_with_rowid=False,
)
REMOVAL: Final = sa.Table(
    "fpmatch_removal",
    _metadata,
    sa.Column("number", sa.Integer, primary_key=True),
    sa.Column("entry", sa.Integer, nullable=False),
    sa.Column("finger", sa.Integer),  # least number of an entry of its finger that was left
    sqlite_autoincrement=True,
)

_KEEP_STATE: Final = (
    "INSERT INTO fpmatch_state (state) SELECT NEW.state "
    "WHERE NOT EXISTS (SELECT 1 FROM fpmatch_state WHERE state = NEW.state);"
)
_KEEP_REMOVAL: Final = (
    "INSERT INTO fpmatch_removal (entry, finger) VALUES (OLD.id, (SELECT min(id) "
    "FROM fpmatch_entry WHERE subject = OLD.subject AND finger = OLD.finger));"
)
_FORGET: Final = (  # no earlier state is one from which the changes are known
    "DELETE FROM fpmatch_state; UPDATE fpmatch_gallery SET state = {random};"
)
_INSERTED: Final = "NEW.id < (SELECT max(id) FROM fpmatch_entry)"
_TRIGGERS: Final = {  # when it runs, and what it does on a condition
    "state": ("UPDATE OF state ON fpmatch_gallery", _KEEP_STATE, ""),
    "removal": ("DELETE ON fpmatch_entry", _KEEP_REMOVAL, ""),
    "insert": ("INSERT ON fpmatch_entry", _FORGET, _INSERTED),
    "update": ("UPDATE OF id, subject, finger ON fpmatch_entry", _FORGET, ""),
}
_RANDOM: Final = {
    "sqlite": "lower(hex(randomblob(16)))",
    "postgresql": "md5(random()::text || clock_timestamp()::text)",
}


@dataclass(frozen=True, slots=True)
class Revision:
    """State of a gallery at one moment, since which its changes can be read.

    `state` is replaced by every change, `last` is the greatest number of an entry (0 if there is
    none), and `removals` the number of the last removal (`UNKNOWN` where there is no history).
    """

    state: str
    last: int
    removals: int


@dataclass(frozen=True, slots=True)
class Removal:
    """One removed entry; `finger` is the least number of an entry left of its finger, or None."""

    entry: int
    finger: int | None


def has_history(connection: sa.Connection) -> bool:
    """Return whether a gallery has a history that can be read."""
    if connection.dialect.name == "sqlite":
        query = "SELECT count(*) FROM sqlite_master WHERE name LIKE 'fpmatch_history_%'"
        return connection.exec_driver_sql(query).scalar() == len(_TRIGGERS)
    query = " AND ".join(
        f"coalesce(has_table_privilege(to_regclass('{table.name}'), 'SELECT'), false)"
        for table in (STATE, REMOVAL)
    )
    return bool(connection.exec_driver_sql(f"SELECT {query}").scalar())


def keep_history(connection: sa.Connection) -> None:
    """Let a gallery have a history from now on, if this user may create tables.

    No other transaction may write meanwhile.
    """
    if has_history(connection):
        return
    with suppress(DBAPIError), connection.begin_nested():
        _metadata.create_all(connection, checkfirst=False)
        _create_triggers(connection)
        states = sa.select(GALLERY.c.state)
        connection.execute(STATE.insert().from_select([STATE.c.state], states))


def _create_triggers(connection: sa.Connection) -> None:
    dialect = connection.dialect.name
    for name, (event, action, condition) in _TRIGGERS.items():
        done, full = action.format(random=_RANDOM[dialect]), f"fpmatch_history_{name}"
        if dialect == "sqlite":
            when = f"WHEN {condition} " if condition else ""
            connection.exec_driver_sql(
                f"CREATE TRIGGER {full} AFTER {event} {when}BEGIN {done} END"
            )
            continue
        body = f"IF {condition} THEN {done} END IF;" if condition else done
        connection.exec_driver_sql(  # as its owner: who may enrol need not write these tables
            f"CREATE FUNCTION {full}() RETURNS trigger LANGUAGE plpgsql SECURITY DEFINER "
            f"SET search_path FROM CURRENT AS $$ BEGIN {body} RETURN NULL; END $$"
        )
        connection.exec_driver_sql(
            f"CREATE TRIGGER {full} AFTER {event} FOR EACH ROW EXECUTE FUNCTION {full}()"
        )


def revision(connection: sa.Connection) -> Revision:
    """Return the revision of a gallery, in a time that does not depend on its size."""
    state = connection.scalar(sa.select(GALLERY.c.state))
    last = connection.scalar(sa.select(sa.func.max(ENTRY.c.id))) or 0
    removals = UNKNOWN
    if has_history(connection):
        removals = connection.scalar(sa.select(sa.func.max(REMOVAL.c.number))) or 0
    return Revision(str(state), last, removals)


def removals_since(connection: sa.Connection, before: Revision) -> list[Removal] | None:
    """Return what was removed since a revision, in order; None if that is not known."""
    if before.removals == UNKNOWN or not has_history(connection):
        return None
    if connection.scalar(sa.select(STATE.c.state).where(STATE.c.state == before.state)) is None:
        return None
    since = REMOVAL.c.number > before.removals
    left = ENTRY.c.id.in_(sa.select(REMOVAL.c.entry).where(since))
    if connection.scalar(sa.select(ENTRY.c.id).where(left).limit(1)) is not None:
        return None  # no number is given again
    query = sa.select(REMOVAL.c.entry, REMOVAL.c.finger).where(since)
    removals = [Removal(*row) for row in connection.execute(query.order_by(REMOVAL.c.number))]
    kinds = [(type(one.entry), type(one.finger)) for one in removals]
    return removals if {*kinds} <= {(int, int), (int, type(None))} else None


def was_removed(connection: sa.Connection, number: int) -> bool:
    """Return whether an entry may have been removed; without a history it may."""
    if not has_history(connection):
        return True
    removals = sa.select(REMOVAL.c.number).where(REMOVAL.c.entry == number)
    return connection.execute(removals).first() is not None
