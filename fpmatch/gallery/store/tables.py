"""Tables of a gallery's database, and conflicts of new prints with their entries."""

from __future__ import annotations

from dataclasses import astuple, dataclass
from itertools import islice
from typing import TYPE_CHECKING, Final, NamedTuple, TypeVar

import sqlalchemy as sa

from fpmatch.gallery.listing.entry import EnrolmentRequest, Failure, PackedEntry

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

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


class DamagedRowError(ValueError):
    """The row of an entry has impossible content; for one entry it becomes a GalleryError."""

    def __init__(self, number: object, why: str) -> None:
        self.number, self.why = number, why
        super().__init__(f"entry {number}: {why}")


@dataclass(frozen=True, slots=True)
class Conflict:
    """Why a print cannot be enrolled, and the file of the entry that it conflicts with, if any."""

    why: str
    source: str = ""

    def __str__(self) -> str:
        return f"{self.why} ({self.source})" if self.source else self.why


ENROLLED: Final = Conflict("")
"""What `Conflicts.find` returns for a print that is enrolled already."""


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
    """Entries of a gallery that have the picture or the label of some requests."""

    def __init__(self, connection: sa.Connection, requests: Sequence[EnrolmentRequest]) -> None:
        self._by_content: dict[bytes, _Known] = {}
        self._by_label: dict[tuple[str, ...], _Known] = {}
        columns = (ENTRY.c.subject, ENTRY.c.finger, ENTRY.c.impression)
        for part in parts(requests):
            # SQLite looks up no tuples by its index of labels, but the subjects
            subjects = columns[0].in_({request.label.subject for request in part})
            labels = sa.tuple_(*columns).in_([astuple(request.label) for request in part])
            for condition in (
                ENTRY.c.content.in_([request.content for request in part]),
                sa.and_(subjects, labels),
            ):
                for row in connection.execute(sa.select(*ABOUT).where(condition)):
                    label = (row.subject, row.finger, row.impression)
                    dpi = row.dpi if isinstance(row.dpi, float) else None
                    self._add(row.content, _Known(label, str(row.source), dpi))

    def add(self, request: EnrolmentRequest, source: str) -> None:
        """Take a print into account that is enrolled now, from the file `source`."""
        self._add(request.content, _Known(astuple(request.label), source, request.dpi))

    def _add(self, content: bytes, known: _Known) -> None:
        self._by_content[content] = self._by_label[known.label] = known

    def find(self, request: EnrolmentRequest) -> Conflict | None:
        """Return why a print cannot be enrolled, `ENROLLED`, or None where it can be."""
        known = self._by_content.get(request.content)
        if known is not None:
            if known.label != astuple(request.label):
                label = "_".join(str(name) for name in known.label if name)
                return Conflict(f"the same picture is enrolled as {label} already", known.source)
            dpi = known.dpi
            if request.dpi is None or dpi is None or abs(request.dpi - dpi) <= DPI_TOLERANCE:
                return ENROLLED
            return Conflict(f"enrolled already, at {dpi:g} dpi, not {request.dpi:g}")
        other = self._by_label.get(astuple(request.label))
        if other is not None:
            return Conflict(f"another picture is enrolled as {request.label} already", other.source)
        return None


def conflicts_in_order(
    connection: sa.Connection, new: Sequence[PackedEntry | Failure]
) -> tuple[list[Conflict | None], list[PackedEntry]]:
    """Return the conflict of each print with what is enrolled and with those before it.

    The second list has the prints without a conflict.
    """
    packed = (entry for entry in new if isinstance(entry, PackedEntry))
    known = Conflicts(connection, [*map(_request, packed)])
    conflicts: list[Conflict | None] = []
    enrolled = []
    for entry in new:
        if isinstance(entry, Failure):
            conflicts.append(Conflict(entry.reason))
            continue
        request = _request(entry)
        conflicts.append(known.find(request))
        if conflicts[-1] is None:
            known.add(request, entry.source)
            enrolled.append(entry)
    return conflicts, enrolled


def _request(entry: PackedEntry) -> EnrolmentRequest:
    return EnrolmentRequest(entry.label, entry.content, entry.dpi)


class _Known(NamedTuple):
    """The label, the file and the resolution of an entry; no resolution where it is damaged."""

    label: tuple[str, ...]
    source: str
    dpi: float | None
