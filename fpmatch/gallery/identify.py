"""Identification: the enrolled fingers that match a probe best."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.engine.in_threads import Threads
from fpmatch.errors import MatcherError, number_text
from fpmatch.fingers.finger import fused_scores
from fpmatch.gallery.prepared_search import (
    EXHAUSTIVE_UP_TO,
    Candidate,
    CandidateListSize,
    Preselection,
)
from fpmatch.indexing.loss import DEFAULT_LOSS
from fpmatch.matching.calibration import MAX_SCORE, load_calibration, score_to_fmr

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.entry import Entry
    from fpmatch.gallery.prepared_search import Each, Search
    from fpmatch.gallery.search import ConsolidatedFingers
    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Comparison
    from fpmatch.templates.minutiae import Template

PENETRATION_RATE: Final = 0.01  # share of a larger number of prints that is compared
MIN_CANDIDATE_LIST: Final = 1_000  # smallest number of prints that is compared of a larger one


@dataclass(frozen=True, slots=True)
class Identification:
    """The outcome of a search.

    The candidates come best first; of equal scores, the more similar, then the one enrolled first.
    After a pre-selection fewer prints are `compared` than are `enrolled`; one in stages is made for
    a `loss`, and each stage has `passed_on` so many prints. An FMR under `smallest_measured_fmr`,
    that of the calibration, is extrapolated.
    """

    enrolled: int
    compared: int
    candidates: tuple[Candidate, ...]
    matcher: str
    smallest_measured_fmr: float
    fingers: int = 0
    loss: float | None = None
    passed_on: tuple[int, ...] = ()

    @property
    def preselected(self) -> bool:
        """Whether only the prints on a candidate list were compared."""
        return self.compared < self.enrolled

    def candidate_dicts(self, entries: Sequence[Entry]) -> list[dict[str, Any]]:
        """Return the candidates, with their entries, as ``fpmatch identify --json`` prints them.

        ``transform``, ``pairs`` and ``rms_px`` are there if requested, the first and the last None
        where no transform was found.
        """
        return [
            {
                "rank": candidate.rank,
                "id": entry.id,
                **asdict(entry.label),
                "source": entry.source,
                "score": candidate.score,
                "fmr": candidate.fmr,
                "extrapolated": candidate.fmr < self.smallest_measured_fmr,
                "expected_false_matches": candidate.expected_false,
                "impressions": candidate.impressions,
                "impression_score": candidate.impression_score,
                **({} if candidate.comparison is None else _as_dict(candidate.comparison)),
            }
            for candidate, entry in zip(self.candidates, entries, strict=True)
        ]


def _as_dict(comparison: Comparison) -> dict[str, Any]:
    t, pairs = comparison.transform, len(comparison.pairs)
    if t is None:
        return {"transform": None, "pairs": pairs, "rms_px": None}
    transform = {"scale": t.scale, "rotation_deg": t.rotation_deg, "tx": t.tx, "ty": t.ty}
    return {"transform": transform, "pairs": pairs, "rms_px": comparison.rms_px}


def identify(
    search: Search,
    probe: Template,
    *,
    count: int = 10,
    threshold: float = 0.0,
    transforms: bool = False,
    calibration: Calibration | None = None,
    candidate_list: CandidateListSize = "auto",
    impressions: bool = False,
    consolidated: ConsolidatedFingers | None = None,
    subject_of: Callable[[int], str | None] | None = None,
    skipped: Collection[int] = (),
    loss: float = DEFAULT_LOSS,
    workers: int | None = None,
) -> Identification:
    """Find the enrolled fingers that a probe matches best.

    Parameters
    ----------
    search : Search
        From `open_search`.
    probe : Template
        The print to identify.
    count : int
        Largest number of candidates.
    threshold : float
        Smallest score of a candidate.
    transforms : bool
        Whether to return the transforms of the candidates, too.
    calibration : Calibration, optional
        Turns similarities into scores (default: that of the package).
    candidate_list : int, "auto" or "off"
        Number of prints to compare, see `candidate_list_size`. "auto": all of up to
        `EXHAUSTIVE_UP_TO` prints; of more, those that the stages of the index choose (see
        docs/explanation/searching.md).
    impressions : bool
        Whether each impression is a candidate, with its own score, rather than each finger with
        the score of its impressions together (see `fpmatch.fingers.finger`).
    consolidated : ConsolidatedFingers, optional
        Compares each candidate also with the consolidated template of its impressions and ranks
        the candidates again; the same fingers are candidates (default: this is not done).
    subject_of : callable, optional
        Returns the subject of the entry with a number: each subject is then a candidate once, by
        its best finger or impression (default: as often as it has any). None: no candidate.
    skipped : collection of int
        Numbers of entries that are treated as if they were not enrolled.
    loss : float
        Share of the mates that comparing all prints would find, with a score of at least
        `threshold`, and that the stages of the index may miss.
    workers : int, optional
        Threads that search (default: one a core); few prints are searched by one in any case. The
        candidates are the same to the last bit.

    Raises
    ------
    MatcherError
        If the matcher has no calibration, `threshold`, `count`, `loss` or `candidate_list` is out
        of range, the matcher has no bit descriptors for a candidate list, or both `impressions` and
        `consolidated` are given.
    GalleryError
        If `consolidated` cannot read the gallery.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from fpmatch import Minutiae, Template
    >>> from fpmatch.gallery.entry import Label, NewEntry
    >>> from fpmatch.gallery.gallery import open_gallery
    >>> from fpmatch.gallery.search import open_search
    >>> minutiae = Minutiae(x=[50, 90, 60, 70], y=[40, 50, 80, 60], angle=[0, 1, 2, 3])
    >>> template = Template(minutiae, 100, 100)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with open_gallery(Path(folder, "gallery.db"), create=True) as gallery:
    ...         _ = gallery.add([NewEntry(Label("ada"), "ada.tif", bytes(32), template)])
    ...         found = identify(open_search(gallery), template)
    >>> found.compared, found.candidates[0].number
    (1, 1)
    """
    check_limits(
        count, threshold, loss, impressions=impressions, consolidated=consolidated is not None
    )
    chosen = load_calibration(search.matcher.name) if calibration is None else calibration
    prepared = search.matcher.prepare(probe)
    if candidate_list != "auto":
        search = search.whole
    with Threads(workers) as threads:
        least = 0.0 if consolidated else threshold
        staged = search.preselect(prepared, loss, count, least, threads.map)
        places, similarities = _compare(
            search, prepared, staged, count, candidate_list, threads.map
        )
    gone = search.places_of(skipped)
    left = ~np.isin(places, gone)
    places, similarities = places[left], similarities[left]
    enrolled = len(search) - len(gone)
    sizes = search.finger_sizes
    less = np.unique(search.finger_of[gone], return_counts=True)
    fingers = len(sizes) - int(np.count_nonzero(sizes[less[0]] == less[1]))
    finger = places if impressions else search.finger_of[places]
    singles = chosen.scores(similarities)
    found_of, local = np.unique(finger, return_inverse=True)
    of_found = np.ones(len(found_of), np.intp) if impressions else sizes[found_of]
    if len(gone) and not impressions:
        of_found -= _counts(found_of, *less)
    sizes = of_found[local.ravel()]
    scores = fused_scores(singles, local.ravel(), of_found)[local.ravel()]
    candidates = []
    best = _ranked(scores, similarities, search.numbers[places], finger)
    if subject_of is not None:
        best = _once_a_subject(best, search.numbers[places], subject_of)
    for rank, k in enumerate(islice(best, min(count, len(search))), start=1):
        score = float(scores[k])
        fmr = score_to_fmr(score)
        wanted = transforms and (score >= threshold or consolidated is not None)
        comparison = (
            search.matcher.compare(prepared, search.references[places[k]]) if wanted else None
        )
        candidates.append(
            Candidate(
                rank=rank,
                number=int(search.numbers[places[k]]),
                similarity=float(similarities[k]),
                score=score,
                fmr=fmr,
                expected_false=fmr * (enrolled if impressions else fingers),
                comparison=comparison,
                impressions=int(sizes[k]),
                impression_score=float(singles[k]),
            )
        )
    if consolidated is not None:
        candidates = consolidated.rerank(prepared, candidates)
    return Identification(
        enrolled=enrolled,
        compared=len(similarities),
        candidates=tuple(one for one in candidates if one.score >= threshold),
        matcher=search.matcher.name,
        smallest_measured_fmr=score_to_fmr(chosen.largest_measured_score),
        fingers=fingers,
        loss=None if staged is None else staged.loss,
        passed_on=() if staged is None else staged.passed_on,
    )


def check_limits(
    count: int, threshold: float, loss: float, *, impressions: bool, consolidated: bool
) -> None:
    """Raise MatcherError if parameters of `identify` are out of range or exclude each other."""
    if count < 1:
        raise MatcherError(f"the number of candidates must be at least 1, not {count}")
    if not 0 <= threshold <= MAX_SCORE:
        raise MatcherError(
            f"a threshold is between 0 and {MAX_SCORE:g}, not {number_text(threshold)}"
        )
    if impressions and consolidated:
        raise MatcherError("single impressions are not compared with consolidated templates")
    if not 0 < loss < 1:
        raise MatcherError(f"a loss is between 0 and 1, not {number_text(loss)}")


def _compare(
    search: Search,
    probe: Any,
    staged: Preselection | None,
    count: int,
    candidate_list: CandidateListSize,
    each: Each,
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Return the places of the prints that were compared with a probe, and their similarities."""
    if staged is not None:
        similarities = search.similarities(probe, staged.places, each)
        more = search.further_impressions(staged.places, similarities, count)
        places = np.concatenate([staged.places, more])
        similarities = np.concatenate([similarities, search.similarities(probe, more, each)])
        order = np.argsort(places)
        return places[order], similarities[order]
    size = candidate_list_size(search, candidate_list)
    which = None if size is None else search.candidate_list(probe, max(size, count), each)
    places = np.arange(len(search)) if which is None else which
    return places, search.similarities(probe, which, each)


