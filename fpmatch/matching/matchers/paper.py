"""Matcher "paper": the literal method of Choi, Lee and Lee on the positions of minutiae alone.

`fpmatch.pointset.paper.matcher` does the matching. This module converts positions to 500 dpi,
and the result to a `Comparison`. Directions, kinds and qualities are not used. A missing or
spurious minutia changes every one-ring that contains it, so the error rates are high: the matcher
is kept as the yardstick for the default one.

It decides as the paper does: two prints match where more than a share ρ of the minutiae of the
smaller template is paired. The calibrated score is reported, but decides only if a threshold is
given. The docstring of `fpmatch.pointset.paper.matcher` states what the
paper leaves open, the choices made, and where the method departs from Fig. 7.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.base.parameters import Ranged, parameter
from fpmatch.matching.result import Comparison, Matcher, nothing_found
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.pointset.paper.matcher import DEFAULT_RHO, UnitCircleParameters, match_prepared
from fpmatch.pointset.paper.one_rings import PreparedPoints, prepare_points
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from fpmatch.templates.minutiae import Template

UNALIGNED: Final = "no transform aligns minutiae of the probe with minutiae of the reference"


@dataclass(frozen=True, slots=True)
class PaperParameters(Ranged, UnitCircleParameters):
    """The parameters of the rings, and of the decision by the share of minutiae paired."""

    rho: float = parameter(
        DEFAULT_RHO,
        "match where more than this share of the smaller print's minutiae is paired; the paper "
        "also has 0.9 and 0.95, which reject most genuine pairs",
        0,
        1,
    )


class PaperMatcher(Matcher):
    """Compare templates by the paper's section 3.3; similarity is the share of minutiae matched.

    The arguments are `rho`, which decides, and the parameters of
    `fpmatch.pointset.paper.matcher.UnitCircleParameters`. λ is that of the middle part of the
    paper's Table 2, the best of its three on prints; ρ is 0.6, because two impressions of a finger
    overlap in part; docs/explanation/point_sets.md has the shares accepted.

    Examples
    --------
    >>> import numpy as np
    >>> from fpmatch import Minutiae, Template, verify
    >>> from fpmatch.matching.matchers.paper import PaperMatcher
    >>> xy = np.random.default_rng(7).uniform(20, 280, (2, 30))
    >>> template = Template(Minutiae(*xy, np.zeros(30)), width=300, height=300)
    >>> verify(template, template, matcher=PaperMatcher(rho=0.9)).match
    True
    """

    name = "paper"
    parameters: PaperParameters = PaperParameters(precision=0.61)  # the best of Table 2

    def __init__(self, **given: float | str) -> None:
        super().__init__(**given)
        self.rho = self.parameters.rho

    def prepare(self, template: Template) -> tuple[PreparedPoints, float]:
        """Map the one-rings of the minutiae at 500 dpi to the unit circle; also return the dpi."""
        xy = template.minutiae.xy.astype(np.float64) * (STANDARD_DPI / template.dpi)
        return prepare_points(xy), template.dpi

    def compare(
        self, probe: tuple[PreparedPoints, float], reference: tuple[PreparedPoints, float]
    ) -> Comparison:
        """Compare two prepared templates; the similarity is the share that match, 0 to 1."""
        (p, dpi), (q, to_dpi) = probe, reference
        match = match_prepared(p, q, self.parameters)
        if not isinstance(match.transform, Similarity):
            return nothing_found(UNALIGNED)
        to_reference, to_500dpi = Similarity(to_dpi / STANDARD_DPI), Similarity(STANDARD_DPI / dpi)
        return Comparison(
            similarity=match.matched_share,
            transform=to_reference.after(match.transform).after(to_500dpi),
            pairs=match.pairs,
            rms_px=match.rms * to_dpi / STANDARD_DPI,
        )


MATCHER: Final = PaperMatcher()
