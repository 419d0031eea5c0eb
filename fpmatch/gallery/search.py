"""Enrolled prints prepared for comparison with probes."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.engine.workers import Progress, no_progress
from fpmatch.errors import MatcherError
from fpmatch.matching.calibration import load_calibration, score_to_fmr
from fpmatch.matching.candidate_list import candidate_list
from fpmatch.matching.finger import Finger
from fpmatch.matching.matchers import DEFAULT_MATCHER, get_matcher
from fpmatch.matching.packed_templates import PackedTemplates

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.engine.engine import Engine
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Comparison, Matcher

FINGERS_KEPT: Final = 200  # that stay prepared in memory: those compared most recently


@dataclass(frozen=True, slots=True)
class Candidate:
    """Hold one enrolled finger, or impression, that may be the probe's; rank 1 scores highest.

    `number` is that of the entry; of a finger, that of its most similar impression, to which
    `similarity`, `comparison` (if requested) and `impression_score` belong. `fmr` is the rate at
    which comparisons with another finger, of as many `impressions`, score as high, and `score` is
    ``-10·log10(fmr)``, 0 to 100; see `fpmatch.matching.finger`. `expected_false` is `fmr` times the
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


@dataclass(frozen=True, eq=False)
class Search:
    """Hold the prints of a gallery, prepared for a matcher.

    For each print, `numbers` holds the number of its entry, `fingers` the lowest number of an entry
    of its finger, and `references` the prepared template. `damaged` are the entries that could not
    be read, with reasons; they are not among the prints.
    """

    matcher: Matcher
    numbers: NDArray[np.int64]
    fingers: NDArray[np.int64]
    references: Sequence[Any] | PackedTemplates
    damaged: Mapping[int, str] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.numbers)

    @cached_property
    def _grouped(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        _, finger, sizes = np.unique(self.fingers, return_inverse=True, return_counts=True)
        return finger.ravel(), sizes

    @property
    def finger_of(self) -> NDArray[np.intp]:
        """The finger of each print, numbered from 0."""
        return self._grouped[0]

    @property
    def finger_sizes(self) -> NDArray[np.intp]:
        """The number of prints of each of these fingers."""
        return self._grouped[1]

    @property
    def has_bit_descriptors(self) -> bool:
        """Whether candidate lists can be made: the matcher's prints have bit descriptors."""
        return isinstance(self.references, PackedTemplates)

    def candidate_list(self, probe: Any, count: int) -> NDArray[np.intp]:
        """Return the ascending indices of the `count` prints with the most similar descriptors.

        Raises MatcherError if the matcher's prints have none.
        """
        if not isinstance(self.references, PackedTemplates):
            raise MatcherError(f"the matcher {self.matcher.name} supports no candidate list")
        return candidate_list(probe, self.references, count)

    def similarities(
        self, probe: Any, which: NDArray[np.intp] | None = None
    ) -> NDArray[np.float64]:
        """Return the similarity of a prepared probe to each print, or to those of `which`."""
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
    note: Callable[[str], object] | None = None,
) -> Search:
    """Prepare the prints that are in a gallery now for a search; it may be closed afterwards.

    `engine` prepares prints (default: all cores), `progress` is called with stage "prepare" and
    numbers of prints, and `note` with a line on prepared prints that cannot be used, and are
    prepared again (default: a RuntimeWarning).

    Raises
    ------
    GalleryError
        If the gallery cannot be read.
    MatcherError
        If the matcher is unknown.
    """
    chosen = get_matcher(matcher) if isinstance(matcher, str) else matcher
    if hasattr(chosen, "similarities"):
        from fpmatch.gallery.prepared import prepare_gallery  # noqa: PLC0415

        kept = prepare_gallery(
            gallery, chosen, engine=engine, progress=progress, note=note or _warn
        )
        return Search(chosen, kept.numbers, kept.fingers, kept.prints, dict(gallery.damaged))
    total = len(gallery)
    progress("prepare", 0, total)
    finger_of = gallery.fingers()
    read, references = [], []
    for number, template in gallery.templates():
        read.append(number)
        references.append(chosen.prepare(template))
        progress("prepare", min(len(read), total), total)
    numbers = np.array(read, np.int64)
    fingers = np.array([finger_of.get(number, number) for number in read], np.int64)
    return Search(chosen, numbers, fingers, references, dict(gallery.damaged))


def _warn(text: str) -> None:
    warnings.warn(text, RuntimeWarning, stacklevel=4)


class ConsolidatedFingers:
    """Hold the fingers of an open gallery, each prepared when it is first a candidate."""

    def __init__(
        self, gallery: Gallery, search: Search, calibration: Calibration | None = None
    ) -> None:
        self._gallery = gallery
        self._search = search
        name = search.matcher.name
        self._calibration = load_calibration(name) if calibration is None else calibration
        self._finger = lru_cache(maxsize=FINGERS_KEPT)(self._prepared)

    def rerank(self, probe: Any, candidates: Sequence[Candidate]) -> list[Candidate]:
        """Score fingers by `fpmatch.matching.finger.Finger`, and rank them again.

        The score of a finger with one impression is unchanged.
        """
        scored = [self._scored(probe, candidate) for candidate in candidates]
        scored.sort(key=lambda one: (-one.score, -one.similarity, one.number))
        return [replace(one, rank=rank) for rank, one in enumerate(scored, start=1)]

    def _scored(self, probe: Any, candidate: Candidate) -> Candidate:
        if candidate.impressions == 1:
            return candidate
        search = self._search
        of = search.finger_of[np.flatnonzero(search.numbers == candidate.number)[0]]
        finger = self._finger(int(of))
        if finger is None:
            return candidate
        score = finger.compare(probe).score
        fmr = score_to_fmr(score)
        expected = fmr * len(search.finger_sizes)
        return replace(candidate, score=score, fmr=fmr, expected_false=expected)

    def _prepared(self, finger: int) -> Finger | None:
        """Return a finger, numbered as `Search.finger_of` does, with its consolidated templates.

        None if all its templates have been damaged since they were prepared.
        """
        search = self._search
        numbers = search.numbers[search.finger_of == finger].tolist()
        found = [self._gallery.find_template(number) for number in numbers]
        templates = [template for template in found if template is not None]
        return Finger.of(templates, search.matcher, self._calibration) if templates else None
