"""Weights of the score made by hand, and prints for interpreted kernels, for tests of matching."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from fpmatch.matching import score
from fpmatch.matching.prepare import PreparedTemplate
from fpmatch.matching.score import NO_GLANCE, ScoreWeights

ALWAYS = -math.inf
NEVER = math.inf
"""Gates through which ridges are looked at, whatever the minutiae say, or not."""

DISMISSING = (9.0, 1.0, 33.0)
"""What codes must say, so that many prints are dismissed at a glance, and not all."""


def some_weights(
    gate: float = ALWAYS,
    bias: float = 0.4,
    glance: tuple[float, float, float] = NO_GLANCE,
    sure: float = math.inf,
) -> ScoreWeights:
    """Return weights under which the unpaired speak against one finger, all else for it."""
    middle = [1.5, -1.0, 0.9, 0.7, 0.3, 4.5]
    spread = [0.9, 0.4, 0.6, 0.16, 0.2, 0.6]
    weight = [3.0, 1.5, -4.0, 0.5, 3.5, 0.2]
    stranger = [0.7, -1.3, 1.3, 0.65, 0.15, 4.2]
    standard = np.array([middle, spread, weight, stranger])
    return ScoreWeights(standard, bias, glance, gate, sure, {"by": "hand"})


@contextmanager
def weighing(weights: ScoreWeights) -> Iterator[None]:
    """Let these weights stand for those in the package."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(score, "load_weights", lambda: weights)
        yield


def print_for(module: ModuleType, print_: PreparedTemplate) -> Any:
    """Return a print as the kernels see it, of another module than the package's own."""
    n, r = print_.neighbourhoods, print_.region
    found = module.Print(print_.points, print_.quality, n.count, n.frame)
    c = print_.codes
    found.set_codes(c.xy, c.turn, c.around, c.along)
    found.set_region(r.code, r.ridges, r.first_row, r.first_column, r.step, r.inside, r.has_flow)
    return found
