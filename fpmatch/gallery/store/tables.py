"""Tables of a gallery's database, and conflicts of new prints with their entries."""

from __future__ import annotations

from dataclasses import astuple, dataclass
from itertools import islice
from typing import TYPE_CHECKING, Final, NamedTuple, TypeVar

import sqlalchemy as sa

from fpmatch.gallery.listing.entry import Label, NewEntry

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from fpmatch.gallery.listing.entry import EnrolmentRequest

Value = TypeVar("Value")

VERSION: Final = 3
"""Version of these tables and of their content; it grows with every change of either."""
ENCRYPTED_VERSION: Final = VERSION + 1
"""Version of an encrypted gallery."""

METADATA: Final = sa.MetaData()

GALLERY: Final = sa.Table(
    "fpmatch_gallery",
    METADATA,
    sa.Column("id", sa.Integer, sa.CheckConstraint("id = 1"), primary_key=True),
    sa.Column("version", sa.Integer, nullable=False),
    sa.Column("state", sa.Text, nullable=False),  # random, replaced by every change of entries
)

ENTRY: Final = sa.Table(
    "fpmatch_entry",
    METADATA,
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
    METADATA,
    sa.Column("source", sa.Text, primary_key=True),
    sa.Column("reason", sa.Text, nullable=False),
)

TABLES: Final = [GALLERY, ENTRY, FAILURE]
"""The tables that every gallery has; the others are made when they are needed."""

ENCRYPTION: Final = sa.Table(
    "fpmatch_encryption",
    METADATA,
    sa.Column("id", sa.Integer, sa.CheckConstraint("id = 1"), primary_key=True),
    sa.Column("gallery", sa.LargeBinary, nullable=False),  # its random id
    sa.Column("keys", sa.Text, nullable=False),  # the id of the key in use
)

AUDIT: Final = sa.Table(
    "fpmatch_audit",
    METADATA,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("line", sa.Text, nullable=False),
)

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
"""The conflict of a print that is enrolled already."""


class _Known(NamedTuple):
    """The label, the file and the resolution of an entry; no resolution where it is damaged."""

    label: Label
    source: str
    dpi: float | None


def parts(values: Iterable[Value]) -> Iterator[list[Value]]:
    """Yield values in lists that are short enough for one query."""
    left = iter(values)
    while part := list(islice(left, VALUES_PER_QUERY)):
        yield part


def find_conflicts(
    connection: sa.Connection, requests: Sequence[EnrolmentRequest | NewEntry]
) -> list[Conflict | None]:
    """Return for each print None if it can be enrolled, `ENROLLED`, or why it cannot.

    New entries are enrolled in this order: each may conflict with one before it.
    """
    by_content: dict[bytes, _Known] = {}
    by_label: dict[Label, _Known] = {}
    names = (ENTRY.c.subject, ENTRY.c.finger, ENTRY.c.impression)
    for part in parts(requests):
        # SQLite looks up no tuples by its index of labels, but the subjects
        subjects = ENTRY.c.subject.in_({request.label.subject for request in part})
        labels = sa.tuple_(*names).in_([astuple(request.label) for request in part])
        contents = ENTRY.c.content.in_([request.content for request in part])
        for condition in (contents, sa.and_(subjects, labels)):
            for row in connection.execute(sa.select(*ABOUT).where(condition)):
                label = Label(row.subject, row.finger, row.impression)
                dpi = row.dpi if isinstance(row.dpi, float) else None
                by_content[row.content] = by_label[label] = _Known(label, str(row.source), dpi)
    conflicts = []
    for request in requests:
        same, other = by_content.get(request.content), by_label.get(request.label)
        conflict = _conflict(request, same, other)
        if conflict is None and isinstance(request, NewEntry):
            known = _Known(request.label, request.source, request.dpi)
            by_content[request.content] = by_label[request.label] = known
        conflicts.append(conflict)
    return conflicts


def _conflict(
    request: EnrolmentRequest | NewEntry, same: _Known | None, other: _Known | None
) -> Conflict | None:
    """Return the conflict with the entry of the same picture, and with that of the same label."""
    if same is None:
        why = f"another picture is enrolled as {request.label} already"
        return None if other is None else Conflict(why, other.source)
    if same.label != request.label:
        return Conflict(f"the same picture is enrolled as {same.label} already", same.source)
    if request.dpi is None or same.dpi is None or abs(request.dpi - same.dpi) <= DPI_TOLERANCE:
        return ENROLLED
    return Conflict(f"enrolled already, at {same.dpi:g} dpi, not {request.dpi:g}")
