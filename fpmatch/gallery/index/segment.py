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
from fpmatch.gallery.index.embedding import LENGTH, NETWORK_SHA256, embeddings
from fpmatch.gallery.index.terms import CURVATURES, TERMS, index_model, print_terms
from fpmatch.gallery.store.array_file import Column
from fpmatch.matching.constants import COMPILED, NEIGHBOUR_WORDS, ORIENTATION_WORDS, UNKNOWN_BIN
from fpmatch.matching.parameters import USUAL

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.index.terms import ProbeTerms
    from fpmatch.matching.prints.prepared import BitDescriptors, PreparedTemplate

if COMPILED:  # where it is not, removed prints are erased from an index that others use
    from fpmatch.gallery.index._segment_kernel import compare_embeddings, count_votes, score_prints
    from fpmatch.matching.prints.prepare import prefilter_of

MOST_PRINTS: Final = 4096
"""Prints of a segment: a removal writes the whole segment anew."""
MAX_MINUTIAE: Final = 256  # of a print
WORDS_OF_A_PRINT: Final = 64  # of the kernel's table
SIZE_OFFSET: Final = 4
"""Added to the minutiae of a print, by whose square root its votes are divided."""
SIZE_SCALE: Final = 2048
NO_WORD: Final = 0x8800  # bits of a word of a bit descriptor that counts in neither grid
NEIGHBOURS: Final = 6  # of a minutia, of twelve: with these alone no more mates are lost
PLACES: Final = np.array([0, 1, 2, 3, 5, 7, 9, 11], np.int32)  # of ridge orientation, likewise
# dimensions of arrays: one entry a print; one a minutia that has a word, of all prints
PRINT: Final = "print"
MINUTIA: Final = "minutia"
_NUMBER_BITS: Final = np.uint32(16)
_POSE: Final = np.uint32(0xFFFF)
_TERM: Final = np.arange(TERMS, dtype=np.uint16)
_SIZES: Final = np.arange(256)
_FACTOR: Final = np.rint(SIZE_SCALE / np.sqrt(_SIZES + SIZE_OFFSET)).astype(np.uint16)
_SHORT: Final = np.iinfo(np.int16)


def _of(dtype: str, *shape: str | int) -> dict[str, Column]:
    return {"column": Column(dtype, shape)}


