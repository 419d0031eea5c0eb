"""The first stage of a search: which prints of an index the next stage looks at."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.indexing.model import index_model
from fpmatch.indexing.terms import BUDGET, probe_terms

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from numpy.typing import NDArray

    from fpmatch.indexing.segment import Segment
    from fpmatch.matching.prints.prepare import PreparedTemplate

_NO_NUMBERS = np.empty(0, np.int64)
_BINS = 1 << 16  # values that votes can have
_REMOVED = _BINS - 1  # more than any print can have


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """Prints of an index, in the order of the segments, then of their prints.

    Parameters
    ----------
    segment, local : ndarray of int64, shape (K,)
        The segment of each print, and its number within.
    votes : ndarray of uint16, shape (K,)
        As `Segment.votes` gives them.
    """

    segment: NDArray[np.int64]
    local: NDArray[np.int64]
    votes: NDArray[np.uint16]

    def __len__(self) -> int:
        return len(self.segment)


def preselect(
    probe: PreparedTemplate,
    segments: Sequence[Segment],
    removed: NDArray[np.int64] = _NO_NUMBERS,
    passed_on: int = 1000,
    budget: float = BUDGET,
    each: Callable[..., Iterable[NDArray[np.uint16]]] = map,
    unoriented: float | None = None,
) -> Candidates:
    """Return the `passed_on` prints of all segments with the most votes.

    Of equals, those with the lowest numbers are taken, so that the same prints are passed on
    however they are divided into segments. Prints with the numbers `removed` are left out. `budget`
    sets how many postings are visited (see `probe_terms`). `each` is as the built-in `map`: it
    calls a function for each segment. `unoriented` is the `unoriented_share` of the whole index,
    where these segments are a part of it.
    """
    share = unoriented_share(segments) if unoriented is None else unoriented
    terms = probe_terms(probe, budget, unoriented=share)
    every = list(each(lambda segment: segment.votes(terms), segments))
    gone = np.unique(np.asarray(removed, np.int64))
    counts = np.zeros(_BINS, np.int64)  # of prints, by their votes
    for segment, votes in zip(segments, every, strict=True):
        place = np.searchsorted(segment.number, gone)
        inside = place < len(segment)
        place = place[inside][segment.number[place[inside]] == gone[inside]]
        votes[place] = _REMOVED
        counts += np.bincount(votes, minlength=_BINS)
    counts[_REMOVED] = 0
    better = np.cumsum(counts[::-1])[::-1]  # prints with at least so many votes
    if not every or better[0] <= passed_on:
        least, ties = 0, int(counts[0])
    else:
        least = int(np.flatnonzero(better > max(passed_on, 0))[-1])
        ties = max(passed_on, 0) - int(better[least] - counts[least])
    at = [np.flatnonzero(votes >= least) for votes in every]
    at = [a[v[a] != _REMOVED] for v, a in zip(every, at, strict=True)]
    chosen = Candidates(
        segment=np.repeat(np.arange(len(every)), [len(a) for a in at]),
        local=np.concatenate([*at, _NO_NUMBERS]),
        votes=np.concatenate([*map(np.take, every, at), np.empty(0, np.uint16)]),
    )
    equal = np.flatnonzero(chosen.votes == least)
    if ties >= len(equal):
        return chosen
    number = [segments[k].number[a] for k, a in enumerate(at)]
    order = np.argsort(np.concatenate(number)[equal], kind="stable")
    kept = np.ones(len(chosen), np.bool_)
    kept[equal[order[ties:]]] = False
    return Candidates(chosen.segment[kept], chosen.local[kept], chosen.votes[kept])


def unoriented_share(segments: Sequence[Segment]) -> float:
    """Return about which share of the prints have no ridge orientation, in quarters.

    Where they have one, it is still not known across some edges at the border of the print.
    """
    postings = sum(len(segment.posting) for segment in segments)
    unknown = sum(segment.unknown_curvatures for segment in segments) / max(postings, 1)
    expected = float(index_model().directions[..., -1].sum())
    share = (unknown - expected) / (1.0 - expected) if expected < 1.0 else 0.0
    return round(4 * max(share, 0.0)) / 4
