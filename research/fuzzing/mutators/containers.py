"""Mutators of files of arrays and of SQLite databases: what they hold, in a file that is whole."""

from __future__ import annotations

import io
import sqlite3
import struct
import zipfile
from contextlib import closing
from typing import TYPE_CHECKING

from fpmatch.gallery.store.array_file import BLOCK, write_content
from research.fuzzing.mutators.octets import EXTREMES, any_bytes
from research.fuzzing.mutators.text import json_line, json_value

if TYPE_CHECKING:
    import random

DTYPES = ("<f8", ">f8", "<f4", "<f2", "<i8", "<i4", "<u8", "|u1", "|b1", "<c16", "|O", "<U4", "|V8")
SHAPES = (
    *("()", "(0,)", "(1,)", "(2,)", "(0, 2)", "(2, 0)", "(1, 2)", "(2, 2)", "(3, 2)", "(2, 2, 2)"),
    *("(-1, 2)", "(1000000000, 2)", "(2, 9223372036854775807)", "(2.0, 2)", "('a', 2)", "None"),
)
_MAGIC = b"\x93NUMPY"
DOUBLES = (
    *(0.0, -0.0, 1.0, -1.0, 0.5, 5e-324, 1e-50, 1e-38, 1e-7, 3e38, -3e38, 3.5e38, 1e154, 1e200),
    *(1e308, -1e308, float("inf"), float("-inf"), float("nan"), 255.0, 1e6, 2.0**31, 2.0**53),
)
_FLOATS = (0x7F800000, 0xFF800000, 0x7FC00000, 0x7F7FFFFF, 1, 0x4B000000)  # of 32 bits
_VALUES = (
    *(0, 1, -1, 2, 255, 2**31, 2**63 - 1, -(2**63), 0.0, 1e308, -1e308, 5e-324, None, "", "a"),
    *("\x1b[31m", "\n", "x" * 3000, "é", "0", "1.5", b"", b"\0", b"\xff" * 40, "[]", "{", "null"),
)
_INVALID_TEXT = b"\xff\xfe\x1b"


def npy_header(rng: random.Random, data: bytes) -> bytes:
    """Change type, shape, order or version of a ``.npy`` file, with the right length of header."""
    start = 10 if data[6] == 1 else 12
    (length,) = struct.unpack_from("<H" if start == 10 else "<L", data, 8)
    header, body = data[start : start + length].decode("latin-1"), data[start + length :]
    way = rng.randrange(5)
    if way == 0:
        header = f"{{'descr': {rng.choice(DTYPES)!r}, {header.partition(', ')[2]}"
    elif way == 1:
        before, _, _ = header.partition("'shape'")
        header = f"{before}'shape': {rng.choice(SHAPES)}, }}"
    elif way == 2:
        header = header.replace("False", "True")
    elif way == 3:
        header = any_bytes(rng, header.encode("latin-1"), [data[:64]]).decode("latin-1")
    else:
        body = body[: rng.randrange(len(body) + 1)] if rng.random() < 0.5 else body * 2
    if rng.random() < 0.3:
        body = doubles(rng, body)
    content = header.encode("latin-1")
    form = "<H" if data[6] == 1 else "<L"
    return _MAGIC + data[6:8] + struct.pack(form, len(content) & 0xFFFF) + content + body


