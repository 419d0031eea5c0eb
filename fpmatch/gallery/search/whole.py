"""Search of prints that are prepared in memory: all are compared."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.gallery.index.compare import PreparedPrints, packs, similarities
from fpmatch.gallery.search.search import Search
from fpmatch.matching.result import check_repeats, compare_prepared, named

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.engine.in_threads import Threads
    from fpmatch.gallery.search.search import SearchOptions, Similarity, Subjects
    from fpmatch.matching.result import Matcher

ENTRY: Final = "entry "  # before its number, in errors
COMPARED_AT_ONCE: Final = 128  # prints that one thread compares before it takes others


class WholeSearch(Search):
    """Search of prepared prints, packed where the matcher can pack them.

    `state` is the state of their gallery, `digests` has the digest of each entry.
    """

    state = ""
    digests: NDArray[np.int64]

    def __init__(
        self,
        matcher: Matcher,
        numbers: Sequence[int],
        prints: Sequence[Any],
        subjects: Subjects,
        damaged: Mapping[int, str] | None = None,
    ) -> None:
        """Take prints of ascending numbers."""
        self.matcher, self.subjects, self.damaged = matcher, subjects, damaged or {}
        self.numbers = np.array(numbers, np.int64)
        self.prints: Any = PreparedPrints(prints) if packs(matcher) else list(prints)

    def after(self, before: WholeSearch, places: NDArray[np.intp]) -> WholeSearch:
        """Put prints of a search before, by their places, before these; return this search."""
        self.numbers = np.concatenate([before.numbers[places], self.numbers])
        if isinstance(self.prints, PreparedPrints):
            kept = [before.prints.prints[k] for k in places.tolist()]
            self.prints = PreparedPrints([*kept, *self.prints.prints])
        else:
            self.prints = [*(before.prints[k] for k in places.tolist()), *self.prints]
        return self

    def compare(
        self, probe: Any, options: SearchOptions, threads: Threads
    ) -> tuple[Similarity, tuple[int, ...]]:
        """Compare a probe with all prints."""
        return self._compared(probe, np.arange(len(self)), threads), ()

    def compare_some(self, probe: Any, numbers: Sequence[int], threads: Threads) -> Similarity:
        """Compare a probe with the prints of some entries; those that are gone are left out."""
        return self._compared(probe, np.flatnonzero(np.isin(self.numbers, numbers)), threads)

    def print_of(self, number: int) -> Any:
        """Return a print as the matcher prepares it; None where it is gone."""
        places = np.flatnonzero(self.numbers == number).tolist()
        prints = self.prints.prints if packs(self.matcher) else self.prints
        return prints[places[0]] if places else None

    def _compared(self, probe: Any, places: NDArray[np.intp], threads: Threads) -> Similarity:
        """Compare a probe with the prints at some places."""
        numbers = self.numbers[places].tolist()
        if isinstance(self.prints, PreparedPrints):
            prints = self.prints
            if len(places) < len(self):
                prints = PreparedPrints(prints.prints[k] for k in places.tolist())
            some = partial(_similarities, self.matcher, probe)
            parts = threads.map(some, prints, range(0, len(places), COMPARED_AT_ONCE))
            return dict(zip(numbers, np.concatenate([np.empty(0), *parts]).tolist(), strict=True))
        similarity: Similarity = {}
        number = 0
        try:
            for number, k in zip(numbers, places.tolist(), strict=True):
                compared = compare_prepared(self.matcher, probe, self.prints[k])
                similarity[number] = compared.similarity
            if numbers:
                check_repeats(self.matcher, probe, self.prints[k], similarity[number])
        except MatcherError as error:
            raise named(error, f"{ENTRY}{number}") from error
        return similarity


def _similarities(
    matcher: Matcher, probe: Any, prints: PreparedPrints, first: int
) -> NDArray[np.float64]:
    return similarities(matcher, probe, prints, first, first + COMPARED_AT_ONCE)
