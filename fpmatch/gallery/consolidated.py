"""Candidates compared with what all impressions of their fingers show together."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.matching.calibration import load_calibration, score_to_fmr
from fpmatch.matching.finger import Finger

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.identify import Candidate
    from fpmatch.gallery.search import Search
    from fpmatch.matching.calibration import Calibration

FINGERS_KEPT: Final = 200
"""Fingers whose impressions are kept prepared and consolidated: those asked for last."""


class ConsolidatedFingers:
    """The fingers of an open gallery, each prepared when it is first a candidate.

    Parameters
    ----------
    gallery : Gallery
        The gallery, open.
    search : Search
        What `fpmatch.gallery.search.open_search` made of it.
    calibration : Calibration, optional
        Turns similarities into scores (default: the one that comes with the package).
    """

    def __init__(
        self, gallery: Gallery, search: Search, calibration: Calibration | None = None
    ) -> None:
        self._gallery = gallery
        self._search = search
        name = search.matcher.name
        self._calibration = load_calibration(name) if calibration is None else calibration
        self._fingers: OrderedDict[int, Finger] = OrderedDict()

    def ranked(self, probe: Any, candidates: Sequence[Candidate]) -> list[Candidate]:
        """Score candidates by `fpmatch.matching.finger.Finger`, and rank them anew.

        Parameters
        ----------
        probe : object
            The probe, as the matcher's `prepare` made it.
        candidates : sequence of Candidate
            Fingers, not single impressions.

        Returns
        -------
        list of Candidate
            The same fingers, best first. The score of a finger of one impression stays.

        Raises
        ------
        GalleryError
            If the gallery cannot be read.
        """
        scored = [self._scored(probe, candidate) for candidate in candidates]
        scored.sort(key=lambda one: (-one.score, -one.similarity, one.number))
        return [replace(one, rank=rank) for rank, one in enumerate(scored, start=1)]

    def _scored(self, probe: Any, candidate: Candidate) -> Candidate:
        if candidate.impressions == 1:
            return candidate
        score = self._finger(candidate.number).compare(probe).score
        fmr = score_to_fmr(score)
        fingers = len(self._search.finger_sizes)
        return replace(candidate, score=score, fmr=fmr, expected_false=fmr * fingers)

    def _finger(self, number: int) -> Finger:
        """Return the finger of an entry, with what its impressions show together."""
        search = self._search
        of = int(search.finger_of[np.flatnonzero(search.numbers == number)[0]])
        if of not in self._fingers:
            numbers = search.numbers[search.finger_of == of].tolist()
            templates = [self._gallery.template(one) for one in numbers]
            self._fingers[of] = Finger.of(templates, search.matcher, self._calibration)
            if len(self._fingers) > FINGERS_KEPT:
                self._fingers.popitem(last=False)
        self._fingers.move_to_end(of)
        return self._fingers[of]