def doubles(rng: random.Random, data: bytes) -> bytes:
    """Exchange some aligned 8-byte numbers."""
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 8, 40))):
        at = 8 * rng.randrange(max(1, len(data) // 8))
        number = rng.choice(DOUBLES) if rng.random() < 0.8 else rng.gauss(0, 1000)
        changed[at : at + 8] = struct.pack("<d", number)
    if rng.random() < 0.1:  # many that are alike
        at = 16 * rng.randrange(max(1, len(data) // 16))
        changed[at:] = changed[at : at + 16] * (len(changed[at:]) // 16)
    return bytes(changed)


def arrays_header(rng: random.Random, data: bytes) -> bytes:
    """Change the header of a file of arrays; its length and checksums are right."""
    header, content = _arrays_parts(data)
    return _arrays_file(json_value(rng, header), content)


def arrays_content(rng: random.Random, data: bytes) -> bytes:
    """Change numbers in the content of a file of arrays; the checksums are right."""
    header, content = _arrays_parts(data)
    changed = bytearray(content)
    for _ in range(rng.choice((1, 1, 2, 8, 100))):
        size = rng.choice((1, 2, 4, 8))
        at = size * rng.randrange(max(1, len(changed) // size))
        number = rng.choice((*EXTREMES, *_FLOATS, rng.randrange(300))) & ((1 << 8 * size) - 1)
        changed[at : at + size] = number.to_bytes(size, "little")
    if rng.random() < 0.1:
        del changed[64 * rng.randrange(len(changed) // 64) :]
    return _arrays_file(header, bytes(changed))


def zip_member(rng: random.Random, data: bytes) -> bytes:
    """Change, remove or rename an array of an ``.npz`` file; checksums of the archive are right."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name, other = rng.choice(list(members)), rng.choice(list(members))
    way = rng.randrange(6)
    if way <= 2:
        members[name] = npy_header(rng, members[name])
    elif way == 3:
        members[name] = any_bytes(rng, members[name], [members[other]])
    elif way == 4:
        members[name] = members[other]
    else:
        del members[name]
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for one, content in members.items():
            archive.writestr(one, content)
    return stream.getvalue()


def sqlite_cell(rng: random.Random, data: bytes) -> bytes:
    """Exchange one value in a SQLite database, through SQLite itself."""
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as database:
        database.deserialize(data)
        table = rng.choice(_tables(database, filled=True))
        columns = [row[1] for row in database.execute(f'PRAGMA table_info("{table}")')]
        column = rng.choice(columns)
        rows = database.execute(f'SELECT "{column}" FROM "{table}" LIMIT 30').fetchall()
        old = rng.choice(rows)[0]
        new = _other_value(rng, old)
        where = f'"{column}" IS ?'
        if rng.random() < 0.3:  # all rows
            where += " OR 1"
        database.execute("PRAGMA ignore_check_constraints = ON")
        database.execute(f'UPDATE OR IGNORE "{table}" SET "{column}" = {new[0]} WHERE {where}',
                         (*new[1], old))  # fmt: skip
        return database.serialize()


def sqlite_rows(rng: random.Random, data: bytes) -> bytes:
    """Remove or double rows of a SQLite database, or remove a table or what it is about."""
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as database:
        database.deserialize(data)
        table = rng.choice(_tables(database))
        number = rng.choice((0, -5, 2**62, 2**63 - 1))
        row = f'(SELECT rowid FROM "{table}" LIMIT 1 OFFSET {rng.randrange(5)})'
        statement = rng.choice((
            f'DELETE FROM "{table}" WHERE rowid = {row}',
            f'DELETE FROM "{table}"',
            f'UPDATE "{table}" SET rowid = {number} WHERE rowid = {row}',
            f'ALTER TABLE "{table}" RENAME TO other',
            f'ALTER TABLE "{table}" ADD COLUMN more TEXT',
            f'DROP TABLE "{table}"',
            f"PRAGMA user_version = {rng.choice((1, 99, -1))}",
            f"PRAGMA application_id = {rng.choice((1, 99))}",
        ))  # fmt: skip
        database.execute(statement)
        return database.serialize()


def sqlite_schema(rng: random.Random, data: bytes) -> bytes:
    """Change the text of the schema of a SQLite database, or where its tables begin."""
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as database:
        database.deserialize(data)
        database.execute("PRAGMA writable_schema = ON")
        names = [row[0] for row in database.execute("SELECT name FROM sqlite_master")]
        name = rng.choice(names)
        (text,) = database.execute(
            "SELECT sql FROM sqlite_master WHERE name = ?", [name]
        ).fetchone()
        way = rng.randrange(4)
        if way == 0:
            page = rng.choice((0, 1, 2, 3, 999, -1))
            change: tuple[str, object] = ("rootpage = ?", page)
        elif way == 1 and text:
            word = rng.choice(
                ("INTEGER", "TEXT", "BLOB", "NOT NULL", "UNIQUE", "PRIMARY KEY", "id")
            )
            other = rng.choice(("REAL", "", "TEXT", "GENERATED ALWAYS AS (1)", "CHECK (0)"))
            change = ("sql = ?", text.replace(word, other, 1))
        elif way == 2:
            junk = any_bytes(rng, (text or "x").encode(), [b"CREATE VIEW a AS SELECT 1"])
            change = ("sql = ?", junk.decode("utf-8", "replace"))
        else:
            change = (rng.choice(("name = ?", "tbl_name = ?", "type = ?")), "other")
        database.execute(f"UPDATE sqlite_master SET {change[0]} WHERE name = ?", [change[1], name])
        return database.serialize()


ARRAYS = (arrays_header, arrays_content, arrays_content)
SQLITE = (sqlite_cell, sqlite_cell, sqlite_cell, sqlite_rows, sqlite_schema)


def _arrays_parts(data: bytes) -> tuple[bytes, bytes]:
    """Return header and content of a file of arrays, without checksums."""
    start = 24
    (length,) = struct.unpack_from("<Q", data, start - 8)
    left = len(data) - start - length
    blocks = -(-(left - 4) // (BLOCK + 4))
    content = data[start + length : len(data) - 4 * (blocks + 1)]
    return data[start : start + length].rstrip(b" "), content


def _arrays_file(header: bytes, content: bytes) -> bytes:
    stream = io.BytesIO()
    write_content(stream, header, [memoryview(content)])
    return stream.getvalue()


def _tables(database: sqlite3.Connection, *, filled: bool = False) -> list[str]:
    """Return the names of the tables, or of those that have rows."""
    query = "SELECT name FROM sqlite_master WHERE type = 'table'"
    names = [row[0] for row in database.execute(query)]
    if not filled:
        return names
    return [one for one in names if database.execute(f'SELECT 1 FROM "{one}"').fetchone()]


def _other_value(rng: random.Random, old: object) -> tuple[str, tuple[object, ...]]:
    """Return an expression of SQL for a new value, with its parameters."""
    way = rng.randrange(6)
    if way == 0:
        return "CAST(? AS TEXT)", (_INVALID_TEXT,)
    if isinstance(old, bytes) and way < 5:
        return "?", (any_bytes(rng, old, [old]),)
    if isinstance(old, str) and old[:1] in {"{", "["} and way < 5:
        change = json_value if rng.random() < 0.8 else json_line
        return "?", (change(rng, old.encode()).decode("utf-8", "replace"),)
    if isinstance(old, int) and way < 3:
        return "?", (rng.choice((old + 1, -old, *EXTREMES)),)
    return "?", (rng.choice(_VALUES),)
