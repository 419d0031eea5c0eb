"""Records of ANSI/NIST-ITL files and the fields of text records.

The first record lists the others, by type and number (IDC). Those of types 3 to 8 are binary and
begin with their length in four bytes; the others are fields ``9.012:value`` separated by GS, of
subfields separated by RS, of items separated by US, and end with FS.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from fpmatch.errors import TemplateError

FS: Final = b"\x1c"
GS: Final = b"\x1d"
RS: Final = b"\x1e"
US: Final = b"\x1f"
BINARY_TYPES: Final = frozenset(range(3, 9))
MOST_RECORDS: Final = 2000
START: Final = re.compile(rb"1\.0?01:(\d{1,9})\x1d")
_CONTENTS: Final = re.compile(rb"[\x1d]1\.0?03:([^\x1c\x1d]*)")
_RECORD_START: Final = re.compile(rb"(\d{1,2})\.0?01:(\d{1,9})\x1d")
_TAG: Final = re.compile(rb"(\d{1,2})\.(\d{2,4}):")
_DATA_FIELD: Final = 999  # the image in a text record


@dataclass(frozen=True, slots=True)
class Record:
    """One record: type (1 to 99), number (equal in records of one print) and bytes."""

    type: int
    idc: int
    data: bytes

    def fields(self) -> dict[int, bytes]:
        """Return the fields of a text record by number, without the image."""
        found: dict[int, bytes] = {}
        for part in self.data.rstrip(FS).split(GS):
            tag = _TAG.match(part)
            if tag is None:
                continue
            number = int(tag[2])
            if number >= _DATA_FIELD:
                break
            found.setdefault(number, part[tag.end() :])
        return found


def table(value: bytes) -> list[list[bytes]]:
    """Return the items of the subfields of a field.

    Examples
    --------
    >>> table(bytes([49, 31, 50, 30, 51]))
    [[b'1', b'2'], [b'3']]
    """
    return [subfield.split(US) for subfield in value.split(RS)]


def first_item(value: bytes) -> bytes:
    """Return the first item of the first subfield of a field."""
    return value.split(RS, 1)[0].split(US, 1)[0]


def contents(data: bytes) -> list[tuple[int, int]]:
    """Return type and number of each record after the first; raises TemplateError if unlisted."""
    found = _CONTENTS.search(data[: data.find(FS) + 1] or data)
    if found is None:
        raise TemplateError("the first record does not list the others (field 1.003)")
    if found[1].count(RS) > MOST_RECORDS:
        raise TemplateError(f"more than {MOST_RECORDS} records")
    listed = []
    for items in table(found[1])[1:]:
        if len(items) < 2 or not all(item.isdigit() and len(item) < 4 for item in items[:2]):
            raise TemplateError("the list of records (field 1.003) is malformed")
        listed.append((int(items[0]), int(items[1])))
    return listed


def records(data: bytes) -> list[Record]:
    """Return all records of a file; raises TemplateError if one begins or ends elsewhere."""
    start = START.match(data)
    if start is None:
        raise TemplateError("does not begin with a record of type 1")
    found = [Record(1, 0, _cut(data, 0, int(start[1])))]
    at = int(start[1])
    for kind, idc in contents(data):
        length = _length(data, at, kind)
        found.append(Record(kind, idc, _cut(data, at, length)))
        at += length
    return found


def _length(data: bytes, at: int, kind: int) -> int:
    """Return the declared length of the record of type `kind` at byte `at`."""
    if kind in BINARY_TYPES:
        length = int.from_bytes(data[at : at + 4], "big")
    else:
        start = _RECORD_START.match(data, at)
        if start is None or int(start[1]) != kind:
            raise TemplateError(f"no record of type {kind} at byte {at}, where one is listed")
        length = int(start[2])
    if length < 1:
        raise TemplateError(f"the record of type {kind} at byte {at} declares no length")
    return length


def _cut(data: bytes, at: int, length: int) -> bytes:
    if at + length > len(data):
        raise TemplateError(
            f"cut short: a record needs {at + length} bytes, and the file has {len(data)}"
        )
    return data[at : at + length]
