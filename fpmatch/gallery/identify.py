"""Identification: who, of all that are enrolled, may have left a print."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.matching.calibration import MAX_SCORE, load_calibration, score_to_fmr
from fpmatch.matching.finger import fused_scores

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.gallery.consolidated import ConsolidatedFingers
    from fpmatch.gallery.search import Search
    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Comparison
    from fpmatch.minutiae import Template

Shortlist = int | Literal["auto", "off"]
"""How many prints a probe is compared with: so many, as many as `shortlist_size` says, or all."""

EXHAUSTIVE_UP_TO: Final = 20_000
"""The most prints all of which a probe is compared with, where nothing else is asked for."""

SHORTLIST_SHARE: Final = 0.01
"""Of more prints, the share that it is compared with."""

LEAST_SHORTLIST: Final = 1_000
"""The fewest of more prints that it is compared with."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """Hold one enrolled finger, or impression, that may be the probe's.

    Parameters
    ----------
    rank : int
        1 for the highest score.
    number : int
        Number of the entry of the impression; of a finger, of its most similar impression.
    similarity : float
        The matcher's own measure of that impression.
    score : float
        ``-10·log10(fmr)``, 0 to 100; of a finger, see `fpmatch.matching.finger`.
    fmr : float
        Rate at which comparisons with another finger, of as many impressions, score as high.
    expected_false : float
        How many of all fingers (or impressions) searched would score as high if none were the
        probe's: `fmr` times their number.
    comparison : Comparison or None
        Transform and pairs of that impression, where they were asked for.
    impressions : int
        How many impressions the score counts: all of the finger, or 1.
    impression_score : float
        The score of that impression by itself.
    """

    rank: int
    number: int
    similarity: float
    score: float
    fmr: float
    expected_false: float
    comparison: Comparison | None = None
    impressions: int = 1
    impression_score: float = 0.0


@dataclass(frozen=True, slots=True)
class Identification:
    """Hold the outcome of a search.

    Parameters
    ----------
    enrolled : int
        How many prints were searched.
    compared : int
        How many of them the probe was compared with: fewer where a shortlist was made.
    candidates : tuple of Candidate
        Those of the highest scores, best first; of equals, the more similar, then the one enrolled
        first.
    matcher : str
        Name of the matcher.
    fmr_reach : float
        Lowest FMR that the calibration data measure; a lower one is extrapolated.
    fingers : int
        How many fingers the prints searched are of.
    """

    enrolled: int
    compared: int
    candidates: tuple[Candidate, ...]
    matcher: str
    fmr_reach: float
    fingers: int = 0

    @property
    def shortlisted(self) -> bool:
        """Whether the probe was compared with a shortlist alone."""
        return self.compared < self.enrolled


def identify(
    search: Search,
    probe: Template,
    *,
    count: int = 10,
    threshold: float = 0.0,
    transforms: bool = False,
    calibration: Calibration | None = None,
    shortlist: Shortlist = "auto",
    impressions: bool = False,
    together: ConsolidatedFingers | None = None,
) -> Identification:
    """Find the enrolled fingers that a probe matches best.

    Parameters
    ----------
    search : Search
        From `open_search`.
    probe : Template
        The print to identify.
    count : int
        How many candidates, at most.
    threshold : float
        Score that a candidate must reach (default: any).
    transforms : bool
        Whether to find the transforms of the candidates, too.
    calibration : Calibration, optional
        Turns similarities into scores (default: the one that comes with the package).
    shortlist : int, "auto" or "off"
        How many prints to compare the probe with, those that the codes of all of them favour;
        or all ("off"); or all of a small gallery and a share of a large one,
        see `shortlist_size` ("auto"). About 99 in 100 of the prints that comparing all of a large
        gallery finds are in the shortlist; docs/explanation/searching.md states the loss.
    impressions : bool
        Whether each impression is a candidate of its own, by its own score, rather than each
        finger by the score that its impressions have together (see `fpmatch.matching.finger`).
    together : ConsolidatedFingers, optional
        Compares each candidate also with the consolidated template of its impressions, and ranks
        the candidates anew; which fingers are candidates stays (default: it is not done).

    Returns
    -------
    Identification
        The candidates.

    Raises
    ------
    MatcherError
        If the matcher has no calibration, `threshold`, `count` or `shortlist` is out of range,
        a number is asked of a matcher that has no shortlists, or single impressions are to be
        compared together.
    GalleryError
        If `together` cannot read the gallery.

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
    if count < 1:
        raise MatcherError(f"the number of candidates must be at least 1, not {count}")
    if not 0 <= threshold <= MAX_SCORE:
        raise MatcherError(f"a threshold lies from 0 to {MAX_SCORE:g}, not {threshold:g}")
    if impressions and together is not None:
        raise MatcherError("single impressions are not compared with consolidated templates")
    chosen = load_calibration(search.matcher.name) if calibration is None else calibration
    size = shortlist_size(search, shortlist)
    prepared = search.matcher.prepare(probe)
    which = None if size is None else search.shortlist(prepared, max(size, count))
    similarities = search.similarities(prepared, which)
    places = np.arange(len(search)) if which is None else which
    singles = chosen.scores(similarities)
    finger, sizes = search.finger_of, search.finger_sizes
    if impressions:
        finger, sizes = np.arange(len(search)), np.ones(len(search), np.intp)
    found_of, local = np.unique(finger[places], return_inverse=True)
    scores = fused_scores(singles, local.ravel(), sizes[found_of])[local.ravel()]
    candidates = []
    for rank, k in enumerate(
        _best(scores, similarities, search.numbers[places], finger[places], count).tolist(), start=1
    ):
        score = float(scores[k])
        fmr = score_to_fmr(score)
        wanted = transforms and (score >= threshold or together is not None)
        found = search.matcher.compare(prepared, search.references[places[k]]) if wanted else None
        candidates.append(
            Candidate(
                rank=rank,
                number=int(search.numbers[places[k]]),
                similarity=float(similarities[k]),
                score=score,
                fmr=fmr,
                expected_false=fmr * len(sizes),
                comparison=found,
                impressions=int(sizes[finger[places[k]]]),
                impression_score=float(singles[k]),
            )
        )
    if together is not None:
        candidates = together.ranked(prepared, candidates)
    candidates = [one for one in candidates if one.score >= threshold]
    return Identification(
        enrolled=len(search),
        compared=len(similarities),
        candidates=tuple(candidates),
        matcher=search.matcher.name,
        fmr_reach=score_to_fmr(chosen.largest_measured_score),
        fingers=len(search.finger_sizes),
    )


