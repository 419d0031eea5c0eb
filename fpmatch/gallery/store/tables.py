"""Tables of a gallery's database, and conflicts of new prints with their entries."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Final, TypeVar

import sqlalchemy as sa

from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.store.database import DamagedRowError
from fpmatch.gallery.store.rows import as_entry
from fpmatch.templates.bounds import MOST_MINUTIAE
from fpmatch.templates.minutiae import MAX_DPI, MIN_DPI

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from fpmatch.gallery.listing.entry import EnrolmentRequest, Entry

Value = TypeVar("Value")

VERSION: Final = 3
"""Version of these tables and of their content; it grows with every change of either."""

_metadata = sa.MetaData()

GALLERY: Final = sa.Table(
    "fpmatch_gallery",
    _metadata,
    sa.Column("id", sa.Integer, sa.CheckConstraint("id = 1"), primary_key=True),
    sa.Column("version", sa.Integer, nullable=False),
    sa.Column("state", sa.Text, nullable=False),  # random, replaced by every change of entries
)

ENTRY: Final = sa.Table(
    "fpmatch_entry",
    _metadata,
    sa.Column("id", sa.Integer, primary_key=True),
    sa.Column("subject", sa.Text, nullable=False),
    sa.Column("finger", sa.Text, nullable=False),
    sa.Column("impression", sa.Text, nullable=False),
    sa.Column("source", sa.Text, nullable=False),
    sa.Column("content", sa.LargeBinary, nullable=False, unique=True),
    sa.Column("dpi", sa.Float(53), nullable=False),
    sa.Column("minutiae", sa.Integer, nullable=False),
    sa.Column("digest", sa.BigInteger),  # of the other columns but the number
    sa.Column("template", sa.LargeBinary, nullable=False),
    sa.UniqueConstraint("subject", "finger", "impression"),
    sqlite_autoincrement=True,  # the number of a removed entry is not given again
)

ABOUT: Final = [column for column in ENTRY.columns if column.name not in {"digest", "template"}]
"""The columns of an `Entry`, in the order of its fields."""
WHOLE: Final = sa.select(ENTRY)
"""Rows of `fpmatch.gallery.store.rows.as_packed` and `as_template`."""

FAILURE: Final = sa.Table(
    "fpmatch_failure",
    _metadata,
    sa.Column("source", sa.Text, primary_key=True),
    sa.Column("reason", sa.Text, nullable=False),
)

TABLES: Final = (GALLERY, ENTRY, FAILURE)
"""The tables that every gallery has."""

DPI_TOLERANCE: Final = 0.05  # resolutions in files have one decimal
VALUES_PER_QUERY: Final = 500  # which databases limit
_LABEL: Final = (ENTRY.c.subject, ENTRY.c.finger, ENTRY.c.impression)


_SQLITE_TYPES: Final = {
    sa.Integer: "integer",
    sa.Text: "text",
    sa.Float: "real",
    sa.LargeBinary: "blob",
}


@dataclass(frozen=True, slots=True)
class Conflict:
    """Why a print cannot be enrolled, and the file of the entry that it conflicts with, if any."""

    why: str
    source: str = ""

    def __str__(self) -> str:
        return f"{self.why} ({self.source})" if self.source else self.why


ENROLLED: Final = Conflict("")
"""What `Conflicts.find` returns for a print that is enrolled already."""


def is_sound(dialect: str) -> sa.ColumnElement[bool]:
    """Return the condition that the columns of an entry are of their types, and numbers possible.

    Templates are not read: their damage shows when `fpmatch.gallery.store.rows` reads them.
    """
    numbers = [ENTRY.c.dpi.between(MIN_DPI, MAX_DPI), ENTRY.c.minutiae.between(0, MOST_MINUTIAE)]
    if dialect != "sqlite":  # which alone keeps values of another type
        return sa.and_(*numbers)
    kinds = [(column, _SQLITE_TYPES[type(column.type)]) for column in (*ABOUT, ENTRY.c.template)]
    return sa.and_(*numbers, *(sa.func.typeof(column) == kind for column, kind in kinds))


def parts(values: Iterable[Value]) -> Iterator[list[Value]]:
    """Yield values in lists that are short enough for one query."""
    left = iter(values)
    while part := list(islice(left, VALUES_PER_QUERY)):
        yield part


def create_tables(connection: sa.Connection, state: str) -> None:
    """Make the tables of an empty gallery, within the transaction of `connection`."""
    _metadata.create_all(connection, checkfirst=False)
    connection.execute(GALLERY.insert().values(id=1, version=VERSION, state=state))


class Conflicts:
    """Entries of a gallery that have the content or the label of some requests."""

    def __init__(self, connection: sa.Connection, requests: Sequence[EnrolmentRequest]) -> None:
        self._by_content: dict[bytes, Entry] = {}
        self._by_label: dict[Label, Entry] = {}
        self._damaged: dict[bytes | Label, int] = {}
        for part in parts(requests):
            labels = [(r.label.subject, r.label.finger, r.label.impression) for r in part]
            # SQLite looks up no tuples by its index of labels, but the subjects
            subjects = ENTRY.c.subject.in_({subject for subject, _, _ in labels})
            for condition in (
                ENTRY.c.content.in_([request.content for request in part]),
                sa.and_(subjects, sa.tuple_(*_LABEL).in_(labels)),
            ):
                for row in connection.execute(sa.select(*ABOUT).where(condition)):
                    try:
                        self.add(as_entry(row))
                    except DamagedRowError:
                        label = Label(row.subject, row.finger, row.impression)
                        self._damaged |= {row.content: row.id, label: row.id}

    def add(self, entry: Entry) -> None:
        """Take another entry into account."""
        self._by_content[entry.content] = entry
        self._by_label[entry.label] = entry

    def find(self, request: EnrolmentRequest) -> Conflict | None:
        """Return why a print cannot be enrolled, `ENROLLED`, or None where it can be."""
        known = self._by_content.get(request.content)
        if known is not None:
            if known.label != request.label:
                why = f"the same picture is enrolled as {known.label} already"
                return Conflict(why, known.source)
            if request.dpi is not None and abs(request.dpi - known.dpi) > DPI_TOLERANCE:
                return Conflict(f"enrolled already, at {known.dpi:g} dpi, not {request.dpi:g}")
            return ENROLLED
        for key in (request.content, request.label):
            if key in self._damaged:
                number = self._damaged[key]
                return Conflict(f"entry {number}, which is damaged, has its picture or label")
        other = self._by_label.get(request.label)
        if other is not None:
            return Conflict(f"another picture is enrolled as {request.label} already", other.source)
        return None
