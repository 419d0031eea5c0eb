"""What several tests share: templates and pictures of prints that never were."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import settings
from numpy.typing import NDArray

from fpmatch.minutiae import Minutiae, RidgeField, Template

# One core may be busy with something else: no deadline on single examples, and the same examples
# in every run.
settings.register_profile("fpmatch", deadline=None, derandomize=True, max_examples=50)
settings.load_profile("fpmatch")


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20240611)


@pytest.fixture
def template(rng: np.random.Generator) -> Template:
    """Return a template with every kind of minutia and a ridge field with a hole."""
    n = 30
    minutiae = Minutiae(
        x=rng.uniform(0, 388, n),
        y=rng.uniform(0, 374, n),
        angle=rng.uniform(0, 2 * np.pi, n),
        kind=rng.integers(0, 3, n),
        quality=rng.integers(0, 101, n),
    )
    mask = rng.random((23, 24)) < 0.7
    orientation = np.where(mask, rng.uniform(0, np.pi, mask.shape), np.nan)
    return Template(minutiae, 388, 374, 500.0, RidgeField(16.0, orientation, mask))


@pytest.fixture
def whorl() -> NDArray[np.uint8]:
    """Return a 240 x 220 picture of concentric ridges, 9 px apart, on a white ground."""
    y, x = np.mgrid[:240, :220].astype(float)
    radius = np.hypot(x - 110, (y - 120) * 0.9)
    ridges = 127 + 100 * np.cos(2 * np.pi * radius / 9)
    return np.where(radius < 100, ridges, 255).astype(np.uint8)
