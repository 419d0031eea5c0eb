"""Mutators of JSON, TOML and tables of text."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import random

NUMBERS = (
    *("0", "-0.0", "1", "-1", "0.5", "1e-50", "5e-324", "-5e-324", "1e-38", "3e38", "3.5e38"),
    *("1e308", "-1e308", "1e999", "-1e999", "2147483647", "-2147483648", "4294967296", "65536"),
    *("9223372036854775808", "18446744073709551616", "1" + "0" * 400, "9" * 5000, "1.0", "100.5"),
)
OTHERS = (
    *("NaN", "Infinity", "-Infinity", "null", "true", "false", "[]", "{}", '""', "[[]]"),
    *('"a"', '"0"', '"\\ud800"', '"\\u0000"', '"\\u001b[31m"', '"\\n"', '"%s%n"', '"../../x"'),
    *('"\\u202e"', f'"{"x" * 5000}"', "[" * 200 + "]" * 200, "[" * 20000, '{"a":' * 2000),
)
_PLACE = "\x00place\x00"  # of a value that json itself would not write
CELLS = (
    *NUMBERS,
    *("nan", "inf", "-inf", "NaN", "1_000", "0x10", "1,5", "٣", "½", "1e5", " 1", "1 "),
    *("", " ", "a", '"', '""', '"a', "'", "\x1b[31m", "\0", "\ud800", "\ufeff", "\u202e", "é"),
    *("#", ";", ",", "\t", "\r", "x" * 5000, "../../etc/passwd", "/dev/null", "=1+1", "\u2028"),
)
TABLES = ("", "a", "a.b", "[a]", '"\\n"', '"\\u001b"')  # of TOML
DELIMITERS = (",", ";", "\t", " ")
_NEWLINES = ("\n", "\r\n", "\r", "\n\n", "\x0b", "\u2028")


def json_value(rng: random.Random, data: bytes) -> bytes:
    """Exchange, remove, double or nest one value anywhere in a JSON document."""
    document = json.loads(data)
    spots: list[tuple[Any, Any]] = [(None, None)]
    _collect(document, spots)
    holder, key = rng.choice(spots[1:] or spots) if rng.random() < 0.98 else spots[0]
    raw = rng.choice(NUMBERS if rng.random() < 0.6 else OTHERS)
    if holder is None:
        return raw.encode()
    value, way = holder[key], rng.randrange(10)
    if way < 6:
        holder[key] = _PLACE
    elif way == 6:
        del holder[key]
    elif way == 7 and isinstance(value, list):
        holder[key] = rng.choice((value[:-1], value * 2, value[::-1], [*value, _PLACE], value[:1]))
    elif way == 8:
        other, its_key = rng.choice(spots[1:])
        holder[key], other[its_key] = other[its_key], value
    elif isinstance(holder, dict):
        holder[rng.choice((f"{key} ", key.upper(), "", "\x1b[31m", "__proto__"))] = value
    text = json.dumps(document, indent=rng.choice((None, 1)))
    if rng.random() < 0.1:  # a key that is there twice
        text = re.sub(r'("[^"]+": ?)', lambda m: f"{m[1]}{raw}, {m[1]}", text, count=1)
    return text.replace(json.dumps(_PLACE), raw).encode()


def json_number(rng: random.Random, data: bytes) -> bytes:
    """Exchange one number in a JSON or TOML text, without parsing the rest."""
    text = data.decode()
    found = list(re.finditer(r"-?\b\d+(?:\.\d*)?(?:[eE][+-]?\d+)?\b", text))
    number = rng.choice(found)
    return f"{text[: number.start()]}{rng.choice(NUMBERS)}{text[number.end() :]}".encode()


def json_line(rng: random.Random, data: bytes) -> bytes:
    """Change one line of a file of JSON lines, or its place."""
    lines = data.splitlines(keepends=True)
    at = rng.randrange(len(lines))
    way = rng.randrange(5)
    if way == 0:
        del lines[at]
    elif way == 1:
        lines.insert(at, lines[rng.randrange(len(lines))])
    elif way == 2:
        other = rng.randrange(len(lines))
        lines[at], lines[other] = lines[other], lines[at]
    else:
        lines[at] = json_value(rng, lines[at]) + b"\n"
    return b"".join(lines)


def toml_line(rng: random.Random, data: bytes) -> bytes:
    """Exchange the value, key or table of a line of TOML, or put it twice."""
    lines = data.decode().splitlines()
    at = rng.randrange(len(lines))
    key, equals, value = lines[at].partition("=")
    new = rng.choice((*NUMBERS, *OTHERS, "nan", "inf", "1979-05-27", "'a'", '"""\n\n"""', value))
    way = rng.randrange(6)
    if way < 3:
        lines[at] = f"{key}={new}" if equals else f"[{rng.choice(TABLES)}]"
    elif way == 3:
        lines.insert(at, f"{rng.choice((*TABLES, key.strip()))} = {new}")
    elif way == 4:
        del lines[at]
    else:
        lines.append(lines[at])
    return "\n".join(lines).encode("utf-8", "surrogatepass")


def table_cell(rng: random.Random, data: bytes) -> bytes:
    """Exchange one cell of a table of text."""
    lines, delimiter = _table(data)
    row = rng.randrange(len(lines))
    cells = lines[row].split(delimiter)
    cells[rng.randrange(len(cells))] = rng.choice(CELLS)
    lines[row] = delimiter.join(cells)
    return _joined(lines)


def table_shape(rng: random.Random, data: bytes) -> bytes:
    """Remove, double or exchange a column or a row, or change what separates them."""
    lines, delimiter = _table(data)
    rows = [line.split(delimiter) for line in lines]
    row, column = rng.randrange(len(rows)), rng.randrange(max(map(len, rows)))
    other = rng.randrange(max(map(len, rows)))
    way = rng.randrange(8)
    if way == 0:
        rows = [cells[:column] + cells[column + 1 :] for cells in rows]
    elif way == 1:
        rows = [cells[:column] + cells[other : other + 1] + cells[column:] for cells in rows]
    elif way == 2:
        del rows[row]
    elif way == 3:
        rows.insert(rng.randrange(len(rows) + 1), rows[row])
    elif way == 4:
        rows[row] = rows[row] * rng.choice((2, 3, 100)) if rng.random() < 0.7 else []
    elif way == 5:
        delimiter = rng.choice(DELIMITERS)
    elif way == 6:
        rows = [[f'"{cell}"' for cell in cells] for cells in rows]
    text = _joined([delimiter.join(cells) for cells in rows])
    if way == 7:
        text = rng.choice((b"\xef\xbb\xbf", b"# ", b"\n", b"\xff\xfe")) + text
        text = text.replace(b"\n", rng.choice(_NEWLINES).encode())
    return text


TABLE = (table_cell, table_cell, table_shape)
JSON = (json_value, json_value, json_number)
TOML = (toml_line, toml_line, json_number)


def _collect(value: Any, spots: list[tuple[Any, Any]]) -> None:
    """Add the place of each value within a JSON value."""
    keys = (
        value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    )
    for key in keys:
        spots.append((value, key))
        _collect(value[key], spots)


def _table(data: bytes) -> tuple[list[str], str]:
    """Return the lines of a table, and what separates most of its cells."""
    text = data.decode()
    lines = text.splitlines()
    return lines, max(DELIMITERS, key=text.count)


def _joined(lines: list[str]) -> bytes:
    return ("\n".join(lines) + "\n").encode("utf-8", "surrogatepass")
