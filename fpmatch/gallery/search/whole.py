"""Search of prints that are prepared in memory: all are compared."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.gallery.index.prints.compare import packs, similarities
from fpmatch.gallery.index.prints.prepared_prints import PreparedPrints
from fpmatch.gallery.search.search import Compared, Search
from fpmatch.gallery.store.stored_template import pack_template, unpack_template
from fpmatch.matching.result import call_matcher, check_repeats, compare_prepared, named

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.engine.in_threads import Threads
    from fpmatch.gallery.search.search import SearchOptions, Subjects
    from fpmatch.matching.result import Matcher
    from fpmatch.templates.minutiae import Template

ENTRY: Final = "entry "  # before its number, in errors
COMPARED_AT_ONCE: Final = 128  # prints that one thread compares before it takes others


class WholeSearch(Search):
    """Search of prepared prints, packed where the matcher can pack them.

    `state` is that of the gallery that they are from.
    """

    def __init__(
        self,
        matcher: Matcher,
        numbers: Sequence[int],
        prints: Sequence[Any],
        subjects: Subjects,
        damaged: Mapping[int, str] | None = None,
        before: WholeSearch | None = None,
    ) -> None:
        """Take prints of ascending numbers, which follow those of the search `before`, if any."""
        self.matcher, self.subjects, self.damaged = matcher, subjects, damaged or {}
        given = np.array(numbers, np.int64)
        made: Any = PreparedPrints.pack(prints) if packs(matcher) else list(prints)
        if before is not None:
            given = np.concatenate([before.numbers, given])
            known: Any = before.prints
            made = (
                PreparedPrints.concatenate([known, made])
                if isinstance(known, PreparedPrints)
                else [*known, *made]
            )
        self.numbers = given
        self.prints: Any = made

    @classmethod
    def of(cls, templates: Sequence[Template], matcher: Matcher) -> WholeSearch:
        """Return a search of templates as a gallery stores them, numbered from 1.

        Each is of a subject of its own. Raises TemplateError if one cannot be stored.
        """
        return cls(matcher, [], [], Unlabelled(0)).with_prints(templates)

    def with_prints(self, templates: Sequence[Template]) -> WholeSearch:
        """Return a search of some templates, too, whose numbers follow those of the others."""
        first = int(self.numbers[-1]) + 1 if len(self) else 1
        numbers = range(first, first + len(templates))
        stored = [unpack_template(pack_template(one)) for one in templates]
        prints = [call_matcher(self.matcher, "prepare", one) for one in stored]
        subjects = Unlabelled(len(self) + len(prints))
        return WholeSearch(self.matcher, numbers, prints, subjects, self.damaged, self)

    def take(self, places: NDArray[np.intp]) -> WholeSearch:
        """Return the search of some of the prints, by their places, ascending."""
        kept = WholeSearch(self.matcher, [], [], self.subjects, self.damaged)
        kept.numbers, prints = self.numbers[places], self.prints
        if isinstance(prints, PreparedPrints):
            kept.prints = prints.take(places)
        else:
            kept.prints = [prints[k] for k in places.tolist()]
        return kept

    def compare(self, probe: Any, options: SearchOptions, threads: Threads) -> Compared:
        """Compare a probe with all prints."""
        if not isinstance(self.prints, PreparedPrints):
            return Compared(self.numbers, self._one_by_one(probe, range(len(self))))
        spans = range(0, len(self), COMPARED_AT_ONCE)
        some = partial(_similarities, self.matcher, probe)
        parts = threads.map(some, self.prints, spans)
        return Compared(self.numbers, np.concatenate([np.empty(0), *parts]))

    def compare_some(self, probe: Any, numbers: NDArray[np.int64], threads: Threads) -> Compared:
        """Compare a probe with the prints of some entries; those that are gone are left out."""
        places = np.flatnonzero(np.isin(self.numbers, numbers))
        if isinstance(self.prints, PreparedPrints):
            similar = similarities(self.matcher, probe, self.prints.take(places))
        else:
            similar = self._one_by_one(probe, places.tolist())
        return Compared(self.numbers[places], similar)

    def print_of(self, number: int) -> Any:
        """Return a print as the matcher prepares it; None where it is gone."""
        places = np.flatnonzero(self.numbers == number).tolist()
        return self.prints[places[0]] if places else None

    def _one_by_one(self, probe: Any, places: Sequence[int]) -> NDArray[np.float64]:
        """Return the similarities of a probe to prints that are not packed."""
        similarity, k = np.zeros(len(places)), 0
        try:
            for place, k in enumerate(places):
                similarity[place] = compare_prepared(self.matcher, probe, self.prints[k]).similarity
            if len(places):
                check_repeats(self.matcher, probe, self.prints[k], similarity[-1])
        except MatcherError as error:
            raise named(error, f"{ENTRY}{self.numbers[k]}") from error
        return similarity


class Unlabelled:
    """Prints each of which is of a subject of its own."""

    def __init__(self, prints: int) -> None:
        self._prints = prints

    def __len__(self) -> int:
        return self._prints

    def fingers(self) -> int:
        """Return how many fingers there are."""
        return self._prints

    def fingers_of(self, numbers: Sequence[int]) -> dict[str, dict[str, list[int]]]:
        """Return the subjects of the entries of some numbers; see `Subjects`."""
        return {str(number): {"": [number]} for number in numbers}


def _similarities(
    matcher: Matcher, probe: Any, prints: PreparedPrints, first: int
) -> NDArray[np.float64]:
    return similarities(matcher, probe, prints, first, first + COMPARED_AT_ONCE)
