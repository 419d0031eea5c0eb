"""Identification: the enrolled fingers that match a probe best."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from itertools import islice
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from fpmatch.gallery.engine.in_threads import Threads
from fpmatch.gallery.fingers.finger import fused_scores
from fpmatch.gallery.index.prints.compare import packs
from fpmatch.gallery.search.identification import (
    RIVALS,
    Candidate,
    Identification,
    expected_by_chance,
)
from fpmatch.gallery.search.search import USUAL
from fpmatch.matching.calibration import score_to_fmr
from fpmatch.matching.result import call_matcher, compare_prepared

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from numpy.typing import NDArray

    from fpmatch.gallery.search.search import Compared, Search, SearchOptions, Subjects
    from fpmatch.templates.minutiae import Template


def identify(
    search: Search,
    probe: Template,
    options: SearchOptions = USUAL,
    *,
    subjects: Subjects | None = None,
    skipped: Collection[int] = (),
    workers: int | None = None,
    **changes: Any,
) -> Identification:
    """Find the enrolled fingers that a probe matches best.

    What is compared and listed is in `options`, some of them replaced by `changes`. The `subjects`
    have the labels of the prints (default: the subjects of the search); a print without a subject
    is no candidate. Entries of the numbers in `skipped` are treated as if they were not enrolled.
    So many `workers` are the threads that search (default: one a core; few prints are searched by
    one in any case). The candidates are the same to the last bit.

    Raises MatcherError if the matcher has no calibration or an option is out of range; GalleryError
    if the gallery cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from fpmatch import Minutiae, Template
    >>> from fpmatch.gallery.listing.entry import Label, NewEntry
    >>> from fpmatch.gallery.gallery import open_gallery
    >>> from fpmatch.gallery.search.opening import open_search
    >>> minutiae = Minutiae(x=[50, 90, 60, 70], y=[40, 50, 80, 60], angle=[0, 1, 2, 3])
    >>> template = Template(minutiae, 100, 100)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with open_gallery(Path(folder, "gallery.db"), create=True) as gallery:
    ...         _ = gallery.add([NewEntry(Label("ada"), "ada.tif", bytes(32), template)])
    ...         result = identify(open_search(gallery), template)
    >>> result.compared, result.candidates[0].number
    (1, 1)
    """
    given = replace(options, **changes).checked(search.matcher)
    one = compare_probe(search, probe, given, subjects=subjects, workers=workers)
    return find_candidates(one, given, count_fingers(one, subjects, skipped), skipped=skipped)


def count_fingers(
    one: ComparedProbe, subjects: Subjects | None = None, skipped: Collection[int] = ()
) -> int:
    """Return how many fingers are enrolled: by their labels, where all prints were compared."""
    if one.search.preselected:
        return (subjects or one.search.subjects).fingers()
    compared = one.compared.numbers.tolist()
    return len({one.labels[n] for n in compared if n in one.labels and n not in skipped})


class ComparedProbe(NamedTuple):
    """A probe, prepared by the matcher of a search, and the prints that it was compared with."""

    search: Search
    probe: Any
    compared: Compared
    labels: dict[int, tuple[str, str]]
    """Subject and finger, by number, of all entries of the subjects of the compared prints."""


def compare_probe(
    search: Search,
    probe: Template,
    options: SearchOptions,
    *,
    subjects: Subjects | None = None,
    workers: int | None = None,
) -> ComparedProbe:
    """Compare a probe by threads, as `identify`; options are checked.

    After a pre-selection, further impressions of the fingers that rank first are compared, too.
    """
    prepared = call_matcher(search.matcher, "prepare", probe)
    with Threads(workers if packs(search.matcher) else 1) as threads:
        compared = search.compare(prepared, options, threads)
        numbers = compared.numbers.tolist()
        labels = {
            number: (subject, finger)
            for subject, fingers in (subjects or search.subjects).fingers_of(numbers).items()
            for finger, of_finger in fingers.items()
            for number in of_finger
            if number not in search.damaged
        }
        if search.preselected:
            best = {labels.get(n) for n in compared.most_similar(options.count).tolist()}
            others = {n for n, label in labels.items() if label in best}.difference(numbers)
            more = np.array(sorted(others), np.int64)
            compared = compared.and_also(search.compare_some(prepared, more, threads))
    return ComparedProbe(search, prepared, compared, labels)


def find_candidates(
    one: ComparedProbe, options: SearchOptions, fingers: int, *, skipped: Collection[int] = ()
) -> Identification:
    """Return the candidates for a probe that was compared, as `identify`; options are checked.

    So many `fingers` are enrolled.
    """
    scored = _Scored.of(one, options, skipped)
    best = scored.ranked()
    if options.listed == "subjects":
        best = _once_a_subject(best, scored.numbers, one.labels)
    ranked = list(islice(best, min(max(options.count, RIVALS + 1), len(one.search))))
    candidates = [
        _candidate(rank, k, one, scored, options)
        for rank, k in enumerate(ranked[: options.count], start=1)
    ]
    if options.listed != "impressions":  # whose rivals may be of the same finger
        expected = expected_by_chance(scored.scores[ranked], fingers)[: len(candidates)].tolist()
        candidates = [
            replace(candidate, expected_false=chance)
            for candidate, chance in zip(candidates, expected, strict=True)
        ]
    assert options.calibration is not None
    return Identification(
        enrolled=scored.enrolled,
        compared=len(scored.numbers),
        candidates=tuple(candidate for candidate in candidates if options.allow(candidate)),
        matcher=one.search.matcher.name,
        smallest_measured_fmr=score_to_fmr(options.calibration.largest_measured_score),
        fingers=fingers,
        effort=options.effort if one.search.preselected else None,
        passed_on=one.compared.passed_on,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Scored:
    """The prints that were compared with a probe and are not skipped, and their scores.

    For each print, `finger` is what is listed, a finger or an impression, `scores` has its score,
    and `impressions` how many it has; `singles` are the scores of single impressions. So many
    entries are `enrolled`.
    """

    numbers: NDArray[np.int64]
    similarities: NDArray[np.float64]
    singles: NDArray[np.float64]
    finger: NDArray[np.intp]
    scores: NDArray[np.float64]
    impressions: NDArray[np.intp]
    enrolled: int

    @classmethod
    def of(cls, one: ComparedProbe, options: SearchOptions, skipped: Collection[int]) -> _Scored:
        """Score prints, and fingers by all their impressions."""
        labels = {n: label for n, label in one.labels.items() if n not in skipped}
        compared = one.compared
        left = np.array([n in labels for n in compared.numbers.tolist()], np.bool_)
        numbers, similarities = compared.numbers[left], compared.similarities[left]
        keys: list[Any] = numbers.tolist()
        sizes: Counter[Any] = Counter(keys)
        if options.listed != "impressions":
            keys, sizes = [labels[number] for number in keys], Counter(labels.values())
        place = {key: k for k, key in enumerate(dict.fromkeys(keys))}
        finger = np.array([place[key] for key in keys], np.intp)
        of_listed = np.array([sizes[key] for key in place], np.intp)
        assert options.calibration is not None
        singles = options.calibration.scores(similarities)
        gone = np.isin(one.search.numbers, [*skipped]).sum() if skipped else 0
        return cls(
            numbers=numbers,
            similarities=similarities,
            singles=singles,
            finger=finger,
            scores=fused_scores(singles, finger, of_listed)[finger],
            impressions=of_listed[finger],
            enrolled=len(one.search) - int(gone),
        )

    def ranked(self) -> Iterator[int]:
        """Yield the most similar impression of each finger, those of highest score first."""
        order = np.lexsort((self.numbers, -self.similarities, -self.scores))
        _, first = np.unique(self.finger[order], return_index=True)
        for place in np.sort(first):
            yield int(order[place])


def _candidate(
    rank: int, k: int, one: ComparedProbe, scored: _Scored, options: SearchOptions
) -> Candidate:
    """Return print k as the candidate of a rank, with its comparison if that is wanted."""
    score, number, comparison = float(scored.scores[k]), int(scored.numbers[k]), None
    if options.transforms and score >= options.threshold:
        reference = one.search.print_of(number)
        if reference is not None:
            comparison = compare_prepared(one.search.matcher, one.probe, reference)
    fmr = score_to_fmr(score)
    return Candidate(
        rank=rank,
        number=number,
        similarity=float(scored.similarities[k]),
        score=score,
        fmr=fmr,
        expected_false=fmr * scored.enrolled,
        comparison=comparison,
        impressions=int(scored.impressions[k]),
        impression_score=float(scored.singles[k]),
    )


def _once_a_subject(
    ranked: Iterator[int], numbers: NDArray[np.int64], labels: dict[int, tuple[str, str]]
) -> Iterator[int]:
    """Yield the first impression of each subject."""
    seen = set()
    for place in ranked:
        subject, _ = labels[int(numbers[place])]
        if subject not in seen:
            seen.add(subject)
            yield place
