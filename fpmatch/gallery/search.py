"""Enrolled prints prepared for comparison with probes."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from fpmatch.engine.workers import Progress, no_progress
from fpmatch.errors import MatcherError
from fpmatch.gallery.compact import pack_template, unpack_template
from fpmatch.matching.calibration import load_calibration, score_to_fmr
from fpmatch.matching.candidate_list import candidate_list
from fpmatch.matching.finger import Finger
from fpmatch.matching.matchers import DEFAULT_MATCHER, get_matcher
from fpmatch.matching.packed_templates import PackedTemplates

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.engine.engine import Engine
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.reader import GalleryReader
    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Comparison, Matcher
    from fpmatch.minutiae import Template

CandidateListSize = int | Literal["auto", "off"]
"""Number of prints that are compared with a probe; see `fpmatch.gallery.identify`."""

EXHAUSTIVE_UP_TO: Final = 20_000  # prints, which are all compared by default
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


@dataclass(frozen=True, slots=True, eq=False)
class Preselection:
    """Hold the places of the prints to compare, ascending, and how many each stage passed on.

    At most the share `loss` of the mates that comparing all would find is expected to be missing.
    """

    places: NDArray[np.intp]
    passed_on: tuple[int, ...]
    loss: float


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
        found: NDArray[np.intp] = places[np.append(self.numbers, -1)[places] == wanted]
        return found

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
            PackedTemplates.concatenate([known, PackedTemplates.pack(stored)])
            if isinstance(known, PackedTemplates)
            else [*known, *stored],
            self.damaged,
        )

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
    candidate_list: CandidateListSize = "auto",
    before: Search | None = None,
) -> Search:
    """Prepare the prints that are in a gallery now for a search; it may be closed afterwards.

    More than `EXHAUSTIVE_UP_TO` prints are indexed, unless all of them are to be compared or to be
    ranked for a `candidate_list`.

    Parameters
    ----------
    gallery : Gallery
        An open gallery.
    matcher : str or Matcher
        The matcher, or its name.
    engine : Engine, optional
        Prepares prints (default: all cores).
    progress : callable
        Called with stage "prepare" and numbers of prints.
    note : callable, optional
        Called with a line on files that cannot be used, and are prepared or built again (default: a
        RuntimeWarning).
    candidate_list : int, "auto" or "off"
        As it will be given to `fpmatch.gallery.identify.identify`.
    before : Search, optional
        An earlier search of the gallery, whose index is continued.

    Raises
    ------
    GalleryError
        If the gallery cannot be read.
    MatcherError
        If the matcher is unknown.
    """
    chosen = get_matcher(matcher) if isinstance(matcher, str) else matcher
    given: dict[str, Any] = {"engine": engine, "progress": progress, "note": note or _warn}
    if not hasattr(chosen, "similarities"):
        return _prepared_one_by_one(gallery, chosen, progress)
    if (
        candidate_list == "auto"
        and chosen.name == DEFAULT_MATCHER
        and gallery.has_over(EXHAUSTIVE_UP_TO)
    ):
        from fpmatch.gallery.indexed_search import indexed_search  # noqa: PLC0415

        return indexed_search(gallery, chosen, before, partial(_prepared, gallery, chosen), **given)
    return _prepared(gallery, chosen, **given)


def _prepared(gallery: GalleryReader, matcher: Matcher, **given: Any) -> Search:
    from fpmatch.gallery.prepared import prepare_gallery  # noqa: PLC0415

    kept = prepare_gallery(gallery, matcher, **given)
    return Search(matcher, kept.numbers, kept.fingers, kept.prints, dict(gallery.damaged))


def _prepared_one_by_one(gallery: GalleryReader, matcher: Matcher, progress: Progress) -> Search:
    """Return the search of prints that cannot be packed."""
    total = len(gallery)
    progress("prepare", 0, total)
    finger_of = gallery.fingers()
    read, references = [], []
    for number, template in gallery.templates():
        read.append(number)
        references.append(matcher.prepare(template))
        progress("prepare", min(len(read), total), total)
    numbers = np.array(read, np.int64)
    fingers = np.array([finger_of.get(number, number) for number in read], np.int64)
    return Search(matcher, numbers, fingers, references, dict(gallery.damaged))


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
