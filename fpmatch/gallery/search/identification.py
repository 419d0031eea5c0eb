"""What a search finds: candidates, and how many prints were compared."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import ArrayLike, NDArray

    from fpmatch.gallery.listing.entry import Entry
    from fpmatch.matching.result import Comparison


OF_SEARCHES: Final = ("enrolled", "compared", "fingers", "effort", "passed_on")
"""What is stated of a search for one probe, apart from its candidates."""
RIVALS: Final = 5  # others that are at least as similar as the one by which chance is measured


def expected_by_chance(scores: ArrayLike, among: int) -> NDArray[np.float64]:
    """Return how many of the searched are expected to score as high as each of the best, by chance.

    That is the FMR of the `scores`, (N,), times how many are searched, `among`: fingers or
    subjects. The FMR is an upper bound for many probes, so that the others of this search are
    asked, too: five score as high as the fifth best of them, and ten points above it a tenth of
    these. The lower number counts. Others that are prints of the same finger, up to four, change
    nothing.

    Examples
    --------
    >>> from fpmatch.gallery.search.identification import expected_by_chance
    >>> expected_by_chance([60, 30, 28, 27, 26, 25], 1_000_000).round(4).tolist()
    [0.0016, 1.5811, 2.5059, 3.1548, 3.9716, 6.2946]
    """
    given = np.asarray(scores, np.float64)
    expected: NDArray[np.float64] = among * 10.0 ** (-given / 10.0)
    if given.size > RIVALS:
        last, after = np.sort(given)[::-1][RIVALS - 1 : RIVALS + 1]
        if after > 0:
            rival = np.where(given >= last, after, last)  # of all but the one itself
            expected = np.minimum(expected, RIVALS * 10.0 ** ((rival - given) / 10.0))
    return expected


@dataclass(frozen=True, slots=True)
class Candidate:
    """One enrolled finger, or impression, that may be the probe's; rank 1 scores highest.

    `number` is that of the entry; of a finger, that of its most similar impression, to which
    `similarity`, `comparison` (if requested) and `impression_score` belong. `fmr` is the rate at
    which comparisons with another finger, of as many `impressions`, score as high, and `score` is
    ``-10·log10(fmr)``, 0 to 100; see `fpmatch.gallery.fingers.finger`. `expected_false` is how many
    of the searched fingers score as high if none is the probe's, by `expected_by_chance`; of
    impressions, `fmr` times their number.
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
class ComparedFinger:
    """The comparison of a probe, by its number from 0, with a finger of a subject.

    `score` is that of all `impressions` of the finger together; `number` is the entry of the most
    similar one.
    """

    probe: int
    number: int
    score: float
    impressions: int


