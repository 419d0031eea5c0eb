"""Identification: the enrolled fingers that match a probe best."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass, replace
from itertools import islice
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from fpmatch.gallery.fingers.finger import fused_scores
from fpmatch.gallery.search.identification import (
    RIVALS,
    Candidate,
    Identification,
    expected_by_chance,
)
from fpmatch.gallery.search.search import USUAL
from fpmatch.matching.calibration import score_to_fmr
from fpmatch.matching.result import compare_prepared, prepare_print

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.search.consolidated import ConsolidatedFingers
    from fpmatch.gallery.search.search import Search, SearchOptions
    from fpmatch.gallery.search.stages import Indices, Listed
    from fpmatch.templates.minutiae import Template


def identify(
    search: Search,
    probe: Template,
    options: SearchOptions = USUAL,
    *,
    consolidated: ConsolidatedFingers | None = None,
    subject_of: Callable[[int], str | None] | None = None,
    skipped: Collection[int] = (),
    workers: int | None = None,
    **changes: Any,
) -> Identification:
    """Find the enrolled fingers that a probe matches best.

    What is compared and listed is in `options`, some of them replaced by `changes`; `consolidated`
    reads the consolidated templates of an open gallery, and with it candidates are consolidated.
    `subject_of` returns the subject of the entry with a number: each subject is then a candidate
    once, by its best finger or impression (default: as often as it has any), and an entry without
    one (None) is no candidate. Entries of the numbers in `skipped` are treated as if they were not
    enrolled. So many `workers` are the threads that search (default: one a core; few prints are
    searched by one in any case). The candidates are the same to the last bit.

    Raises MatcherError if the matcher has no calibration or an option is out of range; GalleryError
    if `consolidated` cannot read the gallery.

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
    changes["consolidate"] = consolidated is not None
    given = replace(options, **changes)
    given = replace(given, all_mates=given.all_mates or bool(skipped))
    compared, given = compare_probe(search, probe, given, workers)
    return find_candidates(
        compared, given, consolidated=consolidated, subject_of=subject_of, skipped=skipped
    )


class ComparedProbe(NamedTuple):
    """A probe, prepared by the matcher of a search, and the prints that it was compared with."""

    search: Search
    probe: Any
    listed: Listed


def compare_probe(
    search: Search, probe: Template, options: SearchOptions, workers: int | None
) -> tuple[ComparedProbe, SearchOptions]:
    """Compare a probe by threads, as `identify`; return the options, too, which are checked."""
    checked = options.checked(search.matcher)
    (compared,) = compare_probes(search, [probe], checked, search.threads(workers))
    return compared, checked


def compare_probes(
    search: Search, probes: Sequence[Template], options: SearchOptions, engine: Engine
) -> list[ComparedProbe]:
    """Compare a few probes with the prints that the stages of a search list for each."""
    search = search.for_loss(options.loss)
    prepared = [prepare_print(search.matcher, probe, None) for probe in probes]
    with engine, closing(search.compare([prepared], options, engine)) as compared:
        (listed,) = compared  # of one batch
    return [ComparedProbe(search, *one) for one in zip(prepared, listed, strict=True)]


