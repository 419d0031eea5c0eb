"""Mutators of galleries: pages of the SQLite file, and rows of entries changed through SQLite."""

from __future__ import annotations

import sqlite3
import struct
from contextlib import closing, contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import random
    from collections.abc import Iterator

_PAGE_SIZE_AT, _PAGES_AT = 16, 28  # in the header of the file
_EXCHANGED = (
    *(("subject",), ("subject", "finger", "impression"), ("impression",), ("source",)),
    *(("template",), ("template", "dpi", "minutiae"), ("content", "source")),
    ("template", "dpi", "minutiae", "content", "source"),
)
_COLUMNS = "subject, finger, impression, source, content, dpi, minutiae, template"


def database_pages(rng: random.Random, data: bytes) -> bytes:
    """Exchange, copy, empty, cut off or damage pages of a SQLite file."""
    (size,) = struct.unpack_from(">H", data, _PAGE_SIZE_AT)
    size = 65536 if size == 1 else size
    changed, count = bytearray(data), len(data) // size
    one, other = (slice(size * k, size * (k + 1)) for k in rng.choices(range(count), k=2))
    way = rng.randrange(6)
    if way == 0:
        changed[one], changed[other] = changed[other], changed[one]
    elif way == 1:
        changed[one] = changed[other]
    elif way == 2:
        at = rng.randrange(one.start, one.stop)
        end = min(one.stop, at + rng.choice((1, 2, 4, 16, 64, 512, size)))
        changed[at:end] = bytes(end - at)
    elif way == 3:
        del changed[one.start :]
        if rng.random() < 0.5 and one.start:
            struct.pack_into(">I", changed, _PAGES_AT, one.start // size)
    else:
        for _ in range(1 if way == 4 else rng.choice((2, 4, 8))):
            changed[rng.randrange(one.start, one.stop)] ^= 1 << rng.randrange(8)
    return bytes(changed)


def gallery_rows(rng: random.Random, data: bytes) -> bytes:
    """Remove, double or exchange rows of entries; half the time no trigger of the file notes it."""
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as database:
        database.deserialize(data)
        numbers = [row[0] for row in database.execute("SELECT id FROM fpmatch_entry")]
        one, other = rng.sample(numbers, 2)
        with _without_triggers(database, rng.random() < 0.5):
            way = rng.randrange(4)
            if way == 0:
                for number in rng.sample(numbers, rng.choice((1, 1, 2))):
                    database.execute("DELETE FROM fpmatch_entry WHERE id = ?", [number])
            elif way == 1:
                database.execute(
                    f"INSERT INTO fpmatch_entry ({_COLUMNS}) SELECT 'x' || subject, finger, "
                    "impression, source, randomblob(32), dpi, minutiae, template "
                    "FROM fpmatch_entry WHERE id = ?",
                    [one],
                )
            else:
                _exchange(database, rng.choice(_EXCHANGED), one, other)
        return database.serialize()


def _exchange(database: sqlite3.Connection, columns: tuple[str, ...], one: int, other: int) -> None:
    """Exchange columns of two rows, whose unique ones differ at each moment."""
    query = f"SELECT {', '.join(columns)} FROM fpmatch_entry WHERE id = ?"
    values = {number: database.execute(query, [number]).fetchone() for number in (one, other)}
    meanwhile = tuple(f"-{value}" for value in values[one])
    for number, given in ((one, meanwhile), (other, values[one]), (one, values[other])):
        settings = ", ".join(f"{column} = ?" for column in columns)
        database.execute(f"UPDATE fpmatch_entry SET {settings} WHERE id = ?", (*given, number))


@contextmanager
def _without_triggers(database: sqlite3.Connection, absent: bool) -> Iterator[None]:
    """Change a database whose triggers are `absent` meanwhile."""
    triggers = [
        row[:2]
        for row in database.execute("SELECT name, sql FROM sqlite_master WHERE type = 'trigger'")
        if absent
    ]
    for name, _ in triggers:
        database.execute(f"DROP TRIGGER {name}")
    yield
    for _, statement in triggers:
        database.execute(statement)


GALLERY = (database_pages, database_pages, gallery_rows, gallery_rows)
