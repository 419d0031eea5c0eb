"""Search of prints that are prepared from their whole templates: all are compared."""

from __future__ import annotations

import pickle
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.gallery.index.prints.compare import packs, similarities
from fpmatch.gallery.index.prints.prepared_prints import PreparedPrints
from fpmatch.gallery.search.search import Search
from fpmatch.gallery.search.stages import Division, Stage, add_compared
from fpmatch.gallery.store.stored_template import pack_template, unpack_template
from fpmatch.matching.result import check_repeats, compare_prepared, named, prepare_print

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.search.search import SearchOptions
    from fpmatch.gallery.search.stages import Places
    from fpmatch.matching.result import Matcher
    from fpmatch.templates.minutiae import Template

MIN_PIECE: Final = 512  # prints of a piece; fewer take less time than it takes to send probes
MAX_PIECE: Final = 4096
LEAST_PIECES: Final = 16  # into which a smaller gallery is divided
ENTRY: Final = "entry "  # before its number, in errors
COMPARED_AT_ONCE: Final = 128  # prints that one thread compares before it takes others


class WholePiece(NamedTuple):
    """Prepared prints of a search, mostly in the same memory."""

    matcher: Matcher
    prints: Sequence[Any] | PreparedPrints
    numbers: NDArray[np.int64]  # of their entries


class WholeSearch(Search):
    """Search of prepared prints, packed where the matcher can pack them."""

    numbers: NDArray[np.int64]
    fingers: NDArray[np.int64]

    def __init__(
        self,
        matcher: Matcher,
        numbers: NDArray[np.int64],
        fingers: NDArray[np.int64],
        prints: Sequence[Any] | PreparedPrints,
        damaged: Mapping[int, str] | None = None,
    ) -> None:
        self.matcher, self.numbers, self.fingers, self.prints = matcher, numbers, fingers, prints
        self.damaged = damaged or {}

    @classmethod
    def of(cls, templates: Sequence[Template], matcher: Matcher) -> WholeSearch:
        """Return a search of templates as a gallery stores them, numbered from 0.

        Each is of a finger of its own. Raises TemplateError if one cannot be stored.
        """
        none = np.empty(0, np.int64)
        packed = packs(matcher)
        return cls(matcher, none, none, PreparedPrints.pack([]) if packed else []).with_prints(
            templates
        )

    def division(self, of_threads: bool) -> Division:
        """Return the prints in parts of one size; of threads, which share them, in one part."""
        size, prints = piece_size(len(self)), self.prints
        if of_threads:
            shared = WholePiece(self.matcher, prints, self.numbers)
            return Division([shared], [len(self)], lambda places: (np.zeros_like(places), places))
        spans = list(pairwise([*range(0, len(self), size), len(self)]))
        if isinstance(prints, PreparedPrints):
            parts: list[Any] = [prints.part(*span) for span in spans]
        else:
            parts = [prints[first:last] for first, last in spans]
        return Division(
            [
                WholePiece(self.matcher, part, self.numbers[first:last])
                for part, (first, last) in zip(parts, spans, strict=True)
            ],
            [last - first for first, last in spans],
            lambda places: divmod(places, size),
        )

    def print_at(self, place: int) -> Any:
        """Return a print, as the matcher prepares it."""
        return self.prints[place]

    def stages(self, options: SearchOptions) -> list[Stage]:
        """Return the comparison of all prints."""
        return [self.comparison()]

    def comparison(self) -> Stage:
        """Return the stage that compares the prints that are listed."""
        packed = isinstance(self.prints, PreparedPrints)
        # else all in Python, of which one thread runs at a time
        at_once = COMPARED_AT_ONCE if packed else None
        return Stage(_similarities, add_compared, at_once)

    def can_be_sent(self) -> bool:
        """Return whether other processes can get the prepared prints."""
        if isinstance(self.prints, PreparedPrints):
            return True
        try:
            pickle.dumps((self.matcher, list(self.prints[:1])))
        except (AttributeError, TypeError, pickle.PicklingError):
            return False
        return True

    def with_prints(self, templates: Sequence[Template]) -> WholeSearch:
        """Return a search of some templates, too, as a gallery stores them."""
        kept = (unpack_template(pack_template(one)) for one in templates)
        stored = [prepare_print(self.matcher, one, None) for one in kept]
        numbers = np.arange(len(stored)) + (int(self.numbers[-1]) + 1 if len(self) else 0)
        known = self.prints
        return WholeSearch(
            self.matcher,
            np.concatenate([self.numbers, numbers]),
            np.concatenate([self.fingers, numbers]),
            PreparedPrints.concatenate([known, PreparedPrints.pack(stored)])
            if isinstance(known, PreparedPrints)
            else [*known, *stored],
            self.damaged,
        )


def piece_size(prints: int) -> int:
    """Return the number of prints of a piece of so many.

    Examples
    --------
    >>> piece_size(600), piece_size(20_000), piece_size(1_000_000)
    (512, 1250, 4096)
    """
    return max(MIN_PIECE, min(MAX_PIECE, -(-prints // LEAST_PIECES)))


def _similarities(piece: WholePiece, probe: Any, places: Places) -> NDArray[np.float64]:
    """Return the similarities of a probe to prints of a piece."""
    matcher, prints, _ = piece
    if not isinstance(prints, PreparedPrints):
        numbers = range(len(prints))[places] if isinstance(places, slice) else places.tolist()
        return _one_by_one(piece, probe, numbers)
    if isinstance(places, slice):
        return similarities(matcher, probe, prints, places.start, places.stop)
    parts = range(0, len(places), COMPARED_AT_ONCE)  # few copies at a time
    return np.concatenate(
        [similarities(matcher, probe, prints.take(places[k : k + COMPARED_AT_ONCE])) for k in parts]
    )


def _one_by_one(piece: WholePiece, probe: Any, numbers: Sequence[int]) -> NDArray[np.float64]:
    """Return the similarities of a probe to prints that are not packed."""
    similarity = np.zeros(len(numbers))
    k = 0
    try:
        for place, k in enumerate(numbers):
            similarity[place] = compare_prepared(piece.matcher, probe, piece.prints[k]).similarity
        if len(numbers):
            check_repeats(piece.matcher, probe, piece.prints[k], similarity[-1])
    except MatcherError as error:
        raise named(error, f"{ENTRY}{piece.numbers[k]}") from error
    return similarity
