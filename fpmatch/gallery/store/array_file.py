"""Named arrays in one file; all its bytes are checked before an array is used.

A file consists of the name of the format; the length of the header; the header, JSON with names,
types and shapes; the arrays one after the other, each from a multiple of 64 bytes on; and a CRC-32
of all before. Numbers are little-endian.
"""

from __future__ import annotations

import errno
import json
import math
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from zlib import crc32

import numpy as np

from fpmatch.base.output import atomic_write_bytes, reason
from fpmatch.base.parsing import parse_json
from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

FORMAT: Final = b"fpmatch arrays 2"
MAX_HEADER: Final = 1 << 20  # bytes
READ_AT_ONCE: Final = 4 << 20
_ALIGNMENT: Final = 64
_HEAD: Final = struct.Struct("<16sQ")
_SUM: Final = struct.Struct("<I")


@dataclass(frozen=True, slots=True)
class Column:
    """State what an array must be: its type, and the length of each dimension, or its name.

    Dimensions of the same name have the same length in all arrays of a file.
    """

    dtype: str
    shape: tuple[str | int, ...]


def write_arrays(
    path: str | os.PathLike[str],
    arrays: Mapping[str, NDArray[Any]],
    columns: Mapping[str, Column],
    about: Mapping[str, str],
    *,
    seal: Callable[[bytes], bytes] | None = None,
) -> None:
    """Write arrays to a file that appears whole or not at all, else raise OutputError.

    `seal` may encrypt what the file then contains.
    """
    given = {k: np.ascontiguousarray(arrays[k], column.dtype) for k, column in columns.items()}
    listed = [[k, column.dtype, given[k].shape] for k, column in columns.items()]
    header = json.dumps({"about": dict(about), "arrays": listed}).encode()
    parts = [array.tobytes() for array in given.values()]
    content = encode(header, b"".join(part + bytes(-len(part) % _ALIGNMENT) for part in parts))
    atomic_write_bytes(path, content if seal is None else seal(content))


def encode(header: bytes, content: bytes) -> bytes:
    """Return a file with a header and the bytes of arrays."""
    header += b" " * (-(_HEAD.size + len(header)) % _ALIGNMENT)
    whole = _HEAD.pack(FORMAT, len(header)) + header + content
    return whole + _SUM.pack(crc32(whole))


def read_arrays(
    path: str | os.PathLike[str],
    columns: Mapping[str, Column],
    about: Mapping[str, str],
    *,
    unseal: Callable[[bytes], bytes] | None = None,
) -> dict[str, NDArray[Any]]:
    """Return the arrays that `write_arrays` wrote with the same arguments, read-only.

    They stay in the file, which is mapped, unless `unseal` decrypts it. The code of the
    FpmatchError says if the file is "missing", "unreadable", "damaged", or of another version or
    content ("other").
    """
    try:
        header, content = read_content(Path(path), unseal)
        document = parse_json(header)
        if document["about"] != dict(about):
            raise FpmatchError("of another version or content", path=path, code="other")
        return _checked(document["arrays"], content, columns)
    except (FileNotFoundError, NotADirectoryError) as error:
        raise FpmatchError("no such file", path=path, code="missing") from error
    except OSError as error:
        raise FpmatchError(reason(error), path=path, code="unreadable") from error
    except (ValueError, TypeError, KeyError, MemoryError) as error:
        raise FpmatchError("damaged", path=path, code="damaged") from error


def read_content(
    path: Path, unseal: Callable[[bytes], bytes] | None = None
) -> tuple[bytes, NDArray[np.uint8]]:
    """Return the header and the bytes of the arrays of a file, once all is checked.

    A file is read, then mapped: where a disk fails, that is an error, and not the end of the
    process.
    """
    if not path.is_file():
        raise OSError(errno.EINVAL, "not a file") if path.exists() else FileNotFoundError
    whole: NDArray[np.uint8]
    if unseal is None:
        checksum = _checksum(path)
        whole = np.memmap(path, np.uint8, "r")
    else:
        whole = np.frombuffer(unseal(path.read_bytes()), np.uint8)
        checksum = crc32(whole[: -_SUM.size].data)
    if len(whole) < _HEAD.size + _SUM.size:
        raise ValueError("cut short")
    form, length = _HEAD.unpack(whole[: _HEAD.size].tobytes())
    if form != FORMAT and form[:-1] == FORMAT[:-1]:
        raise FpmatchError("of another version", path=path, code="other")
    right = _SUM.pack(checksum) == whole[-_SUM.size :].tobytes()
    if form != FORMAT or length > MAX_HEADER or not right:
        raise ValueError("another checksum")
    content = whole[_HEAD.size + length : -_SUM.size]
    return whole[_HEAD.size : _HEAD.size + length].tobytes(), content


def _checksum(path: Path) -> int:
    """Return the checksum of a file but its last bytes."""
    checksum, left = 0, path.stat().st_size - _SUM.size
    with path.open("rb") as stream:
        while left > 0 and (block := stream.read(min(left, READ_AT_ONCE))):
            checksum, left = crc32(block, checksum), left - len(block)
    return checksum


def _checked(
    listed: Any, content: NDArray[np.uint8], columns: Mapping[str, Column]
) -> dict[str, NDArray[Any]]:
    """Return the arrays in the content of a file, those of `columns` in this order."""
    arrays: dict[str, NDArray[Any]] = {}
    lengths: dict[str | int, int] = {}
    at = 0
    for (name, dtype, shape), (expected, column) in zip(listed, columns.items(), strict=True):
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
