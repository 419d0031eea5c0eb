"""A segment of an index: what a search needs of some prints, in flat arrays.

These are inverted lists, embeddings and bit descriptors. Once made, a segment is not changed. Its
arrays may be mapped from a file (see `fpmatch.gallery.store.array_file`), which is a cache: it can
be made again from the templates.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.gallery.index.descriptors import NEIGHBOURS, PLACES, StoredDescriptors
from fpmatch.gallery.index.embedding import LENGTH, NETWORK_SHA256, embeddings
from fpmatch.gallery.index.model import CURVATURES, TERMS, index_model
from fpmatch.gallery.index.prints.prepared_prints import PRINT
from fpmatch.gallery.store.array_file import Column
from fpmatch.matching.compiled import COMPILED
from fpmatch.matching.parameters import USUAL

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.index.terms import ProbeTerms
    from fpmatch.matching.prints.prepared import PreparedTemplate

if COMPILED:  # where it is not, removed prints are erased from an index that others use
    from fpmatch.gallery.index._vote_kernel import add_similarity, count_votes
    from fpmatch.gallery.index.terms import print_terms

MOST_PRINTS: Final = 4096
"""Prints of a segment of a gallery: a removal writes the whole segment anew."""
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
_DAMAGED: Final = MatcherError("damaged", code="damaged")


def _of(dtype: str, *shape: str | int) -> dict[str, Column]:
    return {"column": Column(dtype, shape)}


@dataclass(frozen=True, eq=False)
class Segment:
    """The index of up to 65,536 prints.

    The postings of term t are those from
    ``term_start[t]`` to ``term_start[t + 1]``, in the order of the prints: the print's number
    within the segment in the upper 16 bits, the pose in the lower ones.
    """

    number: NDArray[np.int64] = field(metadata=_of("<i8", PRINT))  # of the entry
    digest: NDArray[np.int64] = field(metadata=_of("<i8", PRINT))  # of the entry
    size: NDArray[np.uint8] = field(metadata=_of("|u1", PRINT))  # minutiae, 255 at most
    term_start: NDArray[np.uint32] = field(metadata=_of("<u4", TERMS + 1))
    posting: NDArray[np.uint32] = field(metadata=_of("<u4", "posting"))
    embedding: NDArray[np.int8] = field(metadata=_of("|i1", PRINT, LENGTH))
    descriptors: StoredDescriptors

    @classmethod
    def build(
        cls, numbers: Sequence[int], digests: Sequence[int], prints: Sequence[PreparedTemplate]
    ) -> Segment:
        """Return the segment of at most 65,536 prints with numbers and digests of their entries."""
        given = np.array(numbers, np.int64)
        edges = [print_terms(print_) for print_ in prints]
        of = np.repeat(np.arange(len(edges), dtype=np.uint32), [len(term) for term, _ in edges])
        pose = np.concatenate([*(pose for _, pose in edges), np.empty(0, np.uint16)])
        lists = _by_term([term for term, _ in edges], [of << np.uint32(_NUMBER_BITS) | pose])
        sizes = np.minimum([len(print_) for print_ in prints], len(_SIZES) - 1).astype(np.uint8)
        own = given, np.array(digests, np.int64), sizes
        return cls(*own, *lists, embeddings(prints), StoredDescriptors.pack(prints))

    @classmethod
    def concatenate(cls, parts: Sequence[Segment]) -> Segment:
        """Return the segment of the prints of all `parts`, one at least."""
        first = np.cumsum([0, *map(len, parts)])
        term = [np.repeat(_TERM, np.diff(part.term_start)) for part in parts]
        moved = [
            part.posting + np.uint32(k << _NUMBER_BITS)
            for part, k in zip(parts, first.tolist(), strict=False)
        ]
        number, digest, size, embedding = (
            np.concatenate([getattr(part, name) for part in parts])
            for name in ("number", "digest", "size", "embedding")
        )
        descriptors = StoredDescriptors.concatenate([part.descriptors for part in parts])
        return cls(number, digest, size, *_by_term(term, moved), embedding, descriptors)

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
        own = self.number[which], self.digest[which], self.size[which]
        return Segment(*own, start, posting, self.embedding[which], self.descriptors.take(which))

    def __len__(self) -> int:
        return len(self.number)

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> Segment:
        """Return the segment of the arrays of a file.

        Raises MatcherError if a number would lead out of an array, or of what `build` makes.
        """
        if not _is_sound(arrays):
            raise _DAMAGED
        own = {name: arrays[name] for name in OWN_COLUMNS}
        return cls(**own, descriptors=StoredDescriptors.of_arrays(arrays))

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the arrays by name."""
        return {name: getattr(self, name) for name in OWN_COLUMNS} | self.descriptors.arrays()

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


OWN_COLUMNS: Final[dict[str, Column]] = {
    f.name: f.metadata["column"] for f in fields(Segment) if f.metadata
}
COLUMNS: Final = OWN_COLUMNS | StoredDescriptors.columns()
"""The arrays of a file."""


def parameters() -> str:
    """Return the parameters on which the contents of the arrays depend."""
    words = f"{NEIGHBOURS} and {len(PLACES)} words"
    return f"{USUAL!r}; {TERMS} terms; {words}; network {NETWORK_SHA256[:16]}"


def unoriented_share(segments: Sequence[Segment]) -> float:
    """Return about which share of the prints have no ridge orientation, in quarters.

    Where they have one, it is still not known across some edges at the border of the print.
    """
    postings = sum(len(segment.posting) for segment in segments)
    unknown = sum(segment.unknown_curvatures for segment in segments) / max(postings, 1)
    expected = float(index_model().directions[..., -1].sum())
    share = (unknown - expected) / (1.0 - expected) if expected < 1.0 else 0.0
    return round(4 * max(share, 0.0)) / 4


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
    start, posting, prints = arrays["term_start"], arrays["posting"], len(arrays["number"])
    if {len(arrays[name]) for name in ("digest", "size", "embedding", "has_flow")} != {prints}:
        return False
    if not 0 < prints <= MAX_PRINTS:
        return False
    if len(start) != TERMS + 1 or start[0] or start[-1] != len(posting):
        return False
    if len(posting) >= MAX_POSTINGS or (start[1:] < start[:-1]).any():
        return False
    print_ = posting >> np.uint32(_NUMBER_BITS)
    begins = np.flatnonzero(print_[1:] < print_[:-1]) + 1  # where another list begins
    return bool((print_ < prints).all() and np.isin(begins, start).all())
