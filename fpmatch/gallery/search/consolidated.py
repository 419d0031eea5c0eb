"""The consolidated templates of enrolled fingers, with which candidates are compared again."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.gallery.fingers.finger import Finger
from fpmatch.matching.calibration import load_calibration, score_to_fmr

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.search.identification import Candidate
    from fpmatch.gallery.search.search import Search
    from fpmatch.matching.calibration import Calibration

FINGERS_KEPT: Final = 200  # that stay prepared in memory: those compared most recently


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
        """Score fingers by `fpmatch.gallery.fingers.finger.Finger`, and rank them again.

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
        return replace(candidate, score=score, fmr=score_to_fmr(score))

    def _prepared(self, finger: int) -> Finger | None:
        """Return a finger, numbered as `Search.finger_of` does, with its consolidated templates.

        None if all its templates have been damaged since they were prepared.
        """
        search = self._search
        numbers = search.numbers[search.finger_of == finger].tolist()
        stored = [self._gallery.find_template(number) for number in numbers]
        templates = [template for template in stored if template is not None]
        return Finger.of(templates, search.matcher, self._calibration) if templates else None
