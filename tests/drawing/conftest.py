"""A print with known ridges, and comparisons of it with a moved copy."""

import math

import cv2
import numpy as np
import pytest

from fpmatch.matching.verify import Verification
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.templates.minutiae import Minutiae, Template

PERIOD = 9.0
TRUE_TRANSFORM = Similarity(1.0, math.radians(12), 18.0, -9.0)
POSITIONS = np.array([[50.0, 60.0], [80.0, 40.0], [100.0, 110.0], [60.0, 120.0], [120.0, 70.0]])


@pytest.fixture(scope="session")
def probe_image():
    """Rings around a point off the middle, on bare paper outside a disc."""
    y, x = np.mgrid[:170, :180].astype(float)
    rings = 128 + 90 * np.cos(2 * np.pi * np.hypot(x - 70, (y - 95) * 1.2) / PERIOD)
    inside = np.hypot(x - 90, y - 85) < 72
    return np.where(inside, rings, 240).astype(np.uint8)


@pytest.fixture(scope="session")
def reference_image(probe_image):
    """The same rings, moved by the true transform."""
    moved = cv2.warpAffine(
        probe_image, TRUE_TRANSFORM.matrix, (190, 175), flags=cv2.INTER_CUBIC, borderValue=240
    )
    return np.asarray(moved, dtype=np.uint8)


@pytest.fixture(scope="session")
def sides(probe_image, reference_image):
    return probe_image, reference_image


def minutiae_at(positions, turn=0.0):
    xy = np.asarray(positions, dtype=float).reshape(-1, 2)
    n = np.arange(len(xy))
    return Minutiae(xy[:, 0], xy[:, 1], 0.7 * n - turn, n % 3, 20 * n)


@pytest.fixture
def compared(probe_image, reference_image):
    """Return a function that makes a Verification of the two prints, with fields replaced."""

    def make(**changes):
        height, width = probe_image.shape
        probe = Template(minutiae_at(POSITIONS), width, height)
        moved = TRUE_TRANSFORM.apply(POSITIONS) + np.array([1.0, -2.0])
        height, width = reference_image.shape
        reference = Template(minutiae_at(moved, TRUE_TRANSFORM.rotation), width, height)
        fields = {"match": True, "score": 52.0, "fmr": 10**-5.2, "threshold": 40.0}
        fields |= {"matcher": "unit-circle", "probe": probe, "reference": reference}
        found = {"similarity": 5.0, "transform": TRUE_TRANSFORM, "rms_px": 2.2}
        found |= {"pairs": np.array([[0, 0], [1, 1], [3, 3]], dtype=np.int32), "reason": ""}
        found |= {"agreement": 0.6, "overlap": 0.9, "compared": None}
        found |= {name: changes.pop(name) for name in found.keys() & changes.keys()}
        return Verification(**(fields | found | changes))

    return make