def _counts(
    wanted: NDArray[np.intp], listed: NDArray[np.intp], counts: NDArray[np.intp]
) -> NDArray[np.intp]:
    """Return the counts of wanted numbers, which ascend; 0 of those that are not listed."""
    of_wanted = np.zeros(len(wanted), np.intp)
    there = np.isin(listed, wanted)
    of_wanted[np.searchsorted(wanted, listed[there])] = counts[there]
    return of_wanted


def candidate_list_size(search: Search, requested: CandidateListSize = "auto") -> int | None:
    """Return the number of prints to compare with a probe; None for all.

    "auto": all of up to `EXHAUSTIVE_UP_TO` prints, and of more the share `PENETRATION_RATE`, but at
    least `MIN_CANDIDATE_LIST`; "off": all. Raises MatcherError if it is out of range, or the
    matcher has no bit descriptors.
    """
    total = len(search)
    if requested == "off":
        return None
    if requested == "auto":
        if total <= EXHAUSTIVE_UP_TO or not search.has_bit_descriptors:
            return None
        return max(MIN_CANDIDATE_LIST, round(PENETRATION_RATE * total))
    if not str(requested).isdecimal() or requested < 1:
        raise MatcherError(f"a candidate list is a number from 1 on, auto or off, not {requested}")
    if not search.has_bit_descriptors:
        raise MatcherError(f"the matcher {search.matcher.name} supports no candidate list")
    return requested if requested < total else None


def _ranked(
    scores: NDArray[np.float64],
    similarities: NDArray[np.float64],
    numbers: NDArray[np.int64],
    finger: NDArray[np.intp],
) -> Iterator[int]:
    """Yield the most similar impression of each finger, those of highest score first."""
    order = np.lexsort((numbers, -similarities, -scores))
    _, first = np.unique(finger[order], return_index=True)
    for place in np.sort(first):
        yield int(order[place])


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
