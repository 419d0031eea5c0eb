"""Identification: the enrolled fingers that match a probe best."""

from __future__ import annotations

from collections import Counter
from contextlib import closing
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeVar

import numpy as np

from fpmatch.base.plugins import call_matcher, named
from fpmatch.errors import MatcherError
from fpmatch.gallery.fingers.finger import fused_scores
from fpmatch.gallery.search.identification import (
    RIVALS,
    Candidate,
    FusedIdentification,
    Identification,
    expected_by_chance,
)
from fpmatch.gallery.search.search import USUAL
from fpmatch.matching.calibration import allowance, score_to_fmr
from fpmatch.matching.decision import DEFAULT_THRESHOLD
from fpmatch.matching.result import compare_prepared
from fpmatch.prints.pair import FIRST_SHARE, other_resolutions

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Generator, Iterable
    from concurrent.futures import ThreadPoolExecutor

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.listing.entry import Entry
    from fpmatch.gallery.search.search import Search, SearchOptions
    from fpmatch.matching.result import Comparison
    from fpmatch.prints.reading import GivenPrint
    from fpmatch.templates.minutiae import Template

BATCH: Final = 16  # probes that are searched for together
Outcome = TypeVar("Outcome", Identification, FusedIdentification)


def identify(
    search: Search,
    probe: Template,
    options: SearchOptions = USUAL,
    *,
    workers: int | None = None,
    **changes: Any,
) -> Identification:
    """Find the enrolled fingers that a probe matches best, in a gallery as it is now.

    What is compared and listed is in `options`, some of them replaced by `changes`. So many
    `workers` are the threads that search (default: one a core; few prints are searched by one in
    any case). The candidates are the same to the last bit. An entry that has been removed since, or
    is damaged, is no candidate; the damaged ones are in `damaged` of the gallery.

    Raises MatcherError if the matcher has no calibration or an option is out of range; GalleryError
    if the gallery cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from fpmatch import Minutiae, Template
    >>> from fpmatch.gallery.listing.entry import Label
    >>> from fpmatch.gallery.store.rows import new_entry
    >>> from fpmatch.gallery.gallery import open_gallery
    >>> from fpmatch.gallery.search.search import Search
    >>> minutiae = Minutiae(x=[50, 90, 60, 70], y=[40, 50, 80, 60], angle=[0, 1, 2, 3])
    >>> template = Template(minutiae, 100, 100)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with open_gallery(Path(folder, "gallery.db"), create=True) as gallery:
    ...         _ = gallery.add([new_entry(Label("ada"), "ada.tif", bytes(32), template)])
    ...         result = identify(Search(gallery), template)
    >>> result.compared, result.candidates[0].number, result.entries[0].label.subject
    (1, 1, 'ada')
    """
    given = replace(options, **changes).checked(search.matcher)
    search.follow()
    with search.threads(workers) as threads:
        one = compare_probe(search, probe, given, threads)
    result, entries = with_entries(search, partial(find_candidates, one, given))
    return replace(result, entries=tuple(entries[number] for number in result.numbers))


def with_entries(
    search: Search, find: Callable[[Collection[int]], Outcome]
) -> tuple[Outcome, dict[int, Entry]]:
    """Return what is found without some entries, and the entries of what was found, by number.

    Those left out are damaged, or have been removed since the search was opened.
    """
    removed = set[int]()
    while True:
        result: Outcome = find(removed | search.gallery.damaged.keys())
        entries = {entry.id: entry for entry in search.gallery.entries_of(result.numbers)}
        if entries.keys() == {*result.numbers}:
            return result, entries
        removed |= {*result.numbers} - entries.keys()


def identify_given(
    search: Search, probe: GivenPrint, options: SearchOptions = USUAL, **how: Any
) -> tuple[GivenPrint, Identification]:
    """Identify an image as `identify` does, also at other resolutions if it states none.

    Where no candidate matches, those are tried that its ridges allow, unless prints that came with
    it decided. As with `fpmatch.prints.pair.verify_given`, each try has a share of the false match
    rate, the first one too, which lowers its scores. The print is returned as it was at the
    resolution of the candidates.
    """
    result = identify(search, probe.template, options, **how)
    others = other_resolutions(probe)
    if not others:
        return probe, result
    allow = replace(options, **{k: value for k, value in how.items() if hasattr(options, k)}).allow
    best = probe, result.lowered(allowance(FIRST_SHARE), allow)
    if _best(best[1]):
        return best
    share = allowance(1.0 - FIRST_SHARE, len(others))
    for other in map(probe.at, others):
        result = identify(search, other.template, options, **how).lowered(share, allow)
        if _best(result) > _best(best[1]):
            best = other, result
    return best


