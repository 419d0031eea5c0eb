"""Identification by several fingers: find the subjects whose fingers match the probes best.

Each probe is searched alone. The subjects that are among the best of any probe are compared by all
their fingers, and the scores of a subject's fingers are fused
(`fpmatch.gallery.fingers.fused_fingers`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import groupby
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.gallery.engine.in_threads import Threads
from fpmatch.gallery.fingers.finger import fused_scores
from fpmatch.gallery.fingers.fused_fingers import assign_fingers
from fpmatch.gallery.index.prints.compare import packs
from fpmatch.gallery.search.identification import (
    ComparedFinger,
    FusedIdentification,
    SubjectCandidate,
    expected_by_chance,
)
from fpmatch.gallery.search.identify import compare_probe, count_fingers, find_candidates
from fpmatch.gallery.search.search import USUAL, SearchOptions
from fpmatch.matching.calibration import score_to_fmr

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.search.identification import Identification
    from fpmatch.gallery.search.search import Search, Subjects
    from fpmatch.matching.calibration import Calibration
    from fpmatch.templates.minutiae import Template

MOST_PROBES: Final = 10  # fingers of a subject
CONSIDERED: Final = 300
"""Fingers of each probe's list whose subjects are compared by all fingers, if no more are wanted.

In a gallery of a million fingers, two that are in neither list have a fused false match rate of at
least 1 in 600,000 or so: two other subjects score as high.
"""


def identify_fused(
    search: Search,
    probes: Sequence[Template],
    options: SearchOptions = USUAL,
    *,
    subjects: Subjects | None = None,
    positions: Sequence[str] = (),
    skipped: Collection[int] = (),
    workers: int | None = None,
    **changes: Any,
) -> FusedIdentification:
    """Find the subjects whose fingers match several probes, of different fingers, best.

    Each probe is compared with a finger of its own of the subject: with that of its position, or,
    where the position of either is not known, with the fingers that remain, which is accounted for
    in the score. Probes without such a finger are left out.

    The `probes` are a print of each finger, in any order, and `positions` which finger each is of,
    named as when it was enrolled, "" where it is not known (default: none is known). Other
    parameters are as for `fpmatch.gallery.search.identify.identify`; the number of candidates, and
    their least score, refer to subjects.

    Raises MatcherError if there are no probes or more than 10, not as many positions, or two of the
    same, and as `identify`; GalleryError if the subjects cannot be read.

    Examples
    --------
    >>> from fpmatch import load_template, open_gallery
    >>> from fpmatch.gallery.search.fused import identify_fused
    >>> from fpmatch.gallery.search.opening import open_search
    >>> left, right = map(load_template, ("left.json", "right.json"))  # doctest: +SKIP
    >>> with open_gallery("prints.db") as gallery:  # doctest: +SKIP
    ...     search = open_search(gallery)
    ...     result = identify_fused(search, [left, right], positions=["left", "right"])
    """
    named = _checked_positions(probes, positions)
    given = replace(options, **changes)
    each = SearchOptions(
        count=max(given.count, CONSIDERED), calibration=given.calibration, effort=given.effort
    ).checked(search.matcher)
    assert each.calibration is not None
    of = subjects or search.subjects
    compared = [compare_probe(search, one, each, subjects=of, workers=workers) for one in probes]
    searched = count_fingers(compared[0], of, skipped)
    alone = [find_candidates(one, each, searched, skipped=skipped) for one in compared]
    considered = sorted({candidate.number for one in alone for candidate in one.candidates})
    fingers = _Fingers.of(search, of.fingers_of(considered), skipped)
    may = fingers.may_be(named)
    with Threads(workers if packs(search.matcher) else 1) as threads:
        similar = [
            fingers.compare(search, one.probe, some, known, threads)
            for one, some, known in zip(compared, may, alone, strict=True)
        ]
    ranked = _ranked(fingers, may, [fingers.scored(one, each.calibration) for one in similar])
    total = len(of)
    return FusedIdentification(
        enrolled=alone[0].enrolled,
        compared=max(one.compared for one in alone),
        subjects=total,
        candidates=tuple(filter(given.allow, _candidates(ranked, total)[: given.count])),
        matcher=search.matcher.name,
        smallest_measured_fmr=alone[0].smallest_measured_fmr,
        effort=alone[0].effort,
        passed_on=tuple(map(max, zip(*(one.passed_on for one in alone), strict=True))),
    )


def _checked_positions(probes: Sequence[Template], positions: Sequence[str]) -> list[str]:
    """Return which finger each probe is of; MatcherError if two are of the same."""
    named = list(positions) or [""] * len(probes)
    known = [one for one in named if one]
    if not 1 <= len(probes) <= MOST_PROBES:
        raise MatcherError(f"1 to {MOST_PROBES} fingers are searched for, not {len(probes)}")
    if len(named) != len(probes):
        raise MatcherError("each probe has a position, or none has")
    if len(set(known)) < len(known):
        raise MatcherError("two probes are of the same finger")
    return named


@dataclass(frozen=True, slots=True, eq=False)
class _Fingers:
    """The fingers of some subjects, each of some `sizes` of impressions, and their prints.

    Fingers are ordered by subject; `names` are subject and position of each. For each print, in the
    order of the `numbers` of entries, `finger` is which of these it is of.
    """

    names: list[tuple[str, str]]
    sizes: NDArray[np.intp]
    numbers: NDArray[np.int64]
    finger: NDArray[np.intp]

    @classmethod
    def of(
        cls,
        search: Search,
        subjects: Mapping[str, Mapping[str, Sequence[int]]],
        skipped: Collection[int],
    ) -> _Fingers:
        """Return the fingers of subjects that have a print in a search that is not skipped."""
        names = [(s, p) for s, fingers in subjects.items() for p in fingers]
        rows = [
            (n, k) for k, (s, p) in enumerate(names) for n in subjects[s][p] if n not in skipped
        ]
        numbers, finger = np.array(sorted(rows), np.int64).reshape(-1, 2).T
        there = np.isin(numbers, search.numbers)
        kept, finger, sizes = np.unique(finger[there], return_inverse=True, return_counts=True)
        return cls([names[k] for k in kept.tolist()], sizes, numbers[there], finger.ravel())

    def may_be(self, positions: Sequence[str]) -> NDArray[np.bool_]:
        """Return whether each probe, of some position or none, may be of each finger."""
        may = [[not (p and of) or p == of for _, of in self.names] for p in positions]
        return np.array(may, np.bool_).reshape(len(positions), len(self.names))

    def compare(
        self,
        search: Search,
        probe: Any,
        may: NDArray[np.bool_],
        alone: Identification,
        threads: Threads,
    ) -> NDArray[np.float64]:
        """Return the similarities of a prepared probe to the prints of fingers that it may be of.

        To others, and to prints that are gone, they are infinitely low. The similarities of the
        candidates of the search for this probe `alone` are known.
        """
        known = {candidate.number: candidate.similarity for candidate in alone.candidates}
        compared = may[self.finger]
        similarities = np.array([known.get(number, np.nan) for number in self.numbers.tolist()])
        similarities[~compared] = -np.inf
        left = np.isnan(similarities)
        more = search.compare_some(probe, self.numbers[left], threads)
        similarities[left] = -np.inf
        similarities[np.isin(self.numbers, more.numbers)] = more.similarities
        return similarities

    def scored(
        self, similarities: NDArray[np.float64], calibration: Calibration
    ) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Return the score of each finger, and the entry of its most similar print."""
        compared = np.isfinite(similarities)
        singles = calibration.scores(similarities[compared])
        scores = fused_scores(singles, self.finger[compared], self.sizes)
        order = np.lexsort((self.numbers, -similarities, self.finger))
        first_of_each = np.cumsum(self.sizes) - self.sizes
        return scores, self.numbers[order[first_of_each]]