@dataclass(frozen=True, eq=False)
class Segment:
    """The index of up to 4,096 prints, with numbers and digests of their entries.

    The postings of term t are those from ``term_start[t]`` to ``term_start[t + 1]``, in the order
    of the prints: the print's number within the segment in the upper 16 bits, the pose in the lower
    ones. Bit descriptors are of minutiae that have a neighbour, so many `described` of each print:
    the words of the first neighbours and of some places of ridge orientation. Positions are rounded
    to whole pixels at 500 dpi, y pointing up, as galleries contain them. Where `has_flow` is 0, the
    orientation is not known.
    """

    number: NDArray[np.int64] = field(metadata=_of("<i8", PRINT))
    digest: NDArray[np.int64] = field(metadata=_of("<i8", PRINT))
    size: NDArray[np.uint8] = field(metadata=_of("|u1", PRINT))  # minutiae, 255 at most
    embedding: NDArray[np.int8] = field(metadata=_of("|i1", PRINT, LENGTH))
    described: NDArray[np.uint16] = field(metadata=_of("<u2", PRINT))
    has_flow: NDArray[np.uint8] = field(metadata=_of("|u1", PRINT))
    xy: NDArray[np.int16] = field(metadata=_of("<i2", MINUTIA, 2))
    direction_bin: NDArray[np.uint8] = field(metadata=_of("|u1", MINUTIA))
    neighbour_bits: NDArray[np.uint16] = field(metadata=_of("<u2", MINUTIA, NEIGHBOURS))
    orientation_bins: NDArray[np.uint8] = field(metadata=_of("|u1", MINUTIA, len(PLACES)))
    term_start: NDArray[np.uint32] = field(metadata=_of("<u4", TERMS + 1))
    posting: NDArray[np.uint32] = field(metadata=_of("<u4", "posting"))

    @classmethod
    def build(
        cls, numbers: Sequence[int], digests: Sequence[int], prints: Sequence[PreparedTemplate]
    ) -> Segment:
        """Return the segment of prints with numbers and digests of their entries."""
        edges = [print_terms(print_) for print_ in prints]
        of = np.repeat(np.arange(len(edges), dtype=np.uint32), [len(term) for term, _ in edges])
        pose = np.concatenate([np.empty(0, np.uint16), *(pose for _, pose in edges)])
        term = np.concatenate([np.empty(0, np.uint16), *(term for term, _ in edges)])
        bits = [print_.bit_descriptors for print_ in prints]
        described = [_described(one) for one in bits]
        xy, direction_bin, neighbour_bits, orientation_bins = (
            np.concatenate([empty, *parts])
            for empty, *parts in zip(_NO_WORDS, *described, strict=True)
        )
        return cls(
            number=np.array(numbers, np.int64),
            digest=np.array(digests, np.int64),
            size=np.minimum([len(one) for one in prints], len(_SIZES) - 1).astype(np.uint8),
            embedding=embeddings(prints),
            described=np.array([len(one[0]) for one in described], np.uint16),
            has_flow=np.array([one.has_flow for one in bits], np.uint8),
            xy=xy,
            direction_bin=direction_bin,
            neighbour_bits=neighbour_bits,
            orientation_bins=orientation_bins,
            **_lists(term, of << _NUMBER_BITS | pose),
        )

    @classmethod
    def joined(cls, parts: Sequence[tuple[Segment, NDArray[np.bool_]]]) -> Segment:
        """Return a segment of those prints of others, one at least, that are kept, (N,) of each."""
        arrays: dict[str, list[NDArray[Any]]] = {name: [] for name in COLUMNS}
        first = 0
        for segment, kept in parts:
            of = segment.posting >> _NUMBER_BITS
            place = (first + np.cumsum(kept) - 1).astype(np.uint32)[of] << _NUMBER_BITS
            chosen: dict[Any, NDArray[np.bool_]] = {
                PRINT: kept,
                MINUTIA: np.repeat(kept, segment.described),
                "posting": kept[of],
            }
            given = segment.arrays() | {
                "term_start": np.repeat(_TERM, np.diff(segment.term_start)),
                "posting": place | segment.posting & _POSE,
            }
            for name, column in COLUMNS.items():
                arrays[name].append(given[name][chosen[_LISTED.get(name, column.shape[0])]])
            first += int(np.count_nonzero(kept))
        whole = {name: np.concatenate(each) for name, each in arrays.items()}
        return cls(**whole | _lists(whole["term_start"], whole["posting"]))

    def __len__(self) -> int:
        return len(self.number)

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> Segment:
        """Return the segment of the arrays of a file.

        Raises MatcherError if a number would lead out of an array, or of what `build` makes.
        """
        if not _is_sound(arrays):
            raise MatcherError("damaged", code="damaged")
        return cls(**arrays)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the arrays by name."""
        return {name: getattr(self, name) for name in COLUMNS}

    @cached_property
    def unknown_curvatures(self) -> int:
        """Number of postings of edges across which the curvature is not known."""
        return int(np.diff(self.term_start.astype(np.int64))[CURVATURES - 1 :: CURVATURES].sum())

    @cached_property
    def _first_described(self) -> NDArray[np.int64]:
        return np.cumsum([0, *self.described.tolist()], dtype=np.int64)

    def votes(self, probe: ProbeTerms) -> NDArray[np.uint16]:
        """Return how much of a probe's terms each print has in one place and rotation, (2, N).

        Votes are divided by the square root of the print's size. Below them stands the similarity
        of the embeddings.
        """
        counted, similarity = both = np.zeros((2, len(self)), np.uint16)
        table = np.empty(len(self) * WORDS_OF_A_PRINT, np.uint32)
        looked_up = probe.term, probe.weight, probe.reading, probe.shift
        factor = _FACTOR[self.size]
        count_votes(self.term_start, self.posting, *looked_up, factor, table, counted)
        compare_embeddings(self.embedding, probe.embedding, similarity)
        return both

    def scores(self, probe: PreparedTemplate, which: NDArray[np.integer]) -> NDArray[np.int32]:
        """Return how much the bit descriptors of some prints have in common with a probe's."""
        scores = np.empty(len(which), np.int32)
        score_prints(
            prefilter_of(probe.bit_descriptors),
            self._first_described,
            self.xy,
            self.direction_bin,
            self.neighbour_bits,
            self.orientation_bins,
            self.has_flow,
            np.ascontiguousarray(which, np.int64),
            PLACES,
            np.empty((MAX_MINUTIAE, 2), np.float32),
            np.full((MAX_MINUTIAE, NEIGHBOUR_WORDS), NO_WORD, np.uint16),
            np.full((MAX_MINUTIAE, ORIENTATION_WORDS), UNKNOWN_BIN, np.uint8),
            scores,
        )
        return scores


