"""The bit descriptors of many prints in flat arrays, scored as the prefilter scores two prints."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.gallery.index.prints.prepared_prints import (
    MAX_MINUTIAE,
    PRINT,
    START,
    PrintArrays,
    of_each,
)
from fpmatch.matching.compiled import COMPILED
from fpmatch.matching.constants.prints import NEIGHBOUR_WORDS, ORIENTATION_WORDS, UNKNOWN_BIN

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.matching.prints.prepared import PreparedTemplate

if COMPILED:
    from fpmatch.gallery.index._descriptor_kernel import score_prints
    from fpmatch.matching.prints.prepare import prefilter_of

MINUTIA: Final = "minutiae_start"  # dimension: one entry a minutia that has a word
NO_WORD: Final = 0x8800  # bits of a word that counts in neither grid
NEIGHBOURS: Final = 6  # of a minutia, of twelve: with these alone no more mates are lost
PLACES: Final = np.array([0, 1, 2, 3, 5, 7, 9, 11], np.int32)  # of ridge orientation, likewise
_SHORT: Final = np.iinfo(np.int16)


@dataclass(frozen=True, eq=False)
class StoredDescriptors(PrintArrays):
    """The bit descriptors of prints in flat arrays.

    Print k has the minutiae from ``minutiae_start[k]`` to ``minutiae_start[k + 1]``, each with a
    neighbour. A minutia keeps the words of its first neighbours and of some places of ridge
    orientation. Positions are rounded to whole pixels at 500 dpi, y pointing up, as galleries
    contain them. Where `has_flow` is 0, the orientation is not known.
    """

    minutiae_start: NDArray[np.int64] = field(metadata=of_each(START, "<i8"))
    xy: NDArray[np.int16] = field(metadata=of_each(MINUTIA, "<i2", 2))
    direction_bin: NDArray[np.uint8] = field(metadata=of_each(MINUTIA, "|u1"))
    neighbour_bits: NDArray[np.uint16] = field(metadata=of_each(MINUTIA, "<u2", NEIGHBOURS))
    orientation_bins: NDArray[np.uint8] = field(metadata=of_each(MINUTIA, "|u1", len(PLACES)))
    has_flow: NDArray[np.uint8] = field(metadata=of_each(PRINT, "|u1"))

    @classmethod
    def pack(cls, prints: Sequence[PreparedTemplate]) -> StoredDescriptors:
        """Return the bit descriptors of prepared prints."""
        whole = [print_.bit_descriptors for print_ in prints]
        given = [replace(one, orientation_bins=one.orientation_bins[:, PLACES]) for one in whole]
        kept = [
            np.flatnonzero(((one.neighbour_bits[:, :NEIGHBOURS] & NO_WORD) != NO_WORD).any(axis=1))
            for one in given
        ]
        columns: dict[str, Any] = {
            name: np.concatenate(
                [
                    np.empty((0, *map(int, column.shape[1:]))),
                    *(
                        getattr(one, name)[(some, *map(slice, column.shape[1:]))]
                        for one, some in zip(given, kept, strict=True)
                    ),
                ]
            )
            for name, column in COLUMNS.items()
            if column.shape[0] == MINUTIA
        }
        columns["xy"] = np.clip(np.rint(columns["xy"]), _SHORT.min, _SHORT.max)
        columns["minutiae_start"] = np.cumsum([0, *map(len, kept)])
        columns["has_flow"] = np.array([one.has_flow for one in given])
        return cls(**{name: columns[name].astype(c.dtype) for name, c in COLUMNS.items()})

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> StoredDescriptors:
        """Return the prints in the arrays of `COLUMNS`; other arrays are ignored.

        Raises MatcherError if a number would lead out of an array, or of what `pack` makes.
        """
        start = arrays["minutiae_start"]
        length = np.diff(start)
        if not (
            len(start) == len(arrays["has_flow"]) + 1
            and start[0] == 0
            and start[-1] == len(arrays["xy"])
            and ((length >= 0) & (length <= MAX_MINUTIAE)).all()
            and (arrays["orientation_bins"] <= UNKNOWN_BIN).all()
            and (arrays["has_flow"] <= 1).all()
        ):
            raise MatcherError("damaged", code="damaged")
        return cls(**{name: arrays[name] for name in COLUMNS})

    def __len__(self) -> int:
        return len(self.has_flow)

    def scores(self, probe: PreparedTemplate, which: NDArray[np.integer]) -> NDArray[np.int32]:
        """Return how much the prints of some numbers have in common with a probe.

        Raises IndexError if a number is that of no print.
        """
        numbers, scores = np.ascontiguousarray(which, np.int64), np.empty(len(which), np.int32)
        if len(numbers) and not 0 <= numbers.min() <= numbers.max() < len(self):
            raise IndexError(f"a print outside of {len(self)}")
        room = (
            np.empty((MAX_MINUTIAE, 2), np.float32),
            np.full((MAX_MINUTIAE, NEIGHBOUR_WORDS), NO_WORD, np.uint16),
            np.full((MAX_MINUTIAE, ORIENTATION_WORDS), UNKNOWN_BIN, np.uint8),
        )
        tables, arrays = prefilter_of(probe.bit_descriptors), self.arrays().values()
        score_prints(tables, *arrays, numbers, PLACES, *room, scores)
        return scores


COLUMNS: Final = StoredDescriptors.columns()