@dataclass(frozen=True, slots=True)
class SubjectCandidate:
    """One subject whose fingers may be the probes'; rank 1 scores highest.

    `fmr` is the rate at which other subjects score as high, and `score` is ``-10·log10(fmr)``, 0 to
    100. `expected_false` is how many subjects score as high by chance; see `expected_by_chance`.
    """

    rank: int
    subject: str
    score: float
    fmr: float
    expected_false: float
    fingers: tuple[ComparedFinger, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Outcome:
    """What every search states; candidates come best first.

    After a pre-selection fewer prints are `compared` than are `enrolled`; it has an `effort`, and
    each stage has `passed_on` so many prints. An FMR under `smallest_measured_fmr`,
    that of the calibration, is extrapolated.
    """

    enrolled: int
    compared: int
    matcher: str
    smallest_measured_fmr: float
    effort: int | None = None
    passed_on: tuple[int, ...] = ()

    @property
    def preselected(self) -> bool:
        """Whether pre-selection left out prints, so that fewer were compared than are enrolled."""
        return self.compared < self.enrolled

    def is_extrapolated(self, candidate: Candidate | SubjectCandidate) -> bool:
        """Return whether the FMR of a candidate is smaller than any measured one."""
        return candidate.fmr < self.smallest_measured_fmr

    def _rates(self, candidate: Candidate | SubjectCandidate) -> dict[str, Any]:
        """Return the score of a candidate, and what it means, as JSON values."""
        return {
            "score": candidate.score,
            "fmr": candidate.fmr,
            "extrapolated": self.is_extrapolated(candidate),
            "expected_false_matches": candidate.expected_false,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Identification(_Outcome):
    """The outcome of a search: of equal scores, the more similar, then the one enrolled first.

    Each of the `candidates` has an entry.
    """

    candidates: tuple[Candidate, ...]
    fingers: int
    entries: tuple[Entry, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return all but the candidates and the calibration as JSON values."""
        return {name: getattr(self, name) for name in OF_SEARCHES}

    @property
    def numbers(self) -> list[int]:
        """The numbers of the entries of the candidates, as an audit states them."""
        return [candidate.number for candidate in self.candidates]

    def lowered(self, by: float, allow: Callable[[Candidate], bool]) -> Identification:
        """Return it with lower scores, as one of several searches for a print, if they allow it."""
        lowered = [
            replace(
                one,
                score=max(one.score - by, 0.0),
                fmr=min(one.fmr * 10.0 ** (by / 10.0), 1.0),
                expected_false=one.expected_false * 10.0 ** (by / 10.0),
                impression_score=max(one.impression_score - by, 0.0),
            )
            for one in self.candidates
        ]
        kept = [(c, e) for c, e in zip(lowered, self.entries, strict=True) if allow(c)]
        candidates, entries = zip(*kept, strict=True) if kept else ((), ())
        return replace(self, candidates=candidates, entries=entries)

    def candidate_dicts(self) -> list[dict[str, Any]]:
        """Return the candidates, with their entries, as ``fpmatch identify --json`` prints them.

        ``transform``, ``pairs`` and ``rms_px`` are there if requested, the first and the last None
        where no transform was found.
        """
        return [
            {
                "rank": candidate.rank,
                **_enrolled(entry),
                **self._rates(candidate),
                "impressions": candidate.impressions,
                "impression_score": candidate.impression_score,
                **({} if candidate.comparison is None else _as_dict(candidate.comparison)),
            }
            for candidate, entry in zip(self.candidates, self.entries, strict=True)
        ]


@dataclass(frozen=True, slots=True, kw_only=True)
class FusedIdentification(_Outcome):
    """The outcome of a search by several fingers.

    Of equal scores, the subject comes first whose compared fingers have the greater sum of scores,
    then the one enrolled first. `compared` is the most prints that a probe was compared with before
    subjects were compared by all fingers, and `passed_on` is the most for a probe, too. `entries`
    has the entries of the compared fingers, by number.
    """

    candidates: tuple[SubjectCandidate, ...]
    subjects: int
    entries: Mapping[int, Entry]

    @property
    def numbers(self) -> list[int]:
        """The numbers of the entries of all compared fingers, as an audit states them."""
        return [finger.number for candidate in self.candidates for finger in candidate.fingers]

    def candidate_dicts(self, probes: Sequence[str]) -> list[dict[str, Any]]:
        """Return the candidates as ``fpmatch identify --with --json`` prints them.

        `probes` are the names of the probes.
        """
        return [
            {
                "rank": one.rank,
                "subject": one.subject,
                **self._rates(one),
                "fingers": [
                    {
                        "probe": probes[f.probe],
                        **_enrolled(self.entries[f.number]),
                        "score": f.score,
                        "impressions": f.impressions,
                    }
                    for f in one.fingers
                ],
            }
            for one in self.candidates
        ]


def _enrolled(entry: Entry) -> dict[str, Any]:
    """Return number, label and source of an entry as JSON values."""
    return {"id": entry.id, **asdict(entry.label), "source": entry.source}


def _as_dict(comparison: Comparison) -> dict[str, Any]:
    """Return the transform to a candidate as JSON values."""
    t, pairs = comparison.transform, len(comparison.pairs)
    if t is None:
        return {"transform": None, "pairs": pairs, "rms_px": None}
    transform = {"scale": t.scale, "rotation_deg": t.rotation_deg, "tx": t.tx, "ty": t.ty}
    return {"transform": transform, "pairs": pairs, "rms_px": comparison.rms_px}
