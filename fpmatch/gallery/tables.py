"""The tables of a gallery."""

from __future__ import annotations

from typing import Final

import sqlalchemy as sa

VERSION: Final = 1
"""Of these tables and of what stands in them; a change of either is another version."""

_metadata = sa.MetaData()

GALLERY: Final = sa.Table(
    "fpmatch_gallery",
    _metadata,
    sa.Column("id", sa.Integer, sa.CheckConstraint("id = 1"), primary_key=True),
    sa.Column("version", sa.Integer, nullable=False),
    # another random word after every change: what is derived from the contents can tell
    sa.Column("state", sa.Text, nullable=False),
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
"""The columns that an `Entry` holds."""

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
