"""Matcher "hough": every pair of minutiae votes for a rotation and shift.

Ratha, Karu, Chen, Jain, "A real-time matching system for large fingerprint databases", PAMI 18
(1996), without scale: positions are converted to 500 dpi.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch import Similarity
from fpmatch.matching.result import Comparison, Matcher
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.templates.minutiae import Template


@dataclass(frozen=True, slots=True)
class Prepared:
    """Positions at 500 dpi, directions in radians, and the resolution of the image."""

    xy: NDArray[np.float64]
    angle: NDArray[np.float64]
    dpi: float


@dataclass(frozen=True, slots=True)
class HoughMatcher(Matcher):
    """Compare templates by votes; lengths in pixels at 500 dpi, rotations in radians."""

    name: str = "hough"
    cell_px: float = 20.0
    cell_turn: float = np.radians(12)
    near_px: float = 15.0

    def prepare(self, template: Template) -> Prepared:
        """Return what `compare` needs of a template."""
        minutiae = template.minutiae
        xy = minutiae.xy.astype(np.float64) * (STANDARD_DPI / template.dpi)
        return Prepared(xy, minutiae.angle.astype(np.float64), template.dpi)

    def compare(self, probe: Prepared, reference: Prepared) -> Comparison:
        """Compare two prepared templates; the order of the arguments does not change the score."""
        if probe.xy.tobytes() <= reference.xy.tobytes():
            return self._compare(probe, reference)
        found = self._compare(reference, probe)
        if found.transform is None:
            return found
        pairs = found.pairs[np.argsort(found.pairs[:, 1]), ::-1]
        rms = found.rms_px * reference.dpi / probe.dpi
        return replace(found, transform=found.transform.inverse(), pairs=pairs, rms_px=rms)

    def _compare(self, p: Prepared, q: Prepared) -> Comparison:
        votes = self._votes(p, q)
        if len(votes) < 3:
            return _nothing("no rotation and shift has more than two votes")
        move = Similarity.fit(p.xy[votes[:, 0]], q.xy[votes[:, 1]], with_scale=False)
        pairs = self._pairs(move.apply(p.xy), q.xy)
        if len(pairs) < 3:
            return _nothing("fewer than three minutiae coincide")
        apart = move.apply(p.xy[pairs[:, 0]]) - q.xy[pairs[:, 1]]
        share = len(pairs) ** 2 / (len(p.xy) * len(q.xy))
        to_probe, to_reference = p.dpi / STANDARD_DPI, q.dpi / STANDARD_DPI
        return Comparison(
            similarity=share,
            transform=Similarity(to_reference).after(move).after(Similarity(1 / to_probe)),
            pairs=pairs,
            rms_px=float(np.sqrt((apart**2).sum(axis=1).mean())) * to_reference,
            agreement=share,
            overlap=len(pairs) / min(len(p.xy), len(q.xy)),
        )

    def _votes(self, p: Prepared, q: Prepared) -> NDArray[np.intp]:
        """Return the pairs (i, j) in the cell of rotation and shift with the most votes."""
        i, j = (side.ravel() for side in np.indices((len(p.xy), len(q.xy))))
        # directions are counter-clockwise, the rotation of a transform is clockwise
        turn = np.mod(p.angle[i] - q.angle[j], 2 * np.pi)
        cosine, sine = np.cos(turn), np.sin(turn)
        x, y = p.xy[i].T
        shift = q.xy[j] - np.column_stack([cosine * x - sine * y, sine * x + cosine * y])
        cells = np.column_stack([turn / self.cell_turn, shift / self.cell_px])
        best = np.empty((0, 2), np.intp)
        for offset in (0.0, 0.5):  # two grids, so that no border divides a cluster in both
            _, cell, size = np.unique(
                np.floor(cells + offset), axis=0, return_inverse=True, return_counts=True
            )
            if len(size) and size.max() > len(best):
                chosen = cell.ravel() == size.argmax()
                best = np.column_stack([i[chosen], j[chosen]])
        return best

    def _pairs(self, moved: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.int32]:
        """Return the pairs of mutual nearest neighbours within the tolerance."""
        distance = np.hypot(*(moved[:, None] - q).T).T
        nearest, back = distance.argmin(axis=1), distance.argmin(axis=0)
        i = np.arange(len(moved))
        kept = (back[nearest] == i) & (distance[i, nearest] <= self.near_px)
        return np.column_stack([i[kept], nearest[kept]]).astype(np.int32)


def _nothing(why: str) -> Comparison:
    return Comparison(0.0, None, np.empty((0, 2), np.int32), 0.0, 0.0, 0.0, why)


MATCHER: Final = HoughMatcher()
