"""Identification: the enrolled fingers that match a probe best."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from fpmatch.gallery.engine.in_threads import Threads
from fpmatch.gallery.fingers.finger import fused_scores
from fpmatch.gallery.index.compare import packs
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
    from collections.abc import Collection

    from fpmatch.gallery.search.search import Search, SearchOptions, Subjects
    from fpmatch.matching.result import Comparison
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
    compared = one.similarity.keys() - {*skipped}
    return len({one.labels[number] for number in compared if number in one.labels})


class ComparedProbe(NamedTuple):
    """A probe, prepared by the matcher of a search, and the prints that it was compared with.

    By number, `similarity` has these prints in the order of their entries, and `labels` subject and
    finger of all entries of their subjects. Stages of a pre-selection have `passed_on` so many.
    """

    search: Search
    probe: Any
    similarity: dict[int, float]
    labels: dict[int, tuple[str, str]]
    passed_on: tuple[int, ...]


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
        similarity, passed_on = search.compare(prepared, options, threads)
        labels = {
            number: (subject, finger)
            for subject, fingers in (subjects or search.subjects).fingers_of([*similarity]).items()
            for finger, of_finger in fingers.items()
            for number in of_finger
            if number not in search.damaged
        }
        if search.preselected:
            first = sorted(similarity, key=lambda n: (-similarity[n], n))[: options.count]
            best = {labels.get(number) for number in first}
            others = {n for n, label in labels.items() if label in best} - similarity.keys()
            similarity |= search.compare_some(prepared, sorted(others), threads)
    return ComparedProbe(search, prepared, dict(sorted(similarity.items())), labels, passed_on)


def find_candidates(
    one: ComparedProbe, options: SearchOptions, fingers: int, *, skipped: Collection[int] = ()
) -> Identification:
    """Return the candidates for a probe that was compared, as `identify`; options are checked.

    So many `fingers` are enrolled.
    """
    assert options.calibration is not None
    labels = {n: label for n, label in one.labels.items() if n not in skipped}
    scored = [(n, value) for n, value in one.similarity.items() if n in labels]
    numbers = np.array([n for n, _ in scored], np.int64)
    similarities = np.array([value for _, value in scored], np.float64)
    keys: list[Any] = numbers.tolist()  # what is listed, of each print
    sizes: Counter[Any] = Counter(keys)
    if options.listed != "impressions":
        keys, sizes = [labels[number] for number in keys], Counter(labels.values())
    place = {key: k for k, key in enumerate(dict.fromkeys(keys))}
    finger = np.array([place[key] for key in keys], np.intp)
    impressions = np.array([sizes[key] for key in place], np.intp)
    singles = options.calibration.scores(similarities)
    scores = fused_scores(singles, finger, impressions)[finger]
    order = np.lexsort((numbers, -similarities, -scores))
    once: dict[Any, int] = {}  # the best print of each subject, finger or impression
    for k in order.tolist():
        key = keys[k] if options.listed != "subjects" else labels[int(numbers[k])][0]
        once.setdefault(key, k)
    ranked = [*once.values()][: max(options.count, RIVALS + 1)]
    enrolled = len(one.search)
    if skipped:
        enrolled -= int(np.isin(one.search.numbers, [*skipped]).sum())
    fmr = [score_to_fmr(float(score)) for score in scores[ranked]]
    if options.listed == "impressions":  # whose rivals may be of the same finger
        expected = [rate * enrolled for rate in fmr]
    else:
        expected = expected_by_chance(scores[ranked], fingers).tolist()
    candidates = [
        Candidate(
            rank=rank + 1,
            number=int(numbers[k]),
            similarity=float(similarities[k]),
            score=float(scores[k]),
            fmr=fmr[rank],
            expected_false=expected[rank],
            impressions=int(impressions[finger[k]]),
            impression_score=float(singles[k]),
        )
        for rank, k in enumerate(ranked[: options.count])
    ]
    candidates = list(filter(options.allow, candidates))
    if options.transforms:
        candidates = [replace(c, comparison=_comparison(one, c.number)) for c in candidates]
    return Identification(
        enrolled=enrolled,
        compared=len(numbers),
        candidates=tuple(candidates),
        matcher=one.search.matcher.name,
        smallest_measured_fmr=score_to_fmr(options.calibration.largest_measured_score),
        fingers=fingers,
        effort=options.effort if one.search.preselected else None,
        passed_on=one.passed_on,
    )


def _comparison(one: ComparedProbe, number: int) -> Comparison | None:
    """Return the comparison of a probe with a print; None where that is gone."""
    reference = one.search.print_of(number)
    if reference is None:
        return None
    return compare_prepared(one.search.matcher, one.probe, reference)
