"""The bit descriptors of many prints in flat arrays of few bytes, scored as the prefilter does."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.gallery.index.prints._descriptor_kernel import DescriptorReader, DescriptorWriter
from fpmatch.gallery.index.prints.print_arrays import (
    MAX_MINUTIAE,
    MAX_PX,
    PRINT,
    START,
    PrintArrays,
    of_each,
)
from fpmatch.matching.compiled import COMPILED
from fpmatch.matching.constants.prints import MAX_ENCODED
from fpmatch.matching.prints.prepared import BitDescriptors

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from numpy.typing import NDArray

    from fpmatch.matching.prints.prepared import PreparedTemplate

if COMPILED:
    from fpmatch.matching.prints.prepare import prefilter_of

CONTENT: Final = "content_start"  # dimension of the packed bytes
PLACES: Final = 1024  # along either axis
MAX_DOUBLINGS: Final = 7  # of the step, from one pixel on: 2 * MAX_PX lie within the places
MAX_CONTENT: Final = MAX_ENCODED * 9  # of a print: three words of 32 bits, and two in each
_NO_WORD: Final = 0x8800  # bits of a word that counts in neither grid


@dataclass(frozen=True, eq=False)
class StoredDescriptors(PrintArrays):
    """The bit descriptors of prints in flat arrays.

    Print k has the bytes from ``content_start[k]`` to ``content_start[k + 1]``, which contain those
    of its `size` minutiae that have a neighbour (see `_descriptor_kernel`). They lie ``2 ** step``
    pixels times whole numbers from its `origin`, in pixels at 500 dpi, y pointing up. So scores are
    those of `prefilter_scores` for prints of whole pixels, as galleries contain them, up to 1,024
    pixels wide; of others, positions are rounded. Where `has_flow` is 0, the orientation is not
    known.
    """

    content_start: NDArray[np.int64] = field(metadata=of_each(START, "<i8"))
    content: NDArray[np.uint32] = field(metadata=of_each(CONTENT, "<u4"))
    origin: NDArray[np.float32] = field(metadata=of_each(PRINT, "<f4", 2))
    size: NDArray[np.uint16] = field(metadata=of_each(PRINT, "<u2"))
    step: NDArray[np.uint8] = field(metadata=of_each(PRINT, "|u1"))
    has_flow: NDArray[np.uint8] = field(metadata=of_each(PRINT, "|u1"))

    @classmethod
    def pack(cls, prints: Iterable[PreparedTemplate]) -> StoredDescriptors:
        """Pack the bit descriptors of prepared prints.

        Raises MatcherError if a print has more than 256 minutiae, or is wider than 131,071 pixels.
        """
        writer = DescriptorWriter()
        packed = [_packed(writer, print_) for print_ in prints]
        content = [part[0] for part in packed]
        return cls(
            content_start=np.cumsum([0, *map(len, content)], dtype=np.int64),
            content=np.concatenate([*content, np.zeros(0, np.uint32)]),
            origin=np.array([part[1] for part in packed], np.float32).reshape(-1, 2),
            size=np.array([part[2] for part in packed], np.uint16),
            step=np.array([part[3] for part in packed], np.uint8),
            has_flow=np.array([part[4] for part in packed], np.uint8),
        )

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> StoredDescriptors:
        """Return the prints of the arrays, among others, that are those of `COLUMNS`.

        Only what belongs to whole prints is checked, so that a large file opens fast: `scores`
        and ``[k]`` refuse content that `pack` never writes, and read no byte outside a print.

        Raises MatcherError if a number would lead out of an array, or of what `pack` packs.
        """
        start, origin = arrays["content_start"], arrays["origin"]
        if len(start) != len(origin) + 1 or start[0] or start[-1] != len(arrays["content"]):
            raise MatcherError("damaged", code="damaged")
        length = np.diff(start)
        checks = (
            (start[1:] >= start[:-1]) & (length >= 0) & (length <= MAX_CONTENT),
            np.abs(origin) <= 2 * MAX_PX,
            arrays["size"] <= MAX_MINUTIAE,
            arrays["step"] <= MAX_DOUBLINGS,
            arrays["has_flow"] <= 1,
        )
        if not all(bool(check.all()) for check in checks):
            raise MatcherError("damaged", code="damaged")
        return cls(**{name: arrays[name] for name in COLUMNS})

    def __len__(self) -> int:
        return len(self.step)

    def __getitem__(self, k: int) -> BitDescriptors:
        """Return the bit descriptors of print k, of the minutiae that have neighbours."""
        if not 0 <= k < len(self):
            raise IndexError(f"print {k} of {len(self)}")
        reader = DescriptorReader(self)
        n = reader.unpack(k)
        if n < 0:
            raise MatcherError("damaged", code="damaged")
        arrays = reader.xy, reader.direction_bin, reader.neighbour_bits, reader.orientation_bins
        xy, direction_bin, neighbour_bits, orientation_bins = (np.asarray(a)[:n] for a in arrays)
        known = bool(self.has_flow[k])
        return BitDescriptors(xy, direction_bin, neighbour_bits, orientation_bins, known)

    def scores(
        self,
        probe: PreparedTemplate,
        which: NDArray[np.integer] | None = None,
    ) -> NDArray[np.int32]:
        """Return how much the bit descriptors of prints have in common with those of a probe.

        `which` are the numbers of the prints, in any order (default: all). Raises IndexError if a
        number is that of no print, and MatcherError if the bytes of a print are damaged.
        """
        numbers = np.arange(len(self)) if which is None else np.asarray(which, np.int64)
        if len(numbers) and not 0 <= numbers.min() <= numbers.max() < len(self):
            raise IndexError(f"a print outside of {len(self)}")
        ours, scores = probe.bit_descriptors, np.empty(len(numbers), np.int32)
        if not COMPILED:
            from fpmatch.matching.reference.prefilter import descriptor_similarity  # noqa: PLC0415

            scores[:] = [descriptor_similarity(ours, self[k]) for k in numbers.tolist()]
            return scores
        DescriptorReader(self).score(prefilter_of(ours), np.ascontiguousarray(numbers), scores)
        if (scores < 0).any():
            raise MatcherError("damaged", code="damaged")
        return scores


COLUMNS: Final = StoredDescriptors.columns()


def _packed(
    writer: DescriptorWriter, print_: PreparedTemplate
) -> tuple[NDArray[np.uint32], NDArray[np.float32], int, int, bool]:
    """Return the bytes of a print, its origin, size and step, and whether its flow is known."""
    bits, size = print_.bit_descriptors, len(print_)
    if size > MAX_MINUTIAE:
        raise MatcherError(f"a print of {size} minutiae; {MAX_MINUTIAE} can be packed")
    coded = ((bits.neighbour_bits & _NO_WORD) != _NO_WORD).any(axis=1)
    xy = bits.xy if coded.all() else bits.xy[coded]
    origin = xy.min(axis=0) if len(xy) else np.zeros(2, np.float32)
    reach = float((xy - origin).max(initial=0.0))
    step = 0
    while reach / (1 << step) > PLACES - 0.75:  # rounded: the last place
        step += 1
    if step > MAX_DOUBLINGS:
        raise MatcherError(f"minutiae {reach:.0f} pixels apart")
    # minutiae without a word may lie farther off, but are not written
    places: Any = np.rint((bits.xy - origin) / (1 << step)).astype(np.int32)
    neighbours = print_.neighbourhoods.neighbour
    arrays: Any = bits.direction_bin, neighbours, bits.neighbour_bits, bits.orientation_bins
    used = writer.write(memoryview(places), step == 0, *(memoryview(of) for of in arrays))
    return np.array(writer.content[:used]), origin, size, step, bits.has_flow
