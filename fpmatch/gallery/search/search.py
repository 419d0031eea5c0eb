"""The prints of a gallery, prepared for comparison with probes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from fpmatch.errors import MatcherError, number_text
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.engine.in_threads import Threads
from fpmatch.gallery.index.loss import DEFAULT_LOSS
from fpmatch.gallery.index.prints.compare import packs
from fpmatch.gallery.search.stages import Listed, run_stages
from fpmatch.matching.calibration import MAX_SCORE, load_calibration

if TYPE_CHECKING:
    from collections.abc import Collection, Generator, Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.search.identification import Candidate, SubjectCandidate
    from fpmatch.gallery.search.stages import Division, Indices, Stage
    from fpmatch.gallery.store.reader import GalleryReader
    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Matcher
    from fpmatch.templates.minutiae import Template

ListedAs = Literal["subjects", "fingers", "impressions"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchOptions:
    """State what a search compares and lists.

    Parameters
    ----------
    count : int
        Largest number of candidates.
    threshold : float
        Smallest score of a candidate.
    by_chance : float
        Number of others that are expected to score as high by chance, under which a candidate is
        listed: of ``1 / by_chance`` searches without a mate, about one lists any.
    listed : "subjects", "fingers" or "impressions"
        What is a candidate: each subject once, by its best finger; each finger, by the score of its
        impressions together (see `fpmatch.gallery.fingers.finger`); or each impression.
    consolidate : bool
        Whether each candidate is compared also with the consolidated template of its impressions,
        and the candidates are ranked again; the same fingers are candidates.
    calibration : Calibration, optional
        Turns similarities into scores (default: that of the package).
    transforms : bool
        Whether candidates have their transforms, too.
    loss : float
        Share of the mates that comparing all prints would find, with a score of at least
        `threshold`, and that the index of more than `EXHAUSTIVE_UP_TO` prints may miss (see
        docs/explanation/searching.md); of 0, all prints are compared.
    all_mates : bool
        Whether to look for all mates where an index would end the search with a clear one.
    """

    count: int = 10
    threshold: float = 0.0
    by_chance: float = inf
    listed: ListedAs = "fingers"
    consolidate: bool = False
    calibration: Calibration | None = None
    transforms: bool = False
    loss: float = DEFAULT_LOSS
    all_mates: bool = False

    def checked(self, matcher: Matcher) -> SearchOptions:
        """Return the options of a search with a matcher, with its calibration.

        Raises MatcherError if some are out of range or exclude each other, or it has none.
        """
        if self.count < 1:
            raise MatcherError(f"the number of candidates must be at least 1, not {self.count}")
        if not 0 <= self.threshold <= MAX_SCORE:
            raise MatcherError(
                f"a threshold is between 0 and {MAX_SCORE:g}, not {number_text(self.threshold)}"
            )
        if not self.by_chance > 0:
            raise MatcherError(f"the number by chance is over 0, not {number_text(self.by_chance)}")
        if self.listed == "impressions" and self.consolidate:
            raise MatcherError("single impressions are not compared with consolidated templates")
        if not 0 <= self.loss < 1:
            raise MatcherError(f"a loss is from 0 to under 1, not {number_text(self.loss)}")
        return replace(self, calibration=self.calibration or load_calibration(matcher.name))

    def allow(self, candidate: Candidate | SubjectCandidate) -> bool:
        """Return whether a candidate is listed."""
        return candidate.score >= self.threshold and candidate.expected_false < self.by_chance

    @property
    def least_compared(self) -> float:
        """The score that a comparison must reach: the consolidated template may raise a lower."""
        return 0.0 if self.consolidate else self.threshold


USUAL: Final = SearchOptions()
MOST_WHOLE: Final = 10  # prints, or subjects, that an index has compared again by whole templates


class Search(ABC):
    """The prints of a gallery, prepared for a matcher, and the stages in which they are compared.

    `damaged` are the entries that could not be read, with reasons; they are not among the prints.
    A search `in_stages` is made for a loss.
    """

    matcher: Matcher
    damaged: Mapping[int, str]
    in_stages: bool = False

    @cached_property
    def numbers(self) -> NDArray[np.int64]:
        """The number of the entry of each print, ascending."""
        raise NotImplementedError

    @cached_property
    def fingers(self) -> NDArray[np.int64]:
        """The lowest number of an entry of the finger of each print."""
        raise NotImplementedError

    @abstractmethod
    def division(self, of_threads: bool) -> Division:
        """Return the pieces in which threads, or else workers, search."""

    @abstractmethod
    def stages(self, options: SearchOptions) -> list[Stage]:
        """Return the stages, of which the last but one, or the last, is a comparison."""

    @abstractmethod
    def comparison(self) -> Stage:
        """Return the stage that compares the prints that are listed."""

    @abstractmethod
    def print_at(self, place: int) -> Any:
        """Return a print, as the matcher prepares it."""

    @abstractmethod
    def with_prints(self, templates: Sequence[Template]) -> Search:
        """Return a search of some templates, too, as a gallery stores them.

        Each is of a finger of its own; their numbers follow those of the others. Raises
        TemplateError if one cannot be stored.
        """

    @abstractmethod
    def can_be_sent(self) -> bool:
        """Return whether other processes can get the prepared prints."""

    def current(self, gallery: GalleryReader) -> Search:
        """Return the search of the open gallery as it is now, if this one follows it."""
        return self

    def for_loss(self, loss: float) -> Search:
        """Return the search that loses so many mates: this, or one that compares all prints."""
        return self

    def __len__(self) -> int:
        return len(self.numbers)

    @cached_property
    def _by_finger(self) -> tuple[Indices, Indices]:
        """The places of the prints by finger, and where each finger begins there."""
        order = np.argsort(self.fingers, kind="stable")
        begins = np.diff(self.fingers[order], prepend=-1) != 0
        return order, np.flatnonzero(begins)

    @cached_property
    def finger_sizes(self) -> Indices:
        """The number of prints of each finger, numbered from 0."""
        order, starts = self._by_finger
        return np.diff(starts, append=len(order))

    @cached_property
    def finger_of(self) -> Indices:
        """The finger of each print."""
        order, starts = self._by_finger
        finger = np.empty(len(order), np.intp)
        finger[order] = np.repeat(np.arange(len(starts)), self.finger_sizes)
        return finger

    def impressions_of(self, fingers: Indices) -> Indices:
        """Return the places of all prints of some fingers."""
        (order, starts), sizes = self._by_finger, self.finger_sizes
        places = [order[starts[f] : starts[f] + sizes[f]] for f in fingers.tolist()]
        return np.concatenate([np.empty(0, np.intp), *places])

    def places_of(self, numbers: Collection[int]) -> Indices:
        """Return the places of the prints of some entries, ascending; others are left out."""
        if not numbers:
            return np.empty(0, np.intp)
        wanted = np.unique(np.array([*numbers], np.int64))
        places = np.searchsorted(self.numbers, wanted)
        enrolled: Indices = places[np.append(self.numbers, -1)[places] == wanted]
        return enrolled

    def compare(
        self, batches: Iterable[Sequence[Any]], options: SearchOptions, engine: Engine
    ) -> Generator[list[Listed], None, None]:
        """Yield which prints are compared with each probe of each batch, and how similar they are.

        Probes are prepared by the matcher, and batches drawn as they are needed. The threads or
        workers of the engine, which is entered, compare; where prints cannot be sent to workers,
        this process does. Raises EngineError if the engine broke down.
        """
        stages = self.stages(options)
        if not (isinstance(engine, Threads) or self.can_be_sent()):
            engine = serial()
        yield from run_stages(self.division, stages, batches, engine)

    def similarities(
        self, probe: Any, which: Indices, engine: Engine | None = None
    ) -> NDArray[np.float64]:
        """Return the similarity of a prepared probe to each of some prints, in ascending places."""
        stages, listed = [self.comparison()], Listed(places=which)
        ((after,),) = run_stages(self.division, stages, [[probe]], engine or Threads(1), listed)
        return after.similarities

    def whole_similarities(
        self, probe: Any, which: Indices, known: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the similarities of a probe to a few prints by the templates in the gallery.

        This search compares these anyway: the `known` similarities are returned.
        """
        return known

    def threads(self, workers: int | None) -> Threads:
        """Return so many threads (None: one a core); one, where the matcher compares in Python."""
        return Threads(workers if packs(self.matcher) else 1)
