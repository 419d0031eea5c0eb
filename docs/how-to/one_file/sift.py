"""Matcher "sift": minutiae are paired by the look of the image round them.

Lowe, "Distinctive image features from scale-invariant keypoints", IJCV 60 (2004), by OpenCV.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch import Similarity
from fpmatch.base.parameters import check_ranges, parameter
from fpmatch.matching.result import Comparison, Matcher, nothing_found

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.templates.minutiae import Template

FEWEST: Final = 3  # pairs
MOST_STRETCH: Final = 1.25


@dataclass(frozen=True, slots=True)
class Described:
    """Places of the minutiae in pixels, (N, 2), and SIFT descriptors of the image there."""

    xy: NDArray[np.float32]
    descriptor: NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class SiftParameters:
    """Descriptors and their transform."""

    diameter: float = parameter(12.0, "diameter of a key point", 2, 100, "px")
    near: float = parameter(10.0, "largest distance of a pair after the transform", 1, 100, "px")

    def __post_init__(self) -> None:
        check_ranges(self)


class SiftMatcher(Matcher):
    """Count the minutiae of like surroundings that one similarity transform maps to each other."""

    name = "sift"
    wants_image = True
    parameters = SiftParameters()

    def prepare(self, template: Template, image: NDArray[np.uint8]) -> Described:
        """Describe the image, dark ridges as uint8, round each minutia of its template."""
        m = template.minutiae
        if not len(m):
            return Described(np.empty((0, 2), np.float32), np.empty((0, 128), np.float32))
        clockwise = np.degrees(-m.angle.astype(np.float64)) % 360.0
        rows = zip(m.x.tolist(), m.y.tolist(), clockwise.tolist(), strict=True)
        points = [cv2.KeyPoint(x, y, self.parameters.diameter, turn) for x, y, turn in rows]
        return Described(m.xy.astype(np.float32), cv2.SIFT_create().compute(image, points)[1])

    def compare(self, probe: Described, reference: Described) -> Comparison:
        """Pair descriptors that are each other's nearest, and fit a transform to most of them."""
        swapped = reference.xy.tobytes() < probe.xy.tobytes()
        a, b = (reference, probe) if swapped else (probe, reference)  # exchange changes nothing
        if min(len(a.xy), len(b.xy)) < FEWEST:
            return nothing_found("too few minutiae")
        nearest = cv2.BFMatcher(cv2.NORM_L2, crossCheck=True).match(a.descriptor, b.descriptor)
        pairs = np.array([(one.queryIdx, one.trainIdx) for one in nearest], np.int32)
        cv2.setRNGSeed(0)
        places = a.xy[pairs[:, 0]], b.xy[pairs[:, 1]]
        near = self.parameters.near
        fitted, agree = cv2.estimateAffinePartial2D(*places, ransacReprojThreshold=near)
        if fitted is None:
            return nothing_found("no transform")
        (c, _, x), (s, _, y) = fitted.tolist()
        moved, pairs = Similarity(math.hypot(c, s), math.atan2(s, c), x, y), pairs[agree[:, 0] > 0]
        if len(pairs) < FEWEST or not 1 / MOST_STRETCH < moved.scale < MOST_STRETCH:
            return nothing_found("no transform")
        if swapped:
            moved, pairs = moved.inverse(), pairs[pairs[:, 1].argsort(), ::-1]
        share = len(pairs) / min(len(a.xy), len(b.xy))
        return Comparison(float(len(pairs)), moved, pairs, 0.0, share, 0.0)


MATCHER: Final = SiftMatcher()
