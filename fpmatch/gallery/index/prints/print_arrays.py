"""Flat arrays with an entry for each print, or each part of a print: the base of many prints."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np

from fpmatch.gallery.store.array_file import Column

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    Arrays = Mapping[str, NDArray[Any]]

MAX_MINUTIAE: Final = 256  # of a print, that a byte can number
# dimensions: one entry a print; one more than that. Others have the name of the array of starts.
PRINT: Final = "print"
START: Final = "start"

Prints = TypeVar("Prints", bound="PrintArrays")


def of_each(what: str, dtype: str, *shape: int) -> dict[str, Column]:
    """Return of what the entries of an array are, its type, and the shape of an entry."""
    return {"column": Column(dtype, (what, *shape))}


class PrintArrays:
    """Base of dataclasses whose fields are the arrays of many prints, one print after the other.

    A field of the dimension `START` has the first entry of each print, and the end of the last one,
    in all arrays of the dimension that has its name.
    """

    @classmethod
    def columns(cls) -> dict[str, Column]:
        """Return what each array must be, for `fpmatch.gallery.store.array_file`."""
        return {f.name: f.metadata["column"] for f in fields(cls)}  # type: ignore[arg-type]

    @classmethod
    def concatenate(cls: type[Prints], parts: Sequence[Prints]) -> Prints:
        """Return the prints of all `parts`, one after the other: of one, itself."""
        if len(parts) == 1:
            return parts[0]
        joined: dict[str, Any] = {}
        for name, column in cls.columns().items():
            arrays = [getattr(part, name) for part in parts] or [_no_entries(column)]
            if column.shape[0] == START:
                ends = np.cumsum([0, *(int(array[-1]) for array in arrays)])
                moved = [a[:-1] + end for a, end in zip(arrays, ends, strict=False)]
                joined[name] = np.concatenate([*moved, ends[-1:]]).astype(column.dtype, copy=False)
            else:
                joined[name] = np.concatenate(arrays)
        return cls(**joined)

    def take(self: Prints, which: NDArray[np.integer]) -> Prints:
        """Return a copy of the prints with the numbers `which`, shape (K,), in this order."""
        columns = self.columns()
        entries: dict[str, NDArray[np.integer]] = {PRINT: which}
        taken: dict[str, Any] = {}
        for starts in [name for name, column in columns.items() if column.shape[0] == START]:
            begin = getattr(self, starts)[which]
            length = getattr(self, starts)[which + 1] - begin
            taken[starts] = np.concatenate([[0], np.cumsum(length)]).astype(columns[starts].dtype)
            entries[starts] = np.repeat(begin - taken[starts][:-1], length)
            entries[starts] += np.arange(length.sum())
        taken |= {
            name: getattr(self, name)[entries[str(column.shape[0])]]
            for name, column in columns.items()
            if name not in taken
        }
        return type(self)(**taken)

    def part(self: Prints, first: int, last: int) -> Prints:
        """Return the prints from `first` to, not including, `last`, mostly in the same memory."""
        taken: dict[str, Any] = {}
        for name, column in self.columns().items():
            dimension, array = str(column.shape[0]), getattr(self, name)
            if dimension == START:
                taken[name] = array[first : last + 1] - array[first]
            elif dimension == PRINT:
                taken[name] = array[first:last]
            else:
                begin, end = getattr(self, dimension)[[first, last]].tolist()
                taken[name] = array[begin:end]
        return type(self)(**taken)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), tuple(self.arrays().values())

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the arrays by name."""
        return {name: getattr(self, name) for name in self.columns()}

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        return sum(array.nbytes for array in self.arrays().values())


def _no_entries(column: Column) -> NDArray[Any]:
    """Return an array of no prints."""
    return np.zeros((int(column.shape[0] == START), *map(int, column.shape[1:])), column.dtype)
