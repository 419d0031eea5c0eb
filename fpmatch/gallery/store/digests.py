"""Digests of the entries of a gallery, and their sums, which show damage and exchanged rows.

Each row has a digest of its columns but the number: one that was changed differs from it. The
gallery has the sum of digests and numbers for each 4,096 numbers: where rows were removed, added or
exchanged by anything but fpmatch, a sum differs. Sums are changed in the transaction of the entries
and in the row that every writer locks. Neither is a signature: who may write the database can
correct both. Galleries of versions 1 and 2 have none; they get them with their next change.
"""

from __future__ import annotations

import hashlib
import struct
from contextlib import suppress
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa
from sqlalchemy.exc import DBAPIError

from fpmatch.gallery.store.database import DamagedRowError
from fpmatch.gallery.store.tables import ABOUT, ENTRY, GALLERY, OLD_VERSIONS, PACKED

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping, Sequence

_DIGEST_BYTES: Final = 6  # the sum of a block is an integer of 64 bits, as databases add
_END: Final = 16  # bytes of a template
_BLOCK_BITS: Final = 12
_SUM: Final = struct.Struct("<qq")  # a block, and its sum
_MOST: Final = (1 << 63) - 1
_MOST_WAIT_MS: Final = 500  # less than PostgreSQL waits before it looks for deadlocks
_ROWS_PER_STEP: Final = 1000
_FEW_BLOCKS: Final = 64  # whose sums are checked alone
_BLOCK: Final[sa.Label[int]] = sa.literal_column(f"fpmatch_entry.id >> {_BLOCK_BITS}").label(
    "block"
)
_DIGEST: Final[sa.ColumnElement[int]] = sa.literal_column(
    f"(fpmatch_entry.digest + fpmatch_entry.id) & {(1 << 8 * _DIGEST_BYTES) - 1}"
)
_TOTALS: Final = (
    sa.select(_BLOCK, sa.func.sum(_DIGEST).label("total")).select_from(ENTRY).group_by("block")
)
_BOUND: Final = itemgetter(*(column.name for column in (*ABOUT[1:], ENTRY.c.template)))
_HEAD: Final = struct.Struct("<6Qdq")  # lengths, dpi and number of minutiae
_COLUMNS: Final = (ENTRY.c.digest, GALLERY.c.sums)  # that versions 1 and 2 lack

Sums = dict[int, int]


def row_digest(row: Mapping[str, Any]) -> int:
    """Return the digest of the columns of an entry, as they are stored; -1 for impossible ones.

    Of the template it has the length and the end, which is a checksum of the rest, or authenticates
    it.
    """
    *names, content, dpi, minutiae, template = _BOUND(row)
    try:
        head = _HEAD.pack(*map(len, names), len(content), len(template), dpi, minutiae)
        text = "".join(names).encode("utf-8", "surrogatepass")
        whole = b"".join((head, text, content, template[-_END:]))
    except (TypeError, struct.error):
        return -1
    return int.from_bytes(hashlib.sha256(whole).digest()[:_DIGEST_BYTES], "little")


def check_row(row: Any) -> None:
    """Raise DamagedRowError if a row of all columns has another digest than its own."""
    if row.digest != row_digest(row._mapping):
        raise DamagedRowError(row.id, "its label, picture or template is not what was enrolled")


def has_digests(connection: sa.Connection) -> bool:
    """Return whether the entries of a gallery have digests."""
    return connection.scalar(sa.select(GALLERY.c.version)) not in OLD_VERSIONS


def sums_of(connection: sa.Connection, where: sa.ColumnElement[bool]) -> Sums:
    """Return the sums of the digests of some entries, by block."""
    rows = connection.execute(_TOTALS.where(where))
    return {row.block: int(row.total or 0) for row in rows}


def changed_sums(
    connection: sa.Connection, *, added: Mapping[int, int] = {}, removed: Mapping[int, int] = {}
) -> bytes:
    """Return the sums of a gallery as they are stored, after a change of some."""
    sums = dict(_parsed(connection.scalar(sa.select(GALLERY.c.sums))))
    for block in {*added, *removed}:
        total = sums.get(block, 0) + added.get(block, 0) - removed.get(block, 0)
        sums[block] = total & _MOST
    return _stored(sums)


