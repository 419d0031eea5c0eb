"""Named arrays in one file; all its bytes are checked before an array is used.

A file consists of the name of the format; the length of the header; the header, JSON with names,
types and shapes; the content, which is the arrays one after the other, each from a multiple of 64
bytes on; a CRC-32 of each block of the content, which depends on all before the content, too, and
on the number of the block; and one of all else. Numbers are little-endian.
"""

from __future__ import annotations

import errno
import json
import math
import os
import struct
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from zlib import crc32

import numpy as np

from fpmatch.base.output import atomic_write, reason
from fpmatch.base.parsing import parse_json
from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping
    from contextlib import AbstractContextManager
    from typing import BinaryIO

    from numpy.typing import NDArray

FORMAT: Final = b"fpmatch arrays 1"
BLOCK: Final = 4 << 20  # bytes of content under one checksum
MAX_HEADER: Final = 1 << 20  # bytes
END: Final = 2**64 - 1  # stands for the number of a block in the last checksum
_ALIGNMENT: Final = 64
_SUM: Final = 4  # bytes of a checksum
_HEAD: Final = struct.Struct("<16sQ")
_DAMAGED: Final = (ValueError, TypeError, AttributeError, MemoryError)


@dataclass(frozen=True, slots=True)
class Column:
    """State what an array must be: its type, and the length of each dimension, or its name.

    Dimensions of the same name have the same length in all arrays of a file.
    """

    dtype: str
    shape: tuple[str | int, ...]


class _OtherFileError(Exception):
    """A file is whole, but of another version or content."""


def write_arrays(
    path: str | os.PathLike[str],
    arrays: Mapping[str, NDArray[Any]],
    columns: Mapping[str, Column],
    about: Mapping[str, str],
    *,
    seal: Callable[[BinaryIO], AbstractContextManager[Any]] = nullcontext,
) -> None:
    """Write arrays to a file that appears whole or not at all, else raise OutputError.

    `seal` yields the stream to write to, which may encrypt what the file then contains.
    """
    with atomic_write(path) as stream, seal(stream) as sealed:
        write_content(sealed, *encode_arrays(arrays, columns, about))


def read_arrays(
    path: str | os.PathLike[str],
    columns: Mapping[str, Column],
    about: Mapping[str, str],
    *,
    unseal: Callable[[BinaryIO], memoryview] | None = None,
) -> dict[str, NDArray[Any]]:
    """Return the arrays that `write_arrays` wrote with the same arguments, read-only.

    They stay in the file, which is mapped. `unseal` returns what was written to the stream of
    `seal` instead, or raises an error if a bit of it was changed: checksums are not read then. The
    code of the FpmatchError says if the file is "missing", "unreadable", "damaged", or of another
    version or content ("other").
    """
    try:
        return decode_arrays(*read_content(path, unseal), columns, about)
    except (FileNotFoundError, NotADirectoryError) as error:
        raise FpmatchError("no such file", path=path, code="missing") from error
    except OSError as error:
        raise FpmatchError(reason(error), path=path, code="unreadable") from error
    except _OtherFileError as error:
        raise FpmatchError(str(error), path=path, code="other") from error
    except _DAMAGED as error:
        raise FpmatchError("damaged", path=path, code="damaged") from error


def encode_arrays(
    arrays: Mapping[str, NDArray[Any]], columns: Mapping[str, Column], about: Mapping[str, str]
) -> tuple[bytes, Iterator[memoryview]]:
    """Return the header of a file, and the parts of its content."""
    given = {k: np.ascontiguousarray(arrays[k], column.dtype) for k, column in columns.items()}
    listed = [[k, column.dtype, given[k].shape] for k, column in columns.items()]
    return json.dumps({"about": dict(about), "arrays": listed}).encode(), _parts(given.values())


def decode_arrays(
    header: bytes,
    content: NDArray[np.uint8],
    columns: Mapping[str, Column],
    about: Mapping[str, str],
) -> dict[str, NDArray[Any]]:
    """Return the arrays in the content of a file, those of `columns` in this order."""
    document = parse_json(header)
    if document.keys() != {"about", "arrays"}:
        raise ValueError("more than is known")
    if document["about"] != dict(about):
        raise _OtherFileError("of another version or content")
    arrays: dict[str, NDArray[Any]] = {}
    lengths: dict[str | int, int] = {}
    at = 0
    for (name, dtype, shape), (expected, column) in zip(
        document["arrays"], columns.items(), strict=True
    ):
        if (name, dtype, len(shape)) != (expected, column.dtype, len(column.shape)):
            raise ValueError(name)
        for length, dimension in zip(shape, column.shape, strict=True):
            known = dimension if isinstance(dimension, int) else lengths.get(dimension, length)
            if type(length) is not int or length < 0 or length != known:
                raise ValueError(name)
            lengths[dimension] = length
        size = math.prod(shape) * np.dtype(column.dtype).itemsize
        if size > len(content) - at:
            raise ValueError(name)
        array = content[at : at + size].view(column.dtype).reshape(shape)
        arrays[name] = array.astype(array.dtype.newbyteorder("="), copy=False).view(np.ndarray)
        arrays[name].flags.writeable = False
        at += size + -size % _ALIGNMENT
    if at != len(content):
        raise ValueError("more than the arrays")
    return arrays


