"""Arrays that worker processes of this machine map into memory, instead of copies for each.

An array that lies in a mapped file is sent as the place in that file; another one is copied once
into memory that the workers map. Nothing is written to a disk.
"""

from __future__ import annotations

import io
import os
import pickle
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import EngineError
from fpmatch.gallery.engine.task import identity_of, memory_file, name_of

if TYPE_CHECKING:
    from typing import BinaryIO, Self

    from numpy.typing import NDArray

    from fpmatch.gallery.engine.task import Identity

    Place = tuple[str, Identity, int]

MIN_BYTES: Final = 1 << 16  # smaller arrays are copied,
MIN_BYTES_IN_FILE: Final = 1 << 10  # unless they lie in a mapped file
FILES_KEPT: Final = 8  # that a worker has mapped, the latest ones
_END: Final = 4096  # bytes at both ends of a file that are compared


class MappedArrays:
    """Pack objects whose large arrays other processes map, as long as the block lasts."""

    def __init__(self) -> None:
        self._files: dict[int, tuple[BinaryIO, NDArray[Any]]] = {}  # by array that has the memory

    def __enter__(self) -> Self:
        _allow_open_files()
        return self

    def __exit__(self, *_: object) -> None:
        for stream, _array in self._files.values():
            stream.close()
        self._files.clear()

    def pack(self, content: object) -> bytes:
        """Return bytes of which `pickle.loads` makes the content, in a process of this machine.

        Raises EngineError for what no other process can be sent.
        """
        stream = io.BytesIO()
        try:
            _Pickler(stream, self).dump(content)
        except (AttributeError, TypeError, pickle.PicklingError) as error:
            raise EngineError(
                f"cannot be sent to other processes: {error}; one worker needs none"
            ) from error
        return stream.getvalue()

    def place_of(self, array: NDArray[Any]) -> Place | None:
        """Return a file that other processes can open, and where in it an array begins.

        None where memory cannot be shared.
        """
        owner = _owner_of(array)
        if id(owner) not in self._files:
            stream = _file_of(owner) or memory_file(owner.reshape(-1).view(np.uint8).data)
            if stream is None:
                return None
            self._files[id(owner)] = stream, owner
        stream = self._files[id(owner)][0]
        at = array.__array_interface__["data"][0] - owner.__array_interface__["data"][0]
        return name_of(stream), identity_of(stream), at


class _Pickler(pickle.Pickler):
    def __init__(self, stream: BinaryIO, arrays: MappedArrays) -> None:
        super().__init__(stream, pickle.HIGHEST_PROTOCOL)
        self._arrays = arrays

    def reducer_override(self, obj: Any) -> Any:
        """Reduce large arrays to their places."""
        if type(obj) is not np.ndarray or not obj.flags.c_contiguous or obj.dtype.hasobject:
            return NotImplemented
        in_file = isinstance(_owner_of(obj), np.memmap)
        if obj.nbytes < (MIN_BYTES_IN_FILE if in_file else MIN_BYTES):
            return NotImplemented
        place = self._arrays.place_of(obj)
        return NotImplemented if place is None else (_array_at, (*place, obj.dtype.str, obj.shape))


def _array_at(
    name: str, identity: Identity, at: int, dtype: str, shape: tuple[int, ...]
) -> NDArray[Any]:
    """Return an array in a file that is mapped, read-only."""
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    return _mapped(name, identity)[at : at + size].view(np.ndarray).view(dtype).reshape(shape)


@lru_cache(maxsize=FILES_KEPT)
def _mapped(name: str, identity: Identity) -> np.memmap[Any, np.dtype[np.uint8]]:
    try:
        with Path(name).open("rb") as stream:
            if identity_of(stream) != identity:
                raise EngineError("a file that was mapped has been replaced", path=name)
            return np.memmap(stream, np.uint8, "r")
    except OSError as error:
        raise EngineError("a mapped file cannot be opened by a worker", path=name) from error


def _allow_open_files() -> None:
    """Let this process open as many files as the system permits: each mapped one is held open."""
    with suppress(ImportError, OSError, ValueError):
        import resource  # noqa: PLC0415  (not on Windows)

        _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))


def _owner_of(array: NDArray[Any]) -> NDArray[Any]:
    """Return the array of which this one is a part, itself where it is of none."""
    owner = array
    while isinstance(owner.base, np.ndarray):
        owner = owner.base
    return owner if owner.flags.c_contiguous else array


def _file_of(mapped: NDArray[Any]) -> BinaryIO | None:
    """Return the file that is mapped as an array; None if none is, or another has its place."""
    if not isinstance(mapped, np.memmap) or mapped.filename is None or mapped.offset:
        return None
    with suppress(OSError):
        stream = Path(str(mapped.filename)).open("rb")  # noqa: SIM115  (closed by MappedArrays)
        ends = stream.read(_END), stream.seek(-min(_END, mapped.nbytes), os.SEEK_END)
        whole = mapped.reshape(-1).view(np.uint8)
        same = os.fstat(stream.fileno()).st_size == mapped.nbytes
        if same and (ends[0], stream.read()) == (whole[:_END].tobytes(), whole[-_END:].tobytes()):
            return stream
        stream.close()
    return None
