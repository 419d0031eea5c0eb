"""Many enrolled prints ready to be compared with one: the search behind an identification."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from fpmatch.engine.workers import Progress, no_progress
from fpmatch.errors import MatcherError
from fpmatch.matching.candidate_list import candidate_list
from fpmatch.matching.matchers import DEFAULT_MATCHER, get_matcher
from fpmatch.matching.packed_templates import PackedTemplates

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.engine.engine import Engine
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.matching.result import Matcher


class References(Protocol):
    """Be a list of prepared templates, or many of them packed."""

    def __getitem__(self, k: int, /) -> Any:
        """Return one as the matcher's `prepare` made it."""

    def __len__(self) -> int:
        """Return how many they are."""


@dataclass(frozen=True, eq=False)
class Search:
    """Hold the prints of a gallery, prepared for a matcher.

    Parameters
    ----------
    matcher : Matcher
        The matcher.
    numbers : ndarray of int64, shape (N,)
        Numbers of the entries.
    fingers : ndarray of int64, shape (N,)
        The lowest number of the entries of the same finger.
    references : References
        Their prepared templates, in the same order.
    """

    matcher: Matcher
    numbers: NDArray[np.int64]
    fingers: NDArray[np.int64]
    references: References

    def __len__(self) -> int:
        return len(self.numbers)

    @cached_property
    def _grouped(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        _, finger, sizes = np.unique(self.fingers, return_inverse=True, return_counts=True)
        return finger.ravel(), sizes

    @property
    def finger_of(self) -> NDArray[np.intp]:
        """The finger of each print, numbered from 0 on."""
        return self._grouped[0]

    @property
    def finger_sizes(self) -> NDArray[np.intp]:
        """How many prints each of these fingers has."""
        return self._grouped[1]

    @property
    def has_shortlists(self) -> bool:
        """Whether the matcher's prints have codes."""
        return isinstance(self.references, PackedTemplates)

    def shortlist(self, probe: Any, count: int) -> NDArray[np.intp]:
        """Choose the prints that may be of the probe's finger, by their codes.

        Parameters
        ----------
        probe : object
            The probe, as the matcher's `prepare` made it.
        count : int
            How many.

        Returns
        -------
        ndarray of intp
            Their places, ascending.

        Raises
        ------
        MatcherError
            If the matcher's prints have no codes.
        """
        if not isinstance(self.references, PackedTemplates):
            raise MatcherError(f"the matcher {self.matcher.name} has no shortlists")
        return candidate_list(probe, self.references, count)

    def similarities(
        self, probe: Any, which: NDArray[np.intp] | None = None
    ) -> NDArray[np.float64]:
        """Compare a probe with the prints.

        Parameters
        ----------
        probe : object
            The probe, as the matcher's `prepare` made it.
        which : ndarray of intp, optional
            Places of those to compare with (default: all).

        Returns
        -------
        ndarray of float64
            The similarity to each, as the matcher's `compare` finds it.
        """
        if hasattr(self.matcher, "similarities") and isinstance(self.references, PackedTemplates):
            compared = self.references if which is None else self.references.take(which)
            found: NDArray[np.float64] = self.matcher.similarities(probe, compared)
            return found
        places = range(len(self)) if which is None else which.tolist()
        return np.array(
            [self.matcher.compare(probe, self.references[k]).similarity for k in places]
        )


def open_search(
    gallery: Gallery,
    matcher: str | Matcher = DEFAULT_MATCHER,
    *,
    engine: Engine | None = None,
    progress: Progress = no_progress,
) -> Search:
    """Prepare the prints of a gallery for a search.

    Parameters
    ----------
    gallery : Gallery
        An open gallery; it may be closed afterwards.
    matcher : str or Matcher
        The matcher, or its name.
    engine : Engine, optional
        Where prints are prepared (default: all cores).
    progress : callable
        Told of stage "prepare", in prints.

    Returns
    -------
    Search
        The prints, as they are in the gallery now.

    Raises
    ------
    GalleryError
        If the gallery cannot be read, or a template is damaged.
    MatcherError
        If the matcher is unknown.
    """
    chosen = get_matcher(matcher) if isinstance(matcher, str) else matcher
    if hasattr(chosen, "similarities"):
        from fpmatch.gallery.prepared import prepare_gallery  # noqa: PLC0415

        kept = prepare_gallery(gallery, chosen, engine=engine, progress=progress)
        return Search(chosen, kept.entries["number"], kept.entries["finger"], kept.prints)
    total = len(gallery)
    progress("prepare", 0, total)
    shown = gallery.fingers()
    numbers, references = [], []
    for number, template in gallery.templates():
        numbers.append(number)
        references.append(chosen.prepare(template))
        progress("prepare", min(len(numbers), total), total)
    fingers = [shown.get(number, number) for number in numbers]
    return Search(chosen, np.array(numbers, np.int64), np.array(fingers, np.int64), references)
