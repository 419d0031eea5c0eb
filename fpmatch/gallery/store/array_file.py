"""Named arrays in one file; all its bytes are checked before an array is used.

A file consists of a head of 64 bytes with the name of the format, the length of the header, and a
CRC-32 of all after the head; the header, JSON with what the file is about, names, types and shapes;
and the arrays. Header and arrays are filled up to a multiple of 64 bytes. Numbers are
little-endian.
"""

from __future__ import annotations

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

FORMAT: Final = b"fpmatch arrays 3"
HEAD: Final = struct.Struct("<16sQI36x")


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
    content = encode(header, *(array.tobytes() for array in given.values()))
    atomic_write_bytes(path, content if seal is None else seal(content))


def encode(header: bytes, *arrays: bytes) -> bytes:
    """Return a file with a header and the bytes of arrays."""
    rest = b"".join(part + bytes(-len(part) % HEAD.size) for part in (header, *arrays))
    return HEAD.pack(FORMAT, len(header), crc32(rest)) + rest


def read_arrays(
    path: str | os.PathLike[str],
    columns: Mapping[str, Column],
    about: Mapping[str, str],
    *,
    unseal: Callable[[bytes], bytes] | None = None,
) -> dict[str, NDArray[Any]]:
    """Return the arrays that `write_arrays` wrote with the same arguments, read-only.

    They stay in the file, which is mapped, unless `unseal` decrypts it. A file is read, then
    mapped: where a disk fails, that is an error, and not the end of the process. The code of the
    FpmatchError says if the file is "missing", "unreadable", "damaged", or of another version or
    content ("other").
    """
    place = Path(path)
    try:
        if place.exists() and not place.is_file():
            raise FpmatchError("not a file", path=path, code="unreadable")
        stored = place.read_bytes()
        content = stored if unseal is None else unseal(stored)
        form, length, expected = HEAD.unpack_from(content)
        if form != FORMAT and form[:-1] == FORMAT[:-1]:
            raise FpmatchError("of another version", path=path, code="other")
        if form != FORMAT or crc32(memoryview(content)[HEAD.size :]) != expected:
            raise ValueError("another checksum")
        document = parse_json(content[HEAD.size : HEAD.size + length])
        if document["about"] != dict(about):
            raise FpmatchError("of another version or content", path=path, code="other")
        whole = np.memmap(place, np.uint8, "r") if unseal is None else content
        return _checked(document["arrays"], whole, HEAD.size + _filled(length), columns)
    except (FileNotFoundError, NotADirectoryError) as error:
        raise FpmatchError("no such file", path=path, code="missing") from error
    except OSError as error:
        raise FpmatchError(reason(error), path=path, code="unreadable") from error
    except (
        ValueError,
        TypeError,
        LookupError,
        ArithmeticError,
        MemoryError,
        struct.error,
    ) as error:
        raise FpmatchError("damaged", path=path, code="damaged") from error


def _checked(
    listed: Any, whole: bytes | NDArray[np.uint8], at: int, columns: Mapping[str, Column]
) -> dict[str, NDArray[Any]]:
    """Return the arrays in a file from a byte on: one for each of `columns`, in this order."""
    arrays: dict[str, NDArray[Any]] = {}
    lengths: dict[str | int, int] = {}
    for (name, dtype, shape), (expected, column) in zip(listed, columns.items(), strict=True):
        if (name, dtype) != (expected, column.dtype):
            raise ValueError(name)
        for length, dimension in zip(shape, column.shape, strict=True):
            known = dimension if isinstance(dimension, int) else lengths.get(dimension, length)
            if type(length) is not int or length < 0 or length != known:
                raise ValueError(name)
            lengths[dimension] = length
        arrays[name] = np.frombuffer(whole, dtype, math.prod(shape), at).reshape(shape)
        at += _filled(arrays[name].nbytes)
    if at != len(whole):
        raise ValueError("more than the arrays")
    return arrays


def _filled(size: int) -> int:
    return size + -size % HEAD.size
