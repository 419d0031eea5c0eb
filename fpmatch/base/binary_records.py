"""Records of binary files: big-endian numbers, and the structure of ANSI/NIST-ITL files.

The first record of such a file (AN2, EFT, EBTS; traditional encoding) lists the others, by type and
number (IDC). Those of types 3 to 8 are binary and begin with their length in four bytes; the others
are fields ``9.012:value`` separated by GS, of subfields separated by RS, of items separated by US,
and end with FS.
"""

from __future__ import annotations

import re
import struct
from typing import TYPE_CHECKING, Any, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable

    from fpmatch.errors import FpmatchError

FS, GS, RS, US = b"\x1c", b"\x1d", b"\x1e", b"\x1f"
IMAGE_FIELD: Final = 999  # the last field of a text record; its image may contain separators
_WITHOUT_IMAGE: Final = frozenset({1, 2, 9})  # text records without an image, whatever the field
BINARY_TYPES: Final = frozenset(range(3, 9))
MAX_RECORDS: Final = 2000
MAX_FIELDS: Final = 10_000  # of one record
START: Final = re.compile(rb"1\.0?01:(\d{1,9})\x1d")
_RECORD_START: Final = re.compile(rb"(\d{1,2})\.0?01:(\d{1,9})\x1d")
_IMAGE_AGAIN: Final = re.compile(rb"\d{1,2}\.999:")
_TAG: Final = re.compile(rb"(\d{1,2})\.(\d{2,4}):")


class ByteReader:
    """Read big-endian numbers from `data`, from byte `at` on.

    Where the bytes end too soon, it raises what `error` makes of the reason.
    """

    def __init__(self, data: bytes, error: Callable[[str], Exception], at: int = 0) -> None:
        self.data, self.at, self._error = data, at, error

    @property
    def left(self) -> int:
        """Number of bytes left."""
        return max(0, len(self.data) - self.at)

    def take(self, count: int) -> bytes:
        """Return the next `count` bytes."""
        if not 0 <= count <= self.left:
            needed = f"ends after {len(self.data)} bytes, and needs {self.at + count} at least"
            raise self._error(f"cut short: it {needed}")
        start, self.at = self.at, self.at + count
        return self.data[start : self.at]

    def number(self, count: int = 1) -> int:
        """Return the next `count` bytes as an unsigned number."""
        return int.from_bytes(self.take(count), "big")

    def numbers(self, form: str) -> tuple[Any, ...]:
        """Return the next values of a `struct` format."""
        return struct.unpack(f">{form}", self.take(struct.calcsize(f">{form}")))


class Record(NamedTuple):
    """One record: type (1 to 99), number (equal in records of one print) and bytes."""

    type: int
    idc: int
    data: bytes

    def fields(self) -> dict[int, bytes]:
        """Return the fields of a text record by number."""
        by_number: dict[int, bytes] = {}
        at = 0
        for _ in range(MAX_FIELDS):
            tag = _TAG.match(self.data, at)
            number = int(tag[2]) if tag else 0
            if tag and number >= IMAGE_FIELD and self.type not in _WITHOUT_IMAGE:
                by_number[number] = self.data[tag.end() : -1]
                break
            end = self.data.find(GS, at)
            if tag:
                value = self.data[tag.end() :] if end < 0 else self.data[tag.end() : end]
                by_number.setdefault(number, value.rstrip(FS))
            if end < 0:
                break
            at = end + 1
        return by_number

    def images(self) -> list[bytes]:
        """Return the images of a text record, none if it has no image field.

        The standard allows one, which reaches to the end of the record. Where software has written
        the field again, each is returned, without those that are empty.
        """
        if IMAGE_FIELD not in (fields := self.fields()):
            return []
        again = rb"[\x1c\x1d]0?%d\.%d:" % (self.type, IMAGE_FIELD)
        return [image for image in re.split(again, fields[IMAGE_FIELD]) if image]


def table(value: bytes) -> list[list[bytes]]:
    """Return the items of the subfields of a field."""
    return [subfield.split(US) for subfield in value.split(RS)]


def first_item(value: bytes) -> bytes:
    """Return the first item of the first subfield of a field."""
    return value.split(RS, 1)[0].split(US, 1)[0]


def contents(data: bytes, error: Callable[[str], FpmatchError]) -> list[tuple[int, int]]:
    """Return type and number of each record after the first, which may be all of `data`."""
    listed = Record(1, 0, data[: data.find(FS) + 1] or data).fields().get(3)
    if listed is None:
        raise error("the first record does not list the others (field 1.003)")
    if listed.count(RS) > MAX_RECORDS:
        raise error(f"more than {MAX_RECORDS} records")
    others = []
    for items in table(listed)[1:]:
        if len(items) < 2 or not all(item.isdigit() and len(item) < 4 for item in items[:2]):
            raise error("the list of records (field 1.003) is malformed")
        others.append((int(items[0]), int(items[1])))
    return others


def read_records(data: bytes, error: Callable[[str], FpmatchError]) -> list[Record]:
    """Return all records of a file; raises what `error` makes of the reason if it is damaged."""
    start = START.match(data)
    if start is None:
        raise error("it does not begin with a record of type 1")
    reader = ByteReader(data, error)
    records = [Record(1, 0, reader.take(int(start[1])))]
    for kind, idc in contents(data, error):
        length = _length(reader, kind, error)
        records.append(Record(kind, idc, reader.take(length)))
    return records


def _length(reader: ByteReader, kind: int, error: Callable[[str], FpmatchError]) -> int:
    """Return the length that the record of type `kind` which begins here declares."""
    if kind in BINARY_TYPES:
        length = int.from_bytes(reader.data[reader.at : reader.at + 4], "big")
    else:
        start = _RECORD_START.match(reader.data, reader.at)
        if again := _IMAGE_AGAIN.match(reader.data, reader.at):
            raise error(f"a second field {again[0][:-1].decode()} lies outside its record's length")
        if start is None or int(start[1]) != kind:
            raise error(f"no record of type {kind} at byte {reader.at}, where one is listed")
        length = int(start[2])
    if length < 1:
        raise error(f"the record of type {kind} at byte {reader.at} declares no length")
    return length
