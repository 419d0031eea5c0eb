"""A segment of an index: inverted lists and embeddings of up to 65,536 prints, in flat arrays.

Once made, a segment is not changed. Its arrays may be mapped from a file (see
`fpmatch.gallery.store.array_file`), which is a cache: it can be made again from the templates.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.gallery.index._vote_kernel import add_similarity, count_votes, lists_ascend
from fpmatch.gallery.index.embedding import LENGTH, embeddings
from fpmatch.gallery.index.model import CURVATURES, TERMS
from fpmatch.gallery.index.terms import print_terms
from fpmatch.gallery.store.array_file import Column

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.index.terms import ProbeTerms
    from fpmatch.matching.prints.prepared import PreparedTemplate

MAX_PRINTS: Final = 1 << 16  # that 16 bits can number
MAX_POSTINGS: Final = 1 << 31
TABLE: Final = 4096 * 64  # words of the kernel's table
_NUMBER_BITS: Final = 16
_POSE: Final = 0xFFFF
_TERM: Final = np.arange(TERMS, dtype=np.uint16)
SIZE_OFFSET: Final = 4
"""Added to the minutiae of a print, by whose square root its votes are divided."""
SIZE_SCALE: Final = 2048
_SIZES: Final = np.arange(256)
_FACTOR: Final = np.rint(SIZE_SCALE / np.sqrt(_SIZES + SIZE_OFFSET)).astype(np.uint16)

# dimensions: one entry a print; one a term, and one more; one an edge of all prints
PRINT: Final = "print"
POSTING: Final = "posting"


def _of(dtype: str, what: str | int) -> dict[str, Column]:
    return {"column": Column(dtype, (what,))}


@dataclass(frozen=True, eq=False)
class Segment:
    """The index of up to 65,536 prints.

    Prints are in the order of their entries' numbers. The postings of term t are those from
    ``term_start[t]`` to ``term_start[t + 1]``, in the order of the prints: the print's number
    within the segment in the upper 16 bits, the pose in the lower ones.
    """

    number: NDArray[np.int64] = field(metadata=_of("<i8", PRINT))  # of the entry, ascending
    finger: NDArray[np.int64] = field(metadata=_of("<i8", PRINT))  # the least number of a finger
    size: NDArray[np.uint8] = field(metadata=_of("|u1", PRINT))  # minutiae, 255 at most
    term_start: NDArray[np.uint32] = field(metadata=_of("<u4", TERMS + 1))
    posting: NDArray[np.uint32] = field(metadata=_of("<u4", POSTING))
    embedding: NDArray[np.int8] = field(metadata={"column": Column("|i1", (PRINT, LENGTH))})

    @classmethod
    def build(
        cls,
        numbers: NDArray[np.int64],
        fingers: NDArray[np.int64],
        prints: Iterable[PreparedTemplate],
    ) -> Segment:
        """Return the segment of prints with these numbers, ascending, of their entries.

        Raises MatcherError if there are more than 65,536 prints, or another number of them than of
        numbers, or these do not ascend.
        """
        numbers, fingers = np.array(numbers, np.int64), np.array(fingers, np.int64)
        sizes: list[int] = []
        terms: list[NDArray[np.uint16]] = []
        poses: list[NDArray[np.uint16]] = []
        given = list(prints)
        for print_ in given:
            term, pose = print_terms(print_)
            sizes.append(min(len(print_), len(_SIZES) - 1))
            terms.append(term)
            poses.append(pose)
        if not len(numbers) == len(fingers) == len(sizes) <= MAX_PRINTS:
            raise MatcherError(
                f"{len(numbers)} numbers of {len(sizes)} prints; a segment has up to {MAX_PRINTS}"
            )
        if (np.diff(numbers) <= 0).any():
            raise MatcherError("the numbers of a segment's prints do not ascend")
        of = np.repeat(np.arange(len(terms), dtype=np.uint32), [len(t) for t in terms])
        posting = of << np.uint32(_NUMBER_BITS) | np.concatenate([*poses, np.empty(0, np.uint16)])
        lists = _by_term(terms, [posting])
        return cls(numbers, fingers, np.array(sizes, np.uint8), *lists, embeddings(given))

    @classmethod
    def concatenate(cls, parts: Sequence[Segment]) -> Segment:
        """Return the segment of the prints of all `parts`, whose numbers ascend.

        Raises MatcherError if there are more than 65,536 prints.
        """
        first = np.cumsum([0, *map(len, parts)])
        if first[-1] > MAX_PRINTS:
            raise MatcherError(f"{first[-1]} prints; a segment has up to {MAX_PRINTS}")
        term = [np.repeat(_TERM, np.diff(part.term_start)) for part in parts]
        moved = [
            part.posting + np.uint32(k << _NUMBER_BITS)
            for part, k in zip(parts, first.tolist(), strict=False)
        ]
        number, finger, size = (
            np.concatenate([*(getattr(part, name) for part in parts), np.empty(0, dtype)])
            for name, dtype in (("number", np.int64), ("finger", np.int64), ("size", np.uint8))
        )
        none = np.empty((0, LENGTH), np.int8)
        embedding = np.concatenate([*(part.embedding for part in parts), none])
        return cls(number, finger, size, *_by_term(term, moved), embedding)

    def take(self, which: NDArray[np.integer]) -> Segment:
        """Return a copy of the prints with the places `which`, ascending."""
        place = np.zeros(len(self), np.uint32)
        place[which] = np.arange(len(which))
        left = np.zeros(len(self), bool)
        left[which] = True
        kept = left[self.posting >> np.uint32(_NUMBER_BITS)]
        start = np.append(np.uint32(0), np.cumsum(kept, dtype=np.uint32))[self.term_start]
        posting = self.posting[kept]
        now = place[posting >> np.uint32(_NUMBER_BITS)]
        posting = now << np.uint32(_NUMBER_BITS) | posting & np.uint32(_POSE)
        own = self.number[which], self.finger[which], self.size[which]
        return Segment(*own, start, posting, self.embedding[which])

    def __len__(self) -> int:
        return len(self.number)

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        return sum(array.nbytes for array in self.arrays().values())

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> Segment:
        """Return the segment of the arrays, among others, that are those of `COLUMNS`.

        Raises MatcherError if a number would lead out of an array, or of what `build` makes.
        """
        if not _is_sound(arrays):
            raise MatcherError("damaged", code="damaged")
        return cls(**{name: arrays[name] for name in COLUMNS})

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the arrays by name."""
        return {name: getattr(self, name) for name in COLUMNS}

    @cached_property
    def unknown_curvatures(self) -> int:
        """Number of postings of edges across which the curvature is not known."""
        return int(np.diff(self.term_start.astype(np.int64))[CURVATURES - 1 :: CURVATURES].sum())

    @cached_property
    def _factor(self) -> NDArray[np.uint16]:
        return _FACTOR[self.size]

    def votes(self, probe: ProbeTerms) -> NDArray[np.uint16]:
        """Return how much of a probe's terms each print has in one place and rotation, (N,).

        Votes are divided by the square root of the print's size; the similarity of the embeddings
        is added to them.
        """
        counted = np.zeros(len(self), np.uint16)
        cursor = np.empty(len(probe.term), np.uint32)
        table = np.empty(TABLE, np.uint32)
        p = probe
        looked_up = p.term, p.weight, p.reading, p.shift
        count_votes(self.term_start, self.posting, *looked_up, self._factor, cursor, table, counted)
        add_similarity(self.embedding, p.embedding, counted)
        return counted