def are_right(connection: sa.Connection, *, after: int = 0, of: Iterable[int] = ()) -> bool:
    """Return whether the sums fit the entries, the entries from about a number on, or near some."""
    first = max(after, 0) >> _BLOCK_BITS
    query, blocks = _TOTALS, {number >> _BLOCK_BITS for number in of}
    if 0 < len(blocks) <= _FEW_BLOCKS:
        ranges = (ENTRY.c.id.between(b << _BLOCK_BITS, (b + 1 << _BLOCK_BITS) - 1) for b in blocks)
        query = query.where(sa.or_(*ranges))
    else:
        blocks.clear()
    if first:
        query = query.where(ENTRY.c.id >= first << _BLOCK_BITS)
    totals = query.subquery()
    both = sa.select(GALLERY.c.sums, totals.c.block, totals.c.total)  # of one moment
    rows = connection.execute(both.select_from(GALLERY.outerjoin(totals, sa.true()))).all()
    expected = {
        block: total
        for block, total in (_parsed(rows[0].sums) if rows else ())
        if total and block >= first and (not blocks or block in blocks)
    }
    return expected == {row.block: row.total for row in rows if row.block is not None}


def keep_digests(connection: sa.Connection) -> bool:
    """Let the entries of a gallery have digests from now on; return whether they have.

    They have none where this user may not add columns, or others use the tables of a server. No
    other transaction may write meanwhile.
    """
    if has_digests(connection):
        return True
    with suppress(DBAPIError), connection.begin_nested():
        if connection.dialect.name == "postgresql":  # where another writer may wait for this one
            connection.exec_driver_sql(f"SET LOCAL lock_timeout = {_MOST_WAIT_MS}")
        for column in _COLUMNS:
            kind = column.type.compile(connection.dialect)
            connection.exec_driver_sql(
                f"ALTER TABLE {column.table.name} ADD COLUMN {column.name} {kind}"
            )
        _add_digests(connection)
        sums = _stored(sums_of(connection, sa.true()))
        versions = sa.case(OLD_VERSIONS, value=GALLERY.c.version)
        connection.execute(GALLERY.update().values(sums=sums, version=versions))
        return True
    return False


def is_torn(connection: sa.Connection) -> bool:
    """Return whether a gallery of a version without digests has their columns."""
    columns = sa.inspect(connection).get_columns(GALLERY.name)
    return any(column["name"] == GALLERY.c.sums.name for column in columns)


def replace_templates(connection: sa.Connection, rows: Sequence[tuple[Any, bytes]]) -> None:
    """Store other templates in rows; a digest that was wrong stays wrong."""
    where = ENTRY.c.id.in_([row.id for row, _ in rows])
    update = ENTRY.update().where(ENTRY.c.id == sa.bindparam("number"))
    new = update.values(template=sa.bindparam("own"))
    connection.execute(new, [{"number": row.id, "own": template} for row, template in rows])
    if has_digests(connection):
        removed = sums_of(connection, where)
        new = update.values(digest=sa.bindparam("own"))
        own = [
            {"number": row.id, "own": row_digest(row._asdict() | {"template": template})}
            for row, template in rows
            if row.digest == row_digest(row._mapping)
        ]
        if own:
            connection.execute(new, own)
        sums = changed_sums(connection, removed=removed, added=sums_of(connection, where))
        connection.execute(GALLERY.update().values(sums=sums))


def _add_digests(connection: sa.Connection) -> None:
    last: Any = None
    update = ENTRY.update().where(ENTRY.c.id == sa.bindparam("number"))
    while True:
        query = PACKED if last is None else PACKED.where(ENTRY.c.id > last)
        rows = connection.execute(query.order_by(ENTRY.c.id).limit(_ROWS_PER_STEP)).all()
        if not rows:
            return
        digests = [{"number": row.id, "own": row_digest(row._asdict())} for row in rows]
        connection.execute(update.values(digest=sa.bindparam("own")), digests)
        last = rows[-1].id


def _parsed(stored: object) -> Collection[tuple[int, int]]:
    """Return the stored sums; one of no entry where they are damaged."""
    if not isinstance(stored, bytes) or len(stored) % _SUM.size:
        return [(-1, -1)]
    return [*_SUM.iter_unpack(stored)]


def _stored(sums: Sums) -> bytes:
    return b"".join(_SUM.pack(block, total) for block, total in sorted(sums.items()) if total)