def find_candidates(
    compared: ComparedProbe,
    options: SearchOptions,
    *,
    consolidated: ConsolidatedFingers | None = None,
    subject_of: Callable[[int], str | None] | None = None,
    skipped: Collection[int] = (),
) -> Identification:
    """Return the candidates for a probe that was compared, as `identify`; options are checked."""
    search = compared.search
    scored = _Scored.of(compared, options, skipped)
    best = scored.ranked()
    if subject_of is not None:
        best = _once_a_subject(best, scored.numbers, subject_of)
    ranked = list(islice(best, min(max(options.count, RIVALS + 1), len(search))))
    candidates = [
        _candidate(rank, k, compared, scored, options)
        for rank, k in enumerate(ranked[: options.count], start=1)
    ]
    if consolidated is not None:
        candidates = consolidated.rerank(compared.probe, candidates)
    if options.listed != "impressions":  # whose rivals may be of the same finger
        others = scored.scores[ranked[options.count :]]
        scores = [*(one.score for one in candidates), *others]
        expected = expected_by_chance(scores, scored.fingers)[: len(candidates)].tolist()
        candidates = [
            replace(one, expected_false=chance)
            for one, chance in zip(candidates, expected, strict=True)
        ]
    assert options.calibration is not None
    return Identification(
        enrolled=scored.enrolled,
        compared=len(scored.similarities),
        candidates=tuple(one for one in candidates if options.allow(one)),
        matcher=search.matcher.name,
        smallest_measured_fmr=score_to_fmr(options.calibration.largest_measured_score),
        fingers=scored.fingers,
        loss=options.loss if search.in_stages else None,
        passed_on=compared.listed.passed_on,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Scored:
    """The prints that were compared with a probe and are not skipped, and their scores.

    For each print, `finger` is what is listed, a finger or an impression, `scores` has its score,
    and `impressions` how many it has; `singles` are the scores of single impressions. So many
    entries are `enrolled`, of so many `fingers`.
    """

    places: Indices
    numbers: NDArray[np.int64]
    similarities: NDArray[np.float64]
    singles: NDArray[np.float64]
    finger: Indices
    scores: NDArray[np.float64]
    impressions: Indices
    enrolled: int
    fingers: int

    @classmethod
    def of(
        cls, compared: ComparedProbe, options: SearchOptions, skipped: Collection[int]
    ) -> _Scored:
        """Score prints, and fingers by all their impressions."""
        search = compared.search
        gone, sizes = search.places_of(skipped), search.finger_sizes
        left = ~np.isin(compared.listed.compared, gone)
        places = compared.listed.compared[left]
        similarities = compared.listed.similarities[left]
        if len(gone):
            sizes = sizes - np.bincount(search.finger_of[gone], minlength=len(sizes))
        single = options.listed == "impressions"
        listed, finger = np.unique(
            places if single else search.finger_of[places], return_inverse=True
        )
        of_listed = np.ones(len(listed), np.intp) if single else sizes[listed]
        assert options.calibration is not None
        singles = options.calibration.scores(similarities)
        finger = finger.ravel()
        return cls(
            places=places,
            numbers=search.numbers[places],
            similarities=similarities,
            singles=singles,
            finger=finger,
            scores=fused_scores(singles, finger, of_listed)[finger],
            impressions=of_listed[finger],
            enrolled=len(search) - len(gone),
            fingers=int(np.count_nonzero(sizes)),
        )

    def ranked(self) -> Iterator[int]:
        """Yield the most similar impression of each finger, those of highest score first."""
        order = np.lexsort((self.numbers, -self.similarities, -self.scores))
        _, first = np.unique(self.finger[order], return_index=True)
        for place in np.sort(first):
            yield int(order[place])


def _candidate(
    rank: int, k: int, compared: ComparedProbe, scored: _Scored, options: SearchOptions
) -> Candidate:
    """Return print k as the candidate of a rank, with its comparison if that is wanted."""
    search, score = compared.search, float(scored.scores[k])
    comparison = None
    if options.transforms and (score >= options.threshold or options.consolidate):
        reference = search.print_at(int(scored.places[k]))
        comparison = compare_prepared(search.matcher, compared.probe, reference)
    fmr = score_to_fmr(score)
    return Candidate(
        rank=rank,
        number=int(scored.numbers[k]),
        similarity=float(scored.similarities[k]),
        score=score,
        fmr=fmr,
        expected_false=fmr * scored.enrolled,
        comparison=comparison,
        impressions=int(scored.impressions[k]),
        impression_score=float(scored.singles[k]),
    )


def _once_a_subject(
    ranked: Iterator[int], numbers: NDArray[np.int64], subject_of: Callable[[int], str | None]
) -> Iterator[int]:
    """Yield the first impression of each subject."""
    seen = set()
    for place in ranked:
        subject = subject_of(int(numbers[place]))
        if subject is not None and subject not in seen:
            seen.add(subject)
            yield place
