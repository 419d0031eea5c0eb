"""The prints of a gallery, prepared for comparison with probes, and what a search finds."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.matching.prints.candidate_list import candidate_list
from fpmatch.matching.prints.prepared_prints import PreparedPrints
from fpmatch.templates.stored_template import pack_template, unpack_template

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.store.reader import GalleryReader
    from fpmatch.matching.result import Comparison, Matcher
    from fpmatch.templates.minutiae import Template

    Each = Callable[..., Iterable[Any]]

CandidateListSize = int | Literal["auto", "off"]
"""Number of prints that are compared with a probe; see `fpmatch.gallery.identify`."""

EXHAUSTIVE_UP_TO: Final = 20_000  # prints, which are all compared by default
LISTED_UP_TO: Final = 100_000  # prints, of which a candidate list is compared by default
COMPARED_AT_ONCE: Final = 128  # prints that one thread compares before it takes others


@dataclass(frozen=True, slots=True)
class Candidate:
    """One enrolled finger, or impression, that may be the probe's; rank 1 scores highest.

    `number` is that of the entry; of a finger, that of its most similar impression, to which
    `similarity`, `comparison` (if requested) and `impression_score` belong. `fmr` is the rate at
    which comparisons with another finger, of as many `impressions`, score as high, and `score` is
    ``-10·log10(fmr)``, 0 to 100; see `fpmatch.fingers.finger`. `expected_false` is `fmr` times the
    number of searched fingers (or impressions): how many score as high if none is the probe's.
    """

    rank: int
    number: int
    similarity: float
    score: float
    fmr: float
    expected_false: float
    comparison: Comparison | None = None
    impressions: int = 1
    impression_score: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Preselection:
    """The places of the prints to compare, ascending, and how many each stage passed on.

    At most the share `loss` of the mates that comparing all would find is expected to be missing.
    """

    places: NDArray[np.intp]
    passed_on: tuple[int, ...]
    loss: float


@dataclass(frozen=True, eq=False)
class Search:
    """The prints of a gallery, prepared for a matcher.

    Where its methods take `each`, which is as the built-in `map`, it calls a function for each part
    of the prints.

    For each print, `numbers` holds the number of its entry, `fingers` the lowest number of an entry
    of its finger, and `references` the prepared template. `damaged` are the entries that could not
    be read, with reasons; they are not among the prints.
    """

    matcher: Matcher
    numbers: NDArray[np.int64]
    fingers: NDArray[np.int64]
    references: Sequence[Any] | PreparedPrints
    damaged: Mapping[int, str] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.numbers)

    @cached_property
    def _by_finger(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """The places of the prints by finger, and where each finger begins there."""
        order = np.argsort(self.fingers, kind="stable")
        begins = np.diff(self.fingers[order], prepend=-1) != 0
        return order, np.flatnonzero(begins)

    @cached_property
    def _grouped(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        order, starts = self._by_finger
        sizes = np.diff(starts, append=len(order))
        finger = np.empty(len(order), np.intp)
        finger[order] = np.repeat(np.arange(len(starts)), sizes)
        return finger, sizes

    @property
    def finger_of(self) -> NDArray[np.intp]:
        """The finger of each print, numbered from 0."""
        return self._grouped[0]

    @property
    def finger_sizes(self) -> NDArray[np.intp]:
        """The number of prints of each of these fingers."""
        return self._grouped[1]

    @property
    def whole(self) -> Search:
        """The search of the prints that are prepared from their whole templates."""
        return self

    def current(self, gallery: GalleryReader) -> Search:
        """Return the search of the open gallery as it is now, if this one follows it."""
        return self

    def preselect(
        self,
        probe: Any,
        loss: float,
        count: int,
        threshold: float = 0.0,
        each: Each = map,
    ) -> Preselection | None:
        """Return the prints to compare with a probe, chosen in stages; None if there are none."""
        return None

    def further_impressions(
        self,
        places: NDArray[np.intp],
        similarities: NDArray[np.float64],
        count: int,
    ) -> NDArray[np.intp]:
        """Return the places of the prints to compare beside those that were preselected."""
        return np.empty(0, np.intp)

    def places_of(self, numbers: Collection[int]) -> NDArray[np.intp]:
        """Return the places of the prints of some entries, ascending; others are left out."""
        if not numbers:
            return np.empty(0, np.intp)
        wanted = np.unique(np.array([*numbers], np.int64))
        places = np.searchsorted(self.numbers, wanted)
        enrolled: NDArray[np.intp] = places[np.append(self.numbers, -1)[places] == wanted]
        return enrolled

    def with_prints(self, templates: Sequence[Template]) -> Search:
        """Return a search of some templates, too, as a gallery stores them.

        Each is of a finger of its own; their numbers follow those of the others. Raises
        TemplateError if one cannot be stored.
        """
        stored = [self.matcher.prepare(unpack_template(pack_template(one))) for one in templates]
        numbers = np.arange(len(stored)) + (int(self.numbers[-1]) + 1 if len(self) else 0)
        known: Any = self.references
        return Search(
            self.matcher,
            np.concatenate([self.numbers, numbers]),
            np.concatenate([self.fingers, numbers]),
            PreparedPrints.concatenate([known, PreparedPrints.pack(stored)])
            if isinstance(known, PreparedPrints)
            else [*known, *stored],
            self.damaged,
        )

    @property
    def has_bit_descriptors(self) -> bool:
        """Whether candidate lists can be made: the matcher's prints have bit descriptors."""
        return isinstance(self.references, PreparedPrints)

    def candidate_list(self, probe: Any, count: int, each: Each = map) -> NDArray[np.intp]:
        """Return the ascending indices of the `count` prints with the most similar descriptors.

        Raises MatcherError if the matcher's prints have none.
        """
        if not isinstance(self.references, PreparedPrints):
            raise MatcherError(f"the matcher {self.matcher.name} supports no candidate list")
        return candidate_list(probe, self.references, count, each)

    def similarities(
        self, probe: Any, which: NDArray[np.intp] | None = None, each: Each = map
    ) -> NDArray[np.float64]:
        """Return the similarity of a prepared probe to each print, or to those of `which`."""
        references = self.references
        if hasattr(self.matcher, "similarities") and isinstance(references, PreparedPrints):
            compare = self.matcher.similarities
            if which is None:
                firsts = range(0, len(self), COMPARED_AT_ONCE)
                ends = [(k, min(k + COMPARED_AT_ONCE, len(self))) for k in firsts]
                compared = each(lambda span: compare(probe, references, *span), ends)
            else:
                parts = parts_of(which, COMPARED_AT_ONCE)
                compared = each(lambda part: compare(probe, references.take(part)), parts)
            return np.concatenate([np.zeros(0), *compared])
        places = range(len(self)) if which is None else which.tolist()
        return np.array([self.matcher.compare(probe, references[k]).similarity for k in places])


def parts_of(which: NDArray[np.intp], size: int) -> list[NDArray[np.intp]]:
    """Return numbers of prints in parts of a size; the last may be smaller."""
    return [which[first : first + size] for first in range(0, len(which), size)]
