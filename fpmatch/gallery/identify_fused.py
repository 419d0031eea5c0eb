"""Identification by several fingers: find the subjects whose fingers match the probes best.

Each probe is searched alone. The subjects that are among the best of any probe are compared by all
their fingers, and the scores of a subject's fingers are fused (`fpmatch.fingers.fused_fingers`).
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np

from fpmatch.engine.in_threads import Threads
from fpmatch.errors import MatcherError
from fpmatch.fingers.finger import fused_scores
from fpmatch.fingers.fused_fingers import assign_fingers
from fpmatch.gallery.identify import identify
from fpmatch.indexing.loss import DEFAULT_LOSS
from fpmatch.matching.calibration import load_calibration, score_to_fmr

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.engine.engine import Engine
    from fpmatch.gallery.entry import Entry
    from fpmatch.gallery.identify import Identification
    from fpmatch.gallery.prepared_search import CandidateListSize, Each, Search
    from fpmatch.matching.calibration import Calibration
    from fpmatch.templates.minutiae import Template

MOST_PROBES: Final = 10  # fingers of a subject
CONSIDERED: Final = 300
"""Fingers of each probe's list whose subjects are compared by all fingers, if no more are wanted.

In a gallery of a million fingers, two that are in neither list have a fused false match rate of at
least 1 in 600,000 or so: two other subjects score as high.
"""


class Subjects(Protocol):
    """The subjects of enrolled prints."""

    def __len__(self) -> int:
        """Return how many there are."""

    def fingers_of(self, numbers: Sequence[int]) -> Mapping[str, Mapping[str, Sequence[int]]]:
        """Return the subjects of the entries of some numbers.

        Of each all fingers, and of these the numbers of all entries; "" is a finger whose position
        is not known.
        """


@dataclass(frozen=True, slots=True)
class ComparedFinger:
    """The comparison of a probe, by its number from 0, with a finger of a subject.

    `score` is that of all `impressions` of the finger together; `number` is the entry of the most
    similar one.
    """

    probe: int
    number: int
    score: float
    impressions: int


@dataclass(frozen=True, slots=True)
class SubjectCandidate:
    """One subject whose fingers may be the probes'; rank 1 scores highest.

    `fmr` is the rate at which other subjects score as high, and `score` is ``-10·log10(fmr)``, 0 to
    100. `expected_false` is `fmr` times the number of subjects.
    """

    rank: int
    subject: str
    score: float
    fmr: float
    expected_false: float
    fingers: tuple[ComparedFinger, ...]


@dataclass(frozen=True, slots=True)
class FusedIdentification:
    """The outcome of a search by several fingers; candidates come best first.

    Of equal scores, the subject comes first whose compared fingers have the greater sum of scores,
    then the one enrolled first. `compared` is the most prints that a probe was compared with before
    subjects were compared by all fingers, of those `enrolled`. A search in stages was made for a
    `loss`; `passed_on` is the most prints that each stage passed on for a probe.
    """

    enrolled: int
    compared: int
    subjects: int
    candidates: tuple[SubjectCandidate, ...]
    matcher: str
    smallest_measured_fmr: float
    loss: float | None = None
    passed_on: tuple[int, ...] = ()

    @property
    def preselected(self) -> bool:
        """Whether only the prints on candidate lists were compared."""
        return self.compared < self.enrolled

    def candidate_dicts(
        self, entries: Mapping[int, Entry], probes: Sequence[str]
    ) -> list[dict[str, Any]]:
        """Return the candidates as ``fpmatch identify --with --json`` prints them.

        `entries` are those of the fingers by number, `probes` the names of the probes.
        """
        return [
            {
                "rank": one.rank,
                "subject": one.subject,
                "score": one.score,
                "fmr": one.fmr,
                "extrapolated": one.fmr < self.smallest_measured_fmr,
                "expected_false_matches": one.expected_false,
                "fingers": [
                    {
                        "probe": probes[f.probe],
                        "id": f.number,
                        **asdict(entries[f.number].label),
                        "source": entries[f.number].source,
                        "score": f.score,
                        "impressions": f.impressions,
                    }
                    for f in one.fingers
                ],
            }
            for one in self.candidates
        ]


def identify_fused(
    search: Search,
    probes: Sequence[Template],
    subjects: Subjects,
    *,
    positions: Sequence[str] = (),
    count: int = 10,
    threshold: float = 0.0,
    calibration: Calibration | None = None,
    candidate_list: CandidateListSize = "auto",
    skipped: Collection[int] = (),
    loss: float = DEFAULT_LOSS,
    engine: Engine | None = None,
    workers: int | None = None,
) -> FusedIdentification:
    """Find the subjects whose fingers match several probes, of different fingers, best.

    Each probe is compared with a finger of its own of the subject: with that of its position, or,
    where the position of either is not known, with the fingers that remain, which is accounted for
    in the score. Probes without such a finger are left out.

    Parameters
    ----------
    search : Search
        From `fpmatch.gallery.search.open_search`.
    probes : sequence of Template
        A print of each finger, in any order.
    subjects : Subjects
        The subjects of the prints, as `fpmatch.gallery.candidates.GallerySubjects`.
    positions : sequence of str
        Which finger each probe is of, named as when it was enrolled, "" where it is not known
        (default: none is known).
    count, threshold, calibration, candidate_list, skipped, loss, workers
        As for `fpmatch.gallery.identify.identify`; of subjects.
    engine : Engine, optional
        Whose workers search for the probes, entered here (default: this process searches). The
        outcome is the same.

    Raises
    ------
    MatcherError
        If there are no probes or more than 10, not as many positions, or two of the same; and as
        `identify`.
    GalleryError
        If the subjects cannot be read.
    EngineError
        If the engine broke down.

    Examples
    --------
    >>> from fpmatch import load_template, open_gallery
    >>> from fpmatch.gallery.candidates import GallerySubjects
    >>> from fpmatch.gallery.identify_fused import identify_fused
    >>> from fpmatch.gallery.search import open_search
    >>> left, right = map(load_template, ("left.json", "right.json"))  # doctest: +SKIP
    >>> with open_gallery("prints.db") as gallery:  # doctest: +SKIP
    ...     search, subjects = open_search(gallery), GallerySubjects(gallery)
    ...     found = identify_fused(search, [left, right], subjects, positions=["left", "right"])
    """
    named = list(positions) or [""] * len(probes)
    known = [one for one in named if one]
    if not 1 <= len(probes) <= MOST_PROBES:
        raise MatcherError(f"1 to {MOST_PROBES} fingers are searched for, not {len(probes)}")
    if len(named) != len(probes):
        raise MatcherError("each probe has a position, or none has")
    if len(set(known)) < len(known):
        raise MatcherError("two probes are of the same finger")
    chosen = load_calibration(search.matcher.name) if calibration is None else calibration
    limits: dict[str, Any] = {"count": max(count, CONSIDERED), "candidate_list": candidate_list}
    limits["loss"] = loss
    searches = [search] * len(probes)
    if engine is not None:
        from fpmatch.gallery.search_pieces import answered_searches  # noqa: PLC0415  (seldom used)

        searches = answered_searches(engine, search, probes, **limits)
    limits |= {"skipped": skipped, "calibration": chosen, "workers": workers}
    alone = [identify(one, probe, **limits) for one, probe in zip(searches, probes, strict=True)]
    listed = sorted({candidate.number for one in alone for candidate in one.candidates})
    total = len(subjects)
    ranked = []
    listed_fingers = subjects.fingers_of(listed)
    given = search, probes, alone, named, listed_fingers, chosen, skipped
    with Threads(workers) as threads:
        compared_fingers = list(_compare(*given, threads.map))
    for subject, fingers in compared_fingers:
        scores, may = np.array([f.scores for f in fingers]), np.array([f.may for f in fingers])
        score, pairs = assign_fingers(scores.T, may.T)
        if pairs:
            compared = tuple(fingers[f].compared(i) for i, f in pairs)
            total_score = math.fsum(one.score for one in compared)
            order = -score, -total_score, min(one.number for one in compared)
            ranked.append((order, subject, score, compared))
    ranked.sort()
    return FusedIdentification(
        enrolled=alone[0].enrolled,
        compared=max(one.compared for one in alone),
        subjects=total,
        candidates=tuple(
            SubjectCandidate(
                rank, subject, score, fmr := score_to_fmr(score), fmr * total, compared
            )
            for rank, (_, subject, score, compared) in enumerate(ranked[:count], start=1)
            if score >= threshold
        ),
        matcher=search.matcher.name,
        smallest_measured_fmr=score_to_fmr(chosen.largest_measured_score),
        loss=alone[0].loss,
        passed_on=tuple(
            max(stage) for stage in zip(*(one.passed_on for one in alone), strict=True)
        ),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Finger:
    """A finger of a subject: whether each probe may be of it, its score and its best entry."""

    may: NDArray[np.bool_]
    scores: NDArray[np.float64]
    numbers: NDArray[np.int64]
    impressions: int

    def compared(self, probe: int) -> ComparedFinger:
        """Return the comparison with a probe."""
        number, score = int(self.numbers[probe]), float(self.scores[probe])
        return ComparedFinger(probe, number, score, self.impressions)


def _compare(
    search: Search,
    probes: Sequence[Template],
    alone: Sequence[Identification],
    positions: Sequence[str],
    subjects: Mapping[str, Mapping[str, Sequence[int]]],
    calibration: Calibration,
    skipped: Collection[int],
    each: Each,
) -> Iterator[tuple[str, list[_Finger]]]:
    """Compare probes with the fingers of subjects that they may be of; yield the subjects.

    The similarities to prints that are candidates of searches for a probe `alone` are known.
    """
    named = [(s, p) for s, fingers in subjects.items() for p in fingers]
    rows = [(n, k) for k, (s, p) in enumerate(named) for n in subjects[s][p] if n not in skipped]
    numbers, finger = np.array(sorted(rows), np.int64).reshape(-1, 2).T
    places = np.searchsorted(search.numbers, numbers)
    there = np.append(search.numbers, -1)[places] == numbers
    numbers, finger, places = numbers[there], finger[there], places[there]
    if not numbers.size:
        return
    kept, finger, sizes = np.unique(finger, return_inverse=True, return_counts=True)
    finger = finger.ravel()
    may = np.array(
        [[not (p and f) or p == f for p in positions] for f in (named[k][1] for k in kept.tolist())]
    )
    scores, best = [], []
    for probe, some, listed in zip(probes, may.T, alone, strict=True):
        known = {candidate.number: candidate.similarity for candidate in listed.candidates}
        similarities = np.array([known.get(number, np.nan) for number in numbers.tolist()])
        left = some[finger] & np.isnan(similarities)
        prepared = search.matcher.prepare(probe)
        similarities[left] = search.similarities(prepared, places[left], each)
        similarities[~some[finger]] = -np.inf
        compared = some[finger]
        singles = calibration.scores(similarities[compared])
        scores.append(fused_scores(singles, finger[compared], sizes))
        order = np.lexsort((numbers, -similarities, finger))
        best.append(numbers[order[np.cumsum(sizes) - sizes]])
    of_finger = zip(kept.tolist(), may, *map(np.transpose, (scores, best)), sizes, strict=True)
    for subject, group in groupby(of_finger, key=lambda one: named[one[0]][0]):
        yield subject, [_Finger(m, s, n, int(size)) for _, m, s, n, size in group]