class _Row(NamedTuple):
    """A subject, the fused score of its fingers, and these."""

    subject: str
    score: float
    compared: tuple[ComparedFinger, ...]

    def order(self) -> tuple[float, float, int, str]:
        """Return what comes first; see `FusedIdentification`."""
        sum_of_scores = math.fsum(one.score for one in self.compared)
        first = min(one.number for one in self.compared)
        return -self.score, -sum_of_scores, first, self.subject


def _ranked(
    fingers: _Fingers,
    may: NDArray[np.bool_],
    scored: Sequence[tuple[NDArray[np.float64], NDArray[np.int64]]],
) -> list[_Row]:
    """Return the subjects of which any finger was compared, best first."""
    scores, best = (np.array(of_probes) for of_probes in zip(*scored, strict=True))
    rows = []
    for subject, group in groupby(range(len(fingers.names)), lambda k: fingers.names[k][0]):
        which = list(group)
        score, pairs = assign_fingers(scores[:, which], may[:, which])
        if not pairs:
            continue
        compared = tuple(
            ComparedFinger(
                probe,
                int(best[probe, which[f]]),
                float(scores[probe, which[f]]),
                int(fingers.sizes[which[f]]),
            )
            for probe, f in pairs
        )
        rows.append(_Row(subject, score, compared))
    return sorted(rows, key=_Row.order)


def _candidates(ranked: Sequence[_Row], total: int) -> list[SubjectCandidate]:
    """Return ranked subjects, of `total`, as candidates."""
    expected = expected_by_chance([row.score for row in ranked], total).tolist()
    return [
        SubjectCandidate(rank, subject, score, score_to_fmr(score), chance, compared)
        for rank, ((subject, score, compared), chance) in enumerate(
            zip(ranked, expected, strict=True), start=1
        )
    ]