def _best(result: Identification) -> float:
    """Return the score of the first candidate where it is a match, else 0."""
    score = max((candidate.score for candidate in result.candidates), default=0.0)
    return score if score >= DEFAULT_THRESHOLD else 0.0


def identify_each(
    search: Search,
    probes: Iterable[tuple[str, Template | None]],
    options: SearchOptions,
    engine: Engine,
) -> Generator[Identification | None, None, None]:
    """Identify probes, given with their names, with an engine that is entered; None for no probe.

    Each worker opens the gallery: it must see its file or its server, and have its keys. Probes are
    drawn as they are needed. An error of a plug-in has the name of the probe.
    """
    left = iter(probes)
    batches = iter(lambda: list(islice(left, BATCH)), [])
    with closing(engine.map(_identify_batch, (search, options), batches)) as results:
        for outcomes, damaged in results:
            search.gallery.damaged |= damaged
            yield from outcomes


def _identify_batch(
    shared: tuple[Search, SearchOptions], batch: list[tuple[str, Template | None]]
) -> tuple[list[Identification | None], dict[int, str]]:
    """Return the outcomes for some probes, and the entries that are damaged."""
    search, options = shared
    outcomes: list[Identification | None] = []
    for name, probe in batch:
        try:
            outcome = None if probe is None else identify(search, probe, options, workers=1)
            outcomes.append(outcome)
        except MatcherError as error:
            raise named(error, name) from error
    return outcomes, dict(search.gallery.damaged)


class ComparedProbe(NamedTuple):
    """A probe, prepared by the matcher of a search, and the prints that it was compared with.

    By number, `similarity` has these prints, and `labels` subject and finger of all entries of
    their subjects. Stages of a pre-selection have `passed_on` so many.
    """

    search: Search
    probe: Any
    similarity: dict[int, float]
    labels: dict[int, tuple[str, str]]
    passed_on: tuple[int, ...]


def compare_probe(
    search: Search, probe: Template, options: SearchOptions, threads: ThreadPoolExecutor
) -> ComparedProbe:
    """Compare a probe by threads, as `identify`; options are checked.

    After a pre-selection, further impressions of the fingers that rank first are compared, too.
    """
    prepared = call_matcher(search.matcher, "prepare", probe)
    similarity, passed_on = search.compare(prepared, options, threads)
    labels = {
        number: (subject, finger)
        for number, subject, finger in search.gallery.impressions_of_subjects([*similarity])
        if number not in search.damaged
    }
    if search.preselected:
        first = sorted(similarity, key=lambda n: (-similarity[n], n))[: options.count]
        best = {labels.get(number) for number in first}
        others = {n for n, label in labels.items() if label in best} - similarity.keys()
        similarity |= search.compare_some(prepared, sorted(others), threads)
    return ComparedProbe(search, prepared, dict(sorted(similarity.items())), labels, passed_on)


def find_candidates(
    one: ComparedProbe, options: SearchOptions, skipped: Collection[int] = ()
) -> Identification:
    """Return the candidates for a probe that was compared, as `identify`; options are checked.

    Entries of the numbers in `skipped` are treated as if they were not enrolled.
    """
    assert options.calibration is not None
    labels = {n: label for n, label in one.labels.items() if n not in skipped}
    scored = [(n, value) for n, value in one.similarity.items() if n in labels]
    if one.search.preselected:
        fingers = one.search.fingers()
    else:
        fingers = len({labels[n] for n, _ in scored})
    numbers = np.array([n for n, _ in scored], np.int64)
    similarities = np.array([value for _, value in scored], np.float64)
    keys, sizes = [labels[n] for n, _ in scored], Counter(labels.values())
    place = {key: k for k, key in enumerate(dict.fromkeys(keys))}
    finger = np.array([place[key] for key in keys], np.intp)
    impressions = np.array([sizes[key] for key in place], np.intp)
    singles = options.calibration.scores(similarities)
    scores = fused_scores(singles, finger, impressions)[finger]
    order = np.lexsort((numbers, -similarities, -scores))
    once: dict[Any, int] = {}  # the best print of each subject or finger
    for k in order.tolist():
        once.setdefault(keys[k][0] if options.listed == "subjects" else keys[k], k)
    ranked = [*once.values()][: max(options.count, RIVALS + 1)]
    enrolled = int(np.isin(one.search.numbers, [*skipped], invert=True).sum())
    fmr = [score_to_fmr(float(score)) for score in scores[ranked]]
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
