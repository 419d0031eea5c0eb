"""The prints of a gallery, prepared for comparison with probes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf
from typing import TYPE_CHECKING, Any, Final, Literal, Protocol

from fpmatch.errors import MatcherError, number_text
from fpmatch.matching.calibration import MAX_SCORE, load_calibration

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from concurrent.futures import Executor

    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.gallery.search.identification import Candidate, SubjectCandidate
    from fpmatch.gallery.store.gallery import Gallery
    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Matcher

ListedAs = Literal["subjects", "fingers", "impressions"]
EFFORTS: Final = (1, 2, 4)


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
    calibration : Calibration, optional
        Turns similarities into scores (default: that of the package).
    transforms : bool
        Whether candidates have their transforms, too.
    effort : int
        1, 2 or 4: how many prints of a large gallery are compared, and so how few mates are lost
        (see docs/explanation/searching.md).
    """

    count: int = 10
    threshold: float = 0.0
    by_chance: float = inf
    listed: ListedAs = "fingers"
    calibration: Calibration | None = None
    transforms: bool = False
    effort: int = 1

    def checked(self, matcher: Matcher) -> SearchOptions:
        """Return the options of a search with a matcher, with its calibration.

        Raises MatcherError if some are out of range, or it has none.
        """
        if self.count < 1:
            raise MatcherError(f"the number of candidates must be at least 1, not {self.count}")
        if not 0 <= self.threshold <= MAX_SCORE:
            raise MatcherError(
                f"a threshold is between 0 and {MAX_SCORE:g}, not {number_text(self.threshold)}"
            )
        if not self.by_chance > 0:
            raise MatcherError(f"the number by chance is over 0, not {number_text(self.by_chance)}")
        if self.effort not in EFFORTS:
            raise MatcherError(f"an effort is 1, 2 or 4, not {number_text(self.effort)}")
        return replace(self, calibration=self.calibration or load_calibration(matcher.name))

    def allow(self, candidate: Candidate | SubjectCandidate) -> bool:
        """Return whether a candidate is listed."""
        return candidate.score >= self.threshold and candidate.expected_false < self.by_chance


USUAL: Final = SearchOptions()


Similarity = dict[int, float]
"""Of the prints that were compared with a probe, by number."""


class Subjects(Protocol):
    """The subjects of enrolled prints."""

    def __len__(self) -> int:
        """Return how many there are."""

    def fingers(self) -> int:
        """Return how many fingers they have."""

    def fingers_of(self, numbers: Sequence[int]) -> Mapping[str, Mapping[str, Sequence[int]]]:
        """Return the subjects of the entries of some numbers.

        Of each all fingers, and of these the numbers of all entries; "" is a finger whose position
        is not known.
        """


class Search(ABC):
    """The prints of a gallery, prepared for a matcher.

    `numbers` has the numbers of their entries, ascending, `damaged` the entries that could not be
    read, with reasons; these are not among the prints. A search that is `preselected` compares few
    of the prints with a probe, others all.
    """

    matcher: Matcher
    subjects: Subjects
    numbers: NDArray[np.int64]
    damaged: Mapping[int, str]
    preselected: bool = False

    def __len__(self) -> int:
        return len(self.numbers)

    @abstractmethod
    def compare(
        self, probe: Any, options: SearchOptions, threads: Executor
    ) -> tuple[Similarity, tuple[int, ...]]:
        """Compare a probe, which the matcher prepared, with the prints that may be its mates.

        Also return how many prints each stage of a pre-selection has passed on.
        """

    @abstractmethod
    def compare_some(self, probe: Any, numbers: Sequence[int], threads: Executor) -> Similarity:
        """Compare a probe with the prints of some entries; those that are gone are left out."""

    @abstractmethod
    def print_of(self, number: int) -> Any:
        """Return a print as the matcher prepares it; None where it is gone."""


class GallerySubjects:
    """The subjects of an open gallery, as of one revision of it."""

    def __init__(self, gallery: Gallery) -> None:
        self.gallery = gallery

    def __len__(self) -> int:
        return self.gallery.subjects()

    def fingers(self) -> int:
        """Return how many fingers there are."""
        return self._fingers

    @cached_property
    def _fingers(self) -> int:
        return self.gallery.count_fingers()

    def fingers_of(self, numbers: Sequence[int]) -> dict[str, dict[str, list[int]]]:
        """Return the subjects of the entries of some numbers, with all their fingers."""
        subjects: dict[str, dict[str, list[int]]] = {}
        for number, subject, finger in self.gallery.impressions_of_subjects(numbers):
            subjects.setdefault(subject, {}).setdefault(finger, []).append(number)
        return subjects
