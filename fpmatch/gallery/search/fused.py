"""Identification by several fingers: find the subjects whose fingers match the probes best.

Each probe is searched alone. The subjects that are among the best of any probe are compared by all
their fingers, and the scores of a subject's fingers are fused
(`fpmatch.gallery.fingers.fused_fingers`).
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.gallery.fingers.finger import fused_scores
from fpmatch.gallery.fingers.fused_fingers import assign_fingers
from fpmatch.gallery.search.identification import (
    ComparedFinger,
    FusedIdentification,
    SubjectCandidate,
    expected_by_chance,
)
from fpmatch.gallery.search.identify import compare_probe, find_candidates, with_entries
from fpmatch.gallery.search.search import USUAL, SearchOptions
from fpmatch.matching.calibration import score_to_fmr

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence
    from concurrent.futures import ThreadPoolExecutor

    from fpmatch.gallery.search.identify import ComparedProbe
    from fpmatch.gallery.search.search import Search
    from fpmatch.templates.minutiae import Template

    Finger = tuple[str, str]  # a subject, and which finger

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
    positions: Sequence[str] = (),
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
    named = list(positions) or [""] * len(probes)
    known = [one for one in named if one]
    if not 1 <= len(probes) <= MOST_PROBES:
        raise MatcherError(f"1 to {MOST_PROBES} fingers are searched for, not {len(probes)}")
    if len(named) != len(probes):
        raise MatcherError("each probe has a position, or none has")
    if len(set(known)) < len(known):
        raise MatcherError("two probes are of the same finger")
    given = replace(options, **changes)
    each = SearchOptions(
        count=max(given.count, CONSIDERED), calibration=given.calibration, effort=given.effort
    ).checked(search.matcher)
    search.follow()
    with search.threads(workers) as threads:
        compared = [compare_probe(search, one, each, threads) for one in probes]
        how = compared, named, given, each, threads
        result, entries = with_entries(search, partial(_find_subjects, *how))
    return replace(result, entries=entries)


def _find_subjects(
    compared: Sequence[ComparedProbe],
    positions: Sequence[str],
    options: SearchOptions,
    each: SearchOptions,
    threads: ThreadPoolExecutor,
    skipped: Collection[int],
) -> FusedIdentification:
    """Return the outcome for probes that were compared; `each` are the options of one alone."""
    search = compared[0].search
    alone = [find_candidates(one, each, skipped) for one in compared]
    labels = {n: label for one in compared for n, label in one.labels.items()}
    among = {labels[candidate.number][0] for one in alone for candidate in one.candidates}
    there = sorted(n for n, (subject, _) in labels.items() if subject in among and n not in skipped)
    fingers: dict[Finger, list[int]] = {}
    for number in np.intersect1d(search.numbers, there).tolist():
        fingers.setdefault(labels[number], []).append(number)
    scored = [
        _scored(one, fingers, position, each, threads)
        for one, position in zip(compared, positions, strict=True)
    ]
    total = search.gallery.subjects()
    ranked = _ranked(fingers, scored)
    expected = expected_by_chance([score for _, score, _ in ranked], total).tolist()
    candidates = [
        SubjectCandidate(rank + 1, subject, score, score_to_fmr(score), expected[rank], pairs)
        for rank, (subject, score, pairs) in enumerate(ranked[: options.count])
    ]
    return FusedIdentification(
        enrolled=alone[0].enrolled,
        compared=max(one.compared for one in alone),
        subjects=total,
        candidates=tuple(filter(options.allow, candidates)),
        entries={},
        matcher=search.matcher.name,
        smallest_measured_fmr=alone[0].smallest_measured_fmr,
        effort=alone[0].effort,
        passed_on=tuple(map(max, zip(*(one.passed_on for one in alone), strict=True))),
    )


def _scored(
    one: ComparedProbe,
    fingers: Mapping[Finger, Sequence[int]],
    position: str,
    options: SearchOptions,
    threads: ThreadPoolExecutor,
) -> dict[Finger, tuple[float, int]]:
    """Return score and most similar print of the fingers that a probe may be of."""
    assert options.calibration is not None
    may = [key for key in fingers if not position or not key[1] or key[1] == position]
    left = sorted({n for key in may for n in fingers[key]} - one.similarity.keys())
    similarity = one.similarity | one.search.compare_some(one.probe, left, threads)
    rows = [(n, k) for k, key in enumerate(may) for n in fingers[key] if n in similarity]
    finger = np.array([k for _, k in rows], np.intp)
    singles = options.calibration.scores(np.array([similarity[n] for n, _ in rows]))
    scores = fused_scores(singles, finger, [len(fingers[key]) for key in may]).tolist()
    best = [max(fingers[key], key=lambda n: (similarity.get(n, -math.inf), -n)) for key in may]
    return dict(zip(may, zip(scores, best, strict=True), strict=True))


def _ranked(
    fingers: Mapping[Finger, Sequence[int]], scored: Sequence[Mapping[Finger, tuple[float, int]]]
) -> list[tuple[str, float, tuple[ComparedFinger, ...]]]:
    """Return the subjects of which any finger was compared, their scores and fingers, best first.

    See `FusedIdentification` for the order.
    """
    rows = []
    of_subject = itemgetter(0)
    for subject, group in groupby(sorted(fingers, key=of_subject), of_subject):
        keys = list(group)
        may = np.array([[key in of_probe for key in keys] for of_probe in scored])
        scores = np.array([[of_probe.get(key, (0.0, 0))[0] for key in keys] for of_probe in scored])
        score, pairs = assign_fingers(scores, may)
        compared = []
        for probe, f in pairs:
            of_finger, number = scored[probe][keys[f]]
            compared.append(ComparedFinger(probe, number, of_finger, len(fingers[keys[f]])))
        if compared:
            total = math.fsum(one.score for one in compared)
            order = -score, -total, min(one.number for one in compared), subject
            rows.append((order, (subject, score, tuple(compared))))
    return [row for _, row in sorted(rows, key=lambda row: row[0])]