COLUMNS: Final[dict[str, Column]] = {f.name: f.metadata["column"] for f in fields(Segment)}


def _by_term(
    terms: Sequence[NDArray[np.uint16]], postings: Sequence[NDArray[np.uint32]]
) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """Return where the postings of each term begin, and all in the order of the terms."""
    term = np.concatenate([*terms, np.empty(0, np.uint16)])
    start = np.zeros(TERMS + 1, np.uint32)
    np.cumsum(np.bincount(term, minlength=TERMS), out=start[1:])
    order = np.argsort(term, kind="stable")
    return start, np.concatenate([*postings, np.empty(0, np.uint32)])[order]


def _is_sound(arrays: Mapping[str, NDArray[Any]]) -> bool:
    """Return whether every number in the arrays of a segment leads to where there is something."""
    number, start, posting = (arrays[name] for name in ("number", "term_start", "posting"))
    prints = len(number)
    if {len(arrays[name]) for name in ("finger", "size", "embedding")} != {prints}:
        return False
    if prints > MAX_PRINTS:
        return False
    if len(start) != TERMS + 1 or start[0] or start[-1] != len(posting):
        return False
    if len(posting) >= MAX_POSTINGS or (start[1:] < start[:-1]).any():
        return False
    return bool(
        (number[1:] > number[:-1]).all()
        and (arrays["finger"] <= number).all()
        and lists_ascend(start, posting, prints)
    )
