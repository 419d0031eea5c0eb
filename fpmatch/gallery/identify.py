"""Identification: who, of all that are enrolled, may have left a print."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.matching.calibration import MAX_SCORE, load_calibration, score_to_fmr

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.gallery.search import Search
    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Comparison
    from fpmatch.minutiae import Template


@dataclass(frozen=True, slots=True)
class Candidate:
    """Hold one enrolled print that may be of the probe's finger.

    Parameters
    ----------
    rank : int
        1 for the most similar.
    number : int
        Number of its entry.
    similarity : float
        The matcher's own measure.
    score : float
        ``-10·log10(fmr)``, 0 to 100.
    fmr : float
        Rate at which single comparisons of different fingers score as high.
    expected_false : float
        How many of all prints compared would score as high if none were of the probe's finger:
        `fmr` times their number.
    comparison : Comparison or None
        Transform and pairs, where they were asked for.
    """

    rank: int
    number: int
    similarity: float
    score: float
    fmr: float
    expected_false: float
    comparison: Comparison | None = None


@dataclass(frozen=True, slots=True)
class Identification:
    """Hold the outcome of a search.

    Parameters
    ----------
    compared : int
        How many prints the probe was compared with.
    candidates : tuple of Candidate
        The most similar, best first; of equals, the one enrolled first.
    matcher : str
        Name of the matcher.
    fmr_reach : float
        Lowest FMR that the calibration data measure; a lower one is extrapolated.
    """

    compared: int
    candidates: tuple[Candidate, ...]
    matcher: str
    fmr_reach: float


def identify(
    search: Search,
    probe: Template,
    *,
    count: int = 10,
    threshold: float = 0.0,
    transforms: bool = False,
    calibration: Calibration | None = None,
) -> Identification:
    """Find the enrolled prints that are most similar to a probe.

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

    Returns
    -------
    Identification
        The candidates.

    Raises
    ------
    MatcherError
        If the matcher has no calibration, or `threshold` or `count` is out of range.

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
    chosen = load_calibration(search.matcher.name) if calibration is None else calibration
    prepared = search.matcher.prepare(probe)
    similarities = search.similarities(prepared)
    best = _best(similarities, search.numbers, count)
    candidates = []
    for rank, k in enumerate(best.tolist(), start=1):
        score = chosen.score(similarities[k])
        if score < threshold:
            break
        fmr = score_to_fmr(score)
        found = search.matcher.compare(prepared, search.references[k]) if transforms else None
        candidates.append(
            Candidate(
                rank=rank,
                number=int(search.numbers[k]),
                similarity=float(similarities[k]),
                score=score,
                fmr=fmr,
                expected_false=fmr * len(search),
                comparison=found,
            )
        )
    reach = score_to_fmr(chosen.reach)
    return Identification(len(search), tuple(candidates), search.matcher.name, reach)


def _best(
    similarities: NDArray[np.float64], numbers: NDArray[np.int64], count: int
) -> NDArray[np.intp]:
    """Return the indices of the `count` greatest similarities; of equals, the lowest number."""
    at_least = np.arange(len(similarities))
    if count < len(similarities):
        least = np.partition(similarities, -count)[-count]
        at_least = np.flatnonzero(similarities >= least)
    order = np.lexsort((numbers[at_least], -similarities[at_least]))
    return at_least[order[:count]]
