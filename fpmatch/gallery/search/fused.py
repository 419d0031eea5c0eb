"""Identification by several fingers: find the subjects whose fingers match the probes best.

Each probe is searched alone. The subjects that are among the best of any probe are compared by all
their fingers, and the scores of a subject's fingers are fused
(`fpmatch.gallery.fingers.fused_fingers`).
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import groupby
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.gallery.engine.in_threads import Threads
from fpmatch.gallery.fingers.finger import fused_scores
from fpmatch.gallery.fingers.fused_fingers import assign_fingers
from fpmatch.gallery.index.compare import packs
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

    from fpmatch.gallery.search.identify import ComparedProbe
    from fpmatch.gallery.search.search import Search, Subjects
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
    """
    named = _checked_positions(probes, positions)
    given = replace(options, **changes)
    each = SearchOptions(
        count=max(given.count, CONSIDERED), calibration=given.calibration, effort=given.effort
    ).checked(search.matcher)
    of = subjects or search.subjects
    compared = [compare_probe(search, one, each, subjects=of, workers=workers) for one in probes]
    searched = count_fingers(compared[0], of, skipped)
    alone = [find_candidates(one, each, searched, skipped=skipped) for one in compared]
    numbers = sorted({candidate.number for one in alone for candidate in one.candidates})
    fingers = _fingers(search, of.fingers_of(numbers), skipped)
    with Threads(workers if packs(search.matcher) else 1) as threads:
        scored = [
            _scored(one, fingers, position, each, threads)
            for one, position in zip(compared, named, strict=True)
        ]
    total = len(of)
    ranked = _ranked(fingers, scored)
    expected = expected_by_chance([score for _, score, _ in ranked], total).tolist()
    candidates = [
        SubjectCandidate(rank + 1, subject, score, score_to_fmr(score), expected[rank], pairs)
        for rank, (subject, score, pairs) in enumerate(ranked[: given.count])
    ]
    return FusedIdentification(
        enrolled=alone[0].enrolled,
        compared=max(one.compared for one in alone),
        subjects=total,
        candidates=tuple(filter(given.allow, candidates)),
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


def _fingers(
    search: Search,
    subjects: Mapping[str, Mapping[str, Sequence[int]]],
    skipped: Collection[int],
) -> dict[tuple[str, str], list[int]]:
    """Return the entries, ascending, of the fingers of subjects that are searched and not skipped.

    Fingers, each its subject and position, are in the order of the subjects.
    """
    every = [
        n for of_finger in subjects.values() for numbers in of_finger.values() for n in numbers
    ]
    there = {*np.intersect1d(search.numbers, every).tolist()}.difference(skipped)
    fingers = {
        (subject, position): sorted(there.intersection(numbers))
        for subject, of_subject in subjects.items()
        for position, numbers in of_subject.items()
    }
    return {finger: numbers for finger, numbers in fingers.items() if numbers}


def _scored(
    one: ComparedProbe,
    fingers: Mapping[tuple[str, str], Sequence[int]],
    position: str,
    options: SearchOptions,
    threads: Threads,
) -> dict[tuple[str, str], tuple[float, int]]:
    """Return score and most similar print of the fingers that a probe may be of."""
    assert options.calibration is not None
    may = [key for key in fingers if not position or not key[1] or key[1] == position]
    rows = [(number, k) for k, key in enumerate(may) for number in fingers[key]]
    left = sorted({number for number, _ in rows} - one.similarity.keys())
    similarity = one.similarity | one.search.compare_some(one.probe, left, threads)
    there = [(similarity[number], number, k) for number, k in rows if number in similarity]
    finger = np.array([k for _, _, k in there], np.intp)
    singles = options.calibration.scores(np.array([value for value, _, _ in there]))
    scores = fused_scores(singles, finger, [len(fingers[key]) for key in may]).tolist()
    best = [
        min(fingers[key], key=lambda number: (-similarity.get(number, -math.inf), number))
        for key in may
    ]
    return dict(zip(may, zip(scores, best, strict=True), strict=True))


def _ranked(
    fingers: Mapping[tuple[str, str], Sequence[int]],
    scored: Sequence[Mapping[tuple[str, str], tuple[float, int]]],
) -> list[tuple[str, float, tuple[ComparedFinger, ...]]]:
    """Return the subjects of which any finger was compared, their scores and fingers, best first.

    See `FusedIdentification` for the order.
    """
    rows = []
    for subject, group in groupby(fingers, key=lambda finger: finger[0]):
        keys = list(group)
        may = np.array([[key in of_probe for key in keys] for of_probe in scored])
        scores = np.array([[of_probe.get(key, (0.0, 0))[0] for key in keys] for of_probe in scored])
        score, pairs = assign_fingers(scores, may)
        compared = []
        for probe, f in pairs:
            of_finger, number = scored[probe][keys[f]]
            compared.append(ComparedFinger(probe, number, of_finger, len(fingers[keys[f]])))
        if compared:
            rows.append((subject, score, tuple(compared)))

    def order(row: tuple[str, float, tuple[ComparedFinger, ...]]) -> tuple[Any, ...]:
        subject, score, compared = row
        total = math.fsum(one.score for one in compared)
        return -score, -total, min(one.number for one in compared), subject

    return sorted(rows, key=order)
