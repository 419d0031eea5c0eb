"""What workers do for `fpmatch score`: compare the pairs of a chunk, and make their rows."""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.base.plugins import call_matcher, named
from fpmatch.errors import MatcherError
from fpmatch.gallery.batch.score_file import csv_lines
from fpmatch.gallery.batch.sources import unpack
from fpmatch.gallery.index.compare import PreparedPrints, packs, similarities
from fpmatch.matching.decision import DEFAULT_THRESHOLD, evidence_in, reachable_scores
from fpmatch.matching.result import (
    INCONCLUSIVE,
    MATCH,
    NO_MATCH,
    compare_prepared,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from fpmatch.gallery.batch.plan import PairChunk
    from fpmatch.gallery.batch.sources import StoredTemplate
    from fpmatch.gallery.listing.entry import Label
    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Matcher

PREPARED_KEPT: Final = 512  # prints last used that stay prepared


class Print(NamedTuple):
    """A print of a side; prints of a manifest have labels."""

    name: str
    finger: str
    label: Label | None
    stored: StoredTemplate


@dataclass(frozen=True, slots=True)
class ComparisonTask:
    """The pairs of a chunk, with the prints they need by ascending number."""

    pairs: PairChunk
    probes: Mapping[int, Print]
    references: Mapping[int, Print]


class Rows(NamedTuple):
    """The rows of a chunk, as lines of a file: how many pairs and rows, and how many failed."""

    lines: bytes
    pairs: int
    rows: int
    failed: int


class PairComparer:
    """Compare pairs, and write rows of `fpmatch.gallery.batch.score_file.COLUMNS`.

    Genuine pairs are known if a list states them, both sides are the `same` prints, or both are
    manifests, whose subjects are taken for the same persons. Without a calibration, scores are left
    empty. With a `threshold`, rows of lower scores are left out, but not rows of prints without a
    template, whose score is not known. The decision is that at the threshold, by default 40, or by
    the matcher's share of paired minutiae.
    """

    def __init__(
        self,
        matcher: Matcher,
        database: str = "",
        *,
        same: bool = False,
        calibration: Calibration | None = None,
        threshold: float | None = None,
    ) -> None:
        self.matcher, self._database, self._same = matcher, database, same
        self._calibration, self._threshold = calibration, threshold
        self._prepared: OrderedDict[bytes, tuple[Any, NDArray[np.float64]]] = OrderedDict()

    def rows(self, task: ComparisonTask) -> Rows:
        """Return the rows of some pairs."""
        chunk = task.pairs
        similarity, reachable = self.similarities(task)
        score = np.full(len(chunk), np.nan)
        if self._calibration is not None:
            score = self._calibration.scores(similarity)
        failed, kept = np.isnan(similarity), np.arange(len(chunk))
        if self._threshold is not None:
            kept = np.flatnonzero(failed | (score >= self._threshold))
        listed = np.full(len(chunk), -1) if chunk.genuine is None else chunk.genuine
        decision = self._outcomes(similarity, score, reachable)
        columns = (chunk.probe, chunk.reference, listed, similarity, score, decision)
        rows = [
            self._row(task.probes[i], task.references[j], *rest)
            for i, j, *rest in zip(*(column[kept].tolist() for column in columns), strict=True)
        ]
        return Rows(csv_lines(rows), len(chunk), len(rows), int(failed.sum()))

    def _row(
        self, one: Print, other: Print, listed: int, similarity: float, score: float, decision: str
    ) -> tuple[object, ...]:
        reason = ""
        if math.isnan(similarity):
            sides = {"probe": one.stored.reason, "reference": other.stored.reason}
            reason = "; ".join(f"{side}: {why}" for side, why in sides.items() if why)
        genuine = listed if listed >= 0 else self._genuine(one, other)
        numbers = ["" if math.isnan(value) else value for value in (similarity, score)]
        names = self.matcher.name, self._database, one.name, other.name
        quality = one.stored.quality, other.stored.quality
        return (*names, genuine, *numbers, decision, reason, *quality)

    def _genuine(self, one: Print, other: Print) -> int | None:
        """Return 1 or 0 where the prints indicate whether a pair is genuine, else None."""
        if self._same:
            return int(one.finger == other.finger)
        if one.label is None or other.label is None:
            return None
        unclear = bool(one.label.finger) != bool(other.label.finger)
        if unclear and one.label.subject == other.label.subject:
            return None
        return int(one.label.of_finger == other.label.of_finger)

    def _outcomes(
        self,
        similarity: NDArray[np.float64],
        score: NDArray[np.float64],
        reachable: NDArray[np.float64],
    ) -> NDArray[np.str_]:
        """Return the outcomes of `fpmatch.verify`; "" where nothing decides.

        A print without a template is inconclusive.
        """
        threshold = DEFAULT_THRESHOLD if self._threshold is None else self._threshold
        rho = self.matcher.rho if self._threshold is None else None
        if rho is None and self._calibration is None:
            return np.full(similarity.shape, "")
        matched = score >= threshold if rho is None else similarity > rho
        lacking = np.isnan(reachable) | (reachable < threshold)
        return np.where(matched, MATCH, np.where(lacking, INCONCLUSIVE, NO_MATCH))

    def similarities(self, task: ComparisonTask) -> NDArray[np.float64]:
        """Return the similarity of each pair and the reachable score, shape (2, pairs).

        They are not a number where a print has no template. A probe is compared at once with all
        its references, if the matcher has 1:N comparison: the results are the same to the last bit.
        """
        pairs = task.pairs
        there = {k: one for k, one in task.references.items() if one.stored.data is not None}
        place = {number: n for n, number in enumerate(there)}
        many = None
        if packs(self.matcher):
            many = PreparedPrints(self._print(one)[0] for one in there.values())
        similarity, reachable = both = np.full((2, len(pairs)), np.nan)
        usable = np.isin(pairs.reference, list(there))
        for number, probe in task.probes.items():
            rows = np.flatnonzero((pairs.probe == number) & usable)
            if probe.stored.data is None or not len(rows):
                continue
            numbers = pairs.reference[rows].tolist()
            references = [there[k] for k in numbers]
            if many is not None:
                some = many.take([place[k] for k in numbers])
                similarity[rows] = similarities(self.matcher, self._print(probe)[0], some)
            else:
                similarity[rows] = [self._similarity(probe, other) for other in references]
            evidence = np.stack([self._print(other)[1] for other in references])
            ours = self._print(probe)[1]
            reachable[rows] = reachable_scores(self.matcher, self._calibration, ours, evidence)
        return both

    def _similarity(self, probe: Print, reference: Print) -> float:
        """Compare two prints; an error of a plug-in has the names of both."""
        try:
            ours, theirs = self._print(probe)[0], self._print(reference)[0]
            return compare_prepared(self.matcher, ours, theirs).similarity
        except MatcherError as error:
            raise named(error, probe.name, reference.name) from error

    def _print(self, one: Print) -> tuple[Any, NDArray[np.float64]]:
        """Return a print as the matcher prepared it, and the amount of evidence in it."""
        data = one.stored.data
        assert data is not None
        if data not in self._prepared:
            template = unpack(data)
            prepared = call_matcher(self.matcher, "prepare", template)
            self._prepared[data] = prepared, evidence_in(self.matcher, template, prepared)
            if len(self._prepared) > PREPARED_KEPT:
                self._prepared.popitem(last=False)
        self._prepared.move_to_end(data)
        return self._prepared[data]