def shortlist_size(search: Search, shortlist: Shortlist = "auto") -> int | None:
    """Say how many prints a probe is compared with.

    Parameters
    ----------
    search : Search
        From `open_search`.
    shortlist : int, "auto" or "off"
        What is asked for; "auto" are all of up to `EXHAUSTIVE_UP_TO` prints, and of more
        `SHORTLIST_SHARE`, but `LEAST_SHORTLIST` at least.

    Returns
    -------
    int or None
        None for all.

    Raises
    ------
    MatcherError
        If it is out of range, or the matcher has no shortlists.
    """
    total = len(search)
    if shortlist == "off":
        return None
    if shortlist == "auto":
        if total <= EXHAUSTIVE_UP_TO or not search.has_shortlists:
            return None
        return max(LEAST_SHORTLIST, round(SHORTLIST_SHARE * total))
    if not str(shortlist).isdecimal() or shortlist < 1:
        raise MatcherError(f"a shortlist is a number from 1 on, auto or off, not {shortlist}")
    if not search.has_shortlists:
        raise MatcherError(f"the matcher {search.matcher.name} has no shortlists")
    return shortlist if shortlist < total else None


def _best(
    scores: NDArray[np.float64],
    similarities: NDArray[np.float64],
    numbers: NDArray[np.int64],
    finger: NDArray[np.intp],
    count: int,
) -> NDArray[np.intp]:
    """Return the indices of the most similar impressions of the `count` fingers of highest score.

    Of equals, the more similar, then the one of the lowest number comes first.
    """
    order = np.lexsort((numbers, -similarities, -scores))
    _, first = np.unique(finger[order], return_index=True)
    best: NDArray[np.intp] = order[np.sort(first)[:count]]
    return best
