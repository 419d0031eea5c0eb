"""Many enrolled prints ready to be compared with one: the search behind an identification."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from fpmatch.engine.workers import Progress, no_progress
from fpmatch.matching.matchers import DEFAULT_MATCHER, get_matcher

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


@dataclass(frozen=True, slots=True, eq=False)
class Search:
    """Hold the prints of a gallery, prepared for a matcher.

    Parameters
    ----------
    matcher : Matcher
        The matcher.
    numbers : ndarray of int64, shape (N,)
        Numbers of the entries.
    references : References
        Their prepared templates, in the same order.
    """

    matcher: Matcher
    numbers: NDArray[np.int64]
    references: References

    def __len__(self) -> int:
        return len(self.numbers)

    def similarities(self, probe: Any) -> NDArray[np.float64]:
        """Return the similarity of a prepared probe to each print, as `compare` finds it."""
        if hasattr(self.matcher, "similarities"):
            found: NDArray[np.float64] = self.matcher.similarities(probe, self.references)
            return found
        compared = (self.references[k] for k in range(len(self)))
        return np.array([self.matcher.compare(probe, r).similarity for r in compared])


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
        return Search(chosen, kept.entries["number"], kept.prints)
    total = len(gallery)
    progress("prepare", 0, total)
    numbers, references = [], []
    for number, template in gallery.templates():
        numbers.append(number)
        references.append(chosen.prepare(template))
        progress("prepare", min(len(numbers), total), total)
    return Search(chosen, np.array(numbers, np.int64), references)
