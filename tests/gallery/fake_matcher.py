"""A matcher whose similarities are known: those of the first minutiae's x."""

from __future__ import annotations

import numpy as np

from fpmatch.matching.result import Comparison
from fpmatch.minutiae import Minutiae, Template


class FakeMatcher:
    name = "fake"

    def prepare(self, template: Template) -> float:
        return float(template.minutiae.x[0])

    def compare(self, probe: float, reference: float) -> Comparison:
        similarity = max(0.0, 100.0 - abs(probe - reference))
        return Comparison(similarity, None, np.empty((0, 2), np.int32), 0.0, 0.0, 0.0, "fake")


MATCHER = FakeMatcher()


def template_at(x: float) -> Template:
    """Return the template that the matcher knows by `x`."""
    return Template(Minutiae([x], [1], [0]), 300, 300)
