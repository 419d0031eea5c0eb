"""Tables of a gallery's database."""

from __future__ import annotations

from typing import Any, Final

import sqlalchemy as sa

from fpmatch.gallery.database import DamagedRowError
from fpmatch.gallery.entry import Entry, Label

VERSION: Final = 1
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
    sa.Column("template", sa.LargeBinary, nullable=False),
    sa.UniqueConstraint("subject", "finger", "impression"),
    sqlite_autoincrement=True,  # the number of a removed entry is not given again
)

ABOUT: Final = [column for column in ENTRY.columns if column is not ENTRY.c.template]
"""The columns of an `Entry`."""

FAILURE: Final = sa.Table(
    "fpmatch_failure",
    _metadata,
    sa.Column("source", sa.Text, primary_key=True),
    sa.Column("reason", sa.Text, nullable=False),
)


def create_tables(connection: sa.Connection, state: str) -> None:
    """Make the tables of an empty gallery, within the transaction of `connection`."""
    _metadata.create_all(connection, checkfirst=False)
    connection.execute(GALLERY.insert().values(id=1, version=VERSION, state=state))


def as_entry(row: Any) -> Entry:
    """Return a row of the columns `ABOUT` as an entry.

    Raises
    ------
    DamagedRowError
        If a column is of another type.
    """
    names, numbers = (row.subject, row.finger, row.impression, row.source), (row.id, row.minutiae)
    if (
        not all(isinstance(name, str) for name in names)
        or not all(isinstance(number, int) for number in numbers)
        or not isinstance(row.content, bytes)
        or not isinstance(row.dpi, float)
    ):
        raise DamagedRowError(f"entry {row.id} has a column of another type")
    return Entry(row.id, Label(*names[:3]), row.source, row.content, row.dpi, row.minutiae)


def as_packed(row: Any) -> tuple[int, bytes]:
    """Return number and packed template of a row, or raise DamagedRowError."""
    if not (isinstance(row.id, int) and isinstance(row.template, bytes)):
        raise DamagedRowError(f"entry {row.id} has no template")
    return row.id, row.template
