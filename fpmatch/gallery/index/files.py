"""Files of an index: segments, which never change, and a list of them, which is replaced whole.

A killed process leaves the list of before or the one of after; segments that are not on it are
deleted by the next one that writes. Both are files of arrays (see
`fpmatch.gallery.store.array_file`), whose checksums are checked when they are read.
"""

from __future__ import annotations

import secrets
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch._version import __version__
from fpmatch.base.folders import remove_unfinished
from fpmatch.base.output import reason
from fpmatch.errors import FpmatchError
from fpmatch.gallery.index.segment import COLUMNS, MOST_PRINTS, Segment, parameters
from fpmatch.gallery.store.array_file import Column, read_arrays, write_arrays
from fpmatch.gallery.store.kept_files import (
    INDEX,
    SEGMENT,
    STALE_S,
    kept_folders,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Collection
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.gallery.store.gallery import Gallery
    from fpmatch.gallery.store.sealing import Sealing

NAME_BYTES: Final = 8
MOST_STATE: Final = 200  # bytes of the state of a gallery
LIST_COLUMNS: Final = {
    "state": Column("|u1", ("state",)),
    "last": Column("<i8", (1,)),
    "name": Column("|u1", ("segment", NAME_BYTES)),
    "prints": Column("<i8", ("segment", 3)),
    "damaged": Column("<i8", ("damaged",)),
}


def _no_numbers() -> NDArray[np.int64]:
    return np.empty(0, np.int64)


@dataclass(frozen=True, slots=True)
class Listed:
    """State which file has a segment, how many prints, and the first and last of their numbers."""

    name: str
    prints: int
    first: int
    last: int

    @classmethod
    def of(cls, segment: Segment) -> Listed:
        """Return how a new segment, which is not empty, is listed."""
        first, last = segment.number[[0, -1]].tolist()
        return cls(secrets.token_hex(NAME_BYTES), len(segment), first, last)


@dataclass(frozen=True, slots=True, eq=False)
class IndexList:
    """The segments of an index, whose ranges of numbers ascend.

    All entries of numbers up to `last` are in them that the gallery had in its `state`, but those
    that are `damaged`, which ascend; some may have been removed before. `state` is "" where it is
    not known.
    """

    state: str = ""
    last: int = 0
    segments: tuple[Listed, ...] = ()
    damaged: NDArray[np.int64] = field(default_factory=_no_numbers)


@dataclass(frozen=True, slots=True)
class IndexFolder:
    """Read and write the files of the index of a gallery, for a matcher, in one folder."""

    path: Path
    matcher: str
    sealing: Sealing | None = None

    def read_list(self) -> IndexList:
        """Return the list; raise FpmatchError with the codes of `read_arrays`."""
        path = self._list
        about = self._about(path)
        arrays = read_arrays(path, LIST_COLUMNS, about, unseal=self._unseal)
        try:
            return _as_list(arrays)
        except ValueError as error:  # of bytes that are no text, too
            raise FpmatchError("damaged", path=path, code="damaged") from error

    def write_list(self, listed: IndexList) -> None:
        """Replace the list, and delete other segments; raise OutputError if that is impossible."""
        segments = listed.segments
        names = [list(bytes.fromhex(one.name)) for one in segments]
        prints = [(one.prints, one.first, one.last) for one in segments]
        arrays = {
            "state": np.frombuffer(listed.state.encode(), np.uint8),
            "last": np.array([listed.last]),
            "name": np.array(names, np.uint8).reshape(-1, NAME_BYTES),
            "prints": np.array(prints, np.int64).reshape(-1, 3),
            "damaged": listed.damaged,
        }
        self._write(self._list, arrays, LIST_COLUMNS)
        self.delete_others(segments)

    def read_segment(self, listed: Listed) -> Segment:
        """Return a segment, mapped; raise FpmatchError with the codes of `read_arrays`."""
        path = self._segment(listed.name)
        arrays = read_arrays(path, COLUMNS, self._about(path), unseal=self._unseal)
        try:
            segment = Segment.of_arrays(arrays)
        except FpmatchError as error:
            raise FpmatchError("damaged", path=path, code="damaged") from error
        if (len(segment), *segment.number[[0, -1]]) != (listed.prints, listed.first, listed.last):
            raise FpmatchError("another segment", path=path, code="other")
        return segment

    def write_segment(self, listed: Listed, segment: Segment) -> None:
        """Write a segment; raise OutputError if that is impossible."""
        self._write(self._segment(listed.name), segment.arrays(), COLUMNS)

    def delete(self) -> None:
        """Delete the index; raise FpmatchError if that is impossible."""
        _delete(self._list, strict=True)
        self.delete_others((), strict=True)

    def delete_others(self, kept: Collection[Listed], *, strict: bool = False) -> None:
        """Delete all segments but those that are kept, and old unfinished files.

        With `strict`, raise FpmatchError if one cannot be deleted.
        """
        with suppress(OSError):
            remove_unfinished(self.path, older_than_s=STALE_S)
        names = {self._segment(one.name).name for one in kept}
        for path in self.path.glob(self._segment("*").name):
            if path.name not in names:
                _delete(path, strict=strict)

    @property
    def _list(self) -> Path:
        return self.path / f"{self.matcher}{INDEX}"

    def _segment(self, name: str) -> Path:
        return self.path / f"{self.matcher}.{name}{SEGMENT}"

    def _about(self, path: Path) -> dict[str, str]:
        return {"name": path.name, "index": parameters(), "version": __version__}

    def _write(
        self, path: Path, arrays: dict[str, NDArray[Any]], columns: dict[str, Column]
    ) -> None:
        sealing = self.sealing
        seal = sealing.seal_file if sealing is not None else None
        write_arrays(path, arrays, columns, self._about(path), seal=seal)

    @property
    def _unseal(self) -> Callable[[bytes], bytes] | None:
        sealing = self.sealing
        return sealing.unseal_file if sealing is not None else None


def index_folders(gallery: Gallery, matcher: str) -> list[IndexFolder]:
    """Return the folders in which an index of a gallery may be, the preferred one first."""
    sealing = gallery.sealing()
    return [IndexFolder(path, matcher, sealing) for path in kept_folders(gallery)]


def _delete(path: Path, *, strict: bool) -> None:
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        if strict:
            raise FpmatchError(f"{path.name}: cannot be deleted: {reason(error)}") from error


def _as_list(arrays: dict[str, NDArray[Any]]) -> IndexList:
    """Return the list in the arrays of a file; ValueError if it is not one that was written."""
    state = arrays["state"].tobytes()
    (last,) = arrays["last"].tolist()
    rows = arrays["prints"].tolist()
    names = [name.tobytes().hex() for name in arrays["name"]]
    if len(state) > MOST_STATE or last < 0 or len({*names}) < len(names):
        raise ValueError("no list of segments")
    before = 0
    for prints, first, end in rows:
        if not (0 < prints <= MOST_PRINTS and before < first <= end):
            raise ValueError("impossible segments")
        before = end
    if before > last or (np.diff(arrays["damaged"]) <= 0).any():
        raise ValueError("numbers that do not ascend")
    return IndexList(
        state.decode(),
        last,
        tuple(Listed(name, *row) for name, row in zip(names, rows, strict=True)),
        arrays["damaged"],
    )
