"""Enrolled prints prepared for comparison with probes."""

from __future__ import annotations

import warnings
from dataclasses import replace
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.fingers.finger import Finger
from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.gallery.prepared_search import EXHAUSTIVE_UP_TO, LISTED_UP_TO, Search
from fpmatch.matching.calibration import load_calibration, score_to_fmr
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.prepared_search import Candidate, CandidateListSize
    from fpmatch.gallery.store.reader import GalleryReader
    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Matcher

FINGERS_KEPT: Final = 200  # that stay prepared in memory: those compared most recently


def open_search(
    gallery: Gallery,
    matcher: str | Matcher = DEFAULT_MATCHER,
    *,
    engine: Engine | None = None,
    progress: Progress = no_progress,
    note: Callable[[str], object] | None = None,
    candidate_list: CandidateListSize = "auto",
    loss: float | None = None,
    before: Search | None = None,
) -> Search:
    """Prepare the prints that are in a gallery now for a search; it may be closed afterwards.

    More than `LISTED_UP_TO` prints are indexed, and more than `EXHAUSTIVE_UP_TO` where a `loss` is
    wanted, unless all of them are to be compared or to be ranked for a `candidate_list`.

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
    loss : float, optional
        The loss that is wanted (default: none, which needs no index up to `LISTED_UP_TO` prints).
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
    most = LISTED_UP_TO if loss is None else EXHAUSTIVE_UP_TO
    if candidate_list == "auto" and chosen.name == DEFAULT_MATCHER and gallery.has_over(most):
        from fpmatch.gallery.indexed_search import indexed_search  # noqa: PLC0415

        return indexed_search(gallery, chosen, before, partial(_prepared, gallery, chosen), **given)
    return _prepared(gallery, chosen, **given)


def _prepared(gallery: GalleryReader, matcher: Matcher, **given: Any) -> Search:
    from fpmatch.gallery.index.prepared import prepare_gallery  # noqa: PLC0415

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
    """The fingers of an open gallery, each prepared when it is first a candidate."""

    def __init__(
        self, gallery: Gallery, search: Search, calibration: Calibration | None = None
    ) -> None:
        self._gallery = gallery
        self._search = search
        name = search.matcher.name
        self._calibration = load_calibration(name) if calibration is None else calibration
        self._finger = lru_cache(maxsize=FINGERS_KEPT)(self._prepared)

    def rerank(self, probe: Any, candidates: Sequence[Candidate]) -> list[Candidate]:
        """Score fingers by `fpmatch.fingers.finger.Finger`, and rank them again.

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
        stored = [self._gallery.find_template(number) for number in numbers]
        templates = [template for template in stored if template is not None]
        return Finger.of(templates, search.matcher, self._calibration) if templates else None