COLUMNS: Final[dict[str, Column]] = {f.name: f.metadata["column"] for f in fields(Segment)}
"""The arrays of a file."""
_LISTED: Final = {"term_start": "posting"}  # its terms are taken as its postings are
_NO_WORDS: Final = [
    np.empty((0, *map(int, column.shape[1:])), column.dtype)
    for column in COLUMNS.values()
    if column.shape[0] == MINUTIA
]


def _described(bits: BitDescriptors) -> tuple[NDArray[Any], ...]:
    """Return what a segment keeps of bit descriptors: the arrays of a minutia."""
    neighbours = bits.neighbour_bits[:, :NEIGHBOURS]
    kept = ((neighbours & NO_WORD) != NO_WORD).any(axis=1)
    xy = np.clip(np.rint(bits.xy[kept]), _SHORT.min, _SHORT.max).astype(np.int16)
    return xy, bits.direction_bin[kept], neighbours[kept], bits.orientation_bins[kept][:, PLACES]


def _lists(term: NDArray[np.uint16], posting: NDArray[np.uint32]) -> dict[str, NDArray[Any]]:
    """Return where the postings of each term begin, and all in the order of the terms."""
    start = np.zeros(TERMS + 1, np.uint32)
    np.cumsum(np.bincount(term, minlength=TERMS), out=start[1:])
    return {"term_start": start, "posting": posting[np.argsort(term, kind="stable")]}


def _is_sound(arrays: Mapping[str, NDArray[Any]]) -> bool:
    """Return whether every number in the arrays of a segment leads to where there is something.

    Lengths of dimensions were compared when the file was read.
    """
    start, posting, prints = arrays["term_start"], arrays["posting"], len(arrays["number"])
    described = arrays["described"]
    return bool(
        0 < prints <= MOST_PRINTS
        and described.max() <= MAX_MINUTIAE
        and described.sum(dtype=np.int64) == len(arrays["xy"])
        and (arrays["orientation_bins"] <= UNKNOWN_BIN).all()
        and start[0] == 0
        and start[-1] == len(posting)
        and (start[1:] >= start[:-1]).all()
        and (posting >> _NUMBER_BITS < prints).all()
    )


def parameters() -> str:
    """Return the parameters on which the contents of the arrays depend."""
    words = f"{NEIGHBOURS} and {len(PLACES)} words"
    return f"form 2; {USUAL!r}; {TERMS} terms; {words}; network {NETWORK_SHA256[:16]}"


def unoriented_share(segments: Sequence[Segment]) -> float:
    """Return about which share of the prints have no ridge orientation, in quarters.

    Where they have one, it is still not known across some edges at the border of the print.
    """
    postings = sum(len(segment.posting) for segment in segments)
    unknown = sum(segment.unknown_curvatures for segment in segments) / max(postings, 1)
    expected = float(index_model().directions[..., -1].sum())
    share = (unknown - expected) / (1.0 - expected) if expected < 1.0 else 0.0
    return round(4 * max(share, 0.0)) / 4