def write_content(stream: BinaryIO, header: bytes, parts: Iterable[memoryview]) -> None:
    """Write a header and the parts of a content, with their checksums, to an empty file."""
    header += b" " * (-(_HEAD.size + len(header)) % _ALIGNMENT)
    start = _HEAD.pack(FORMAT, len(header)) + header
    stream.write(start)
    sums = b""
    for number, block in enumerate(_blocks(parts)):
        stream.write(block)
        sums += _checksum(start, number, block)
    stream.write(sums + _checksum(start, END, sums))


def read_content(
    path: str | os.PathLike[str], unseal: Callable[[BinaryIO], memoryview] | None = None
) -> tuple[bytes, NDArray[np.uint8]]:
    """Return the header and the content that `write_content` wrote, once all is checked."""
    if not Path(path).is_file():
        raise OSError(errno.EINVAL, "not a file") if Path(path).exists() else FileNotFoundError
    file: NDArray[np.uint8]
    with Path(path).open("rb") as stream:
        if unseal is None:
            start, size = _check(stream)
            file = np.memmap(stream, np.uint8, "r")
        else:
            file = np.frombuffer(unseal(stream), np.uint8)
            start, size = _layout(file[: _HEAD.size + MAX_HEADER].tobytes(), len(file))
    return start[_HEAD.size :], file[len(start) :][:size]


def _layout(begin: bytes, total: int) -> tuple[bytes, int]:
    """Return head and header, and the size of the content, of a file of `total` bytes."""
    left = total - _HEAD.size
    if left < _SUM or not begin.startswith(FORMAT[:-1]):
        raise ValueError("no file of arrays")
    if not begin.startswith(FORMAT):
        raise _OtherFileError("of another version")
    left -= (length := _HEAD.unpack(begin[: _HEAD.size])[1])
    if length > MAX_HEADER or left < _SUM:
        raise ValueError("the header is too long")
    blocks = -(-(left - _SUM) // (BLOCK + _SUM))
    size = left - (blocks + 1) * _SUM
    if not (blocks - 1) * BLOCK < size <= blocks * BLOCK:
        raise ValueError("another length")
    return begin[: _HEAD.size + length], size


def _check(stream: BinaryIO) -> tuple[bytes, int]:
    """Return what `_layout` does, once all checksums of a file are found right.

    It is read, not mapped: where a disk fails, that is an error, and not the end of the process.
    """
    total = os.fstat(stream.fileno()).st_size
    start, size = _layout(stream.read(_HEAD.size + MAX_HEADER), total)
    stream.seek(len(start))
    sums, room = b"", memoryview(bytearray(BLOCK))
    for number, at in enumerate(range(0, size, BLOCK)):
        block = room[: min(BLOCK, size - at)]
        if stream.readinto(block) != len(block):  # type: ignore[attr-defined]
            raise ValueError("cut short")
        sums += _checksum(start, number, block)
    if stream.read() != sums + _checksum(start, END, sums):
        raise ValueError("another checksum")
    return start, size


def _checksum(start: bytes, number: int, block: memoryview | bytes) -> bytes:
    """Return the checksum of a block, by its number, of a file that begins with `start`."""
    return crc32(block, crc32(start + number.to_bytes(8, "little"))).to_bytes(_SUM, "little")


def _parts(arrays: Iterable[NDArray[Any]]) -> Iterator[memoryview]:
    """Yield the bytes of arrays, each with zeros up to a multiple of the alignment."""
    for array in arrays:
        yield array.reshape(-1).view(np.uint8).data
        yield memoryview(bytes(-array.nbytes % _ALIGNMENT))


def _blocks(parts: Iterable[memoryview]) -> Iterator[memoryview]:
    """Yield the bytes of `parts` in blocks, each of which is valid until the next one."""
    block, filled = memoryview(bytearray(BLOCK)), 0
    for part in parts:
        at = 0
        while at < len(part):
            taken = part[at : at + BLOCK - filled]
            block[filled : filled + len(taken)] = taken
            at, filled = at + len(taken), filled + len(taken)
            if filled == BLOCK:
                yield block
                filled = 0
    if filled:
        yield block[:filled]
