"""Matcher "reference": the default matcher's method in plain numpy and scipy.

Its similarities are those of `unit_circle` up to rounding; see `fpmatch.matching.reference`, which
is what to change and to measure. The explanation is that of `unit_circle`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.matching import reference as method
from fpmatch.matching.matchers.unit_circle import UNLIKE, UNPAIRED, UnitCircleMatcher, too_few
from fpmatch.matching.pipeline.alignment import Alignment
from fpmatch.matching.pipeline.evidence import main_reason
from fpmatch.matching.pipeline.match import MIN_MINUTIAE
from fpmatch.matching.pipeline.score_model import as_similarity
from fpmatch.matching.result import Comparison, nothing_found

if TYPE_CHECKING:
    from fpmatch.matching.prints.prepared import PreparedTemplate
    from fpmatch.matching.reference.alignment import Pairing
    from fpmatch.templates.minutiae import Template


class ReferenceMatcher(UnitCircleMatcher):
    """Compare prints as `UnitCircleMatcher` does, by the steps of `fpmatch.matching.reference`."""

    name = "reference"

    def prepare(self, template: Template) -> PreparedTemplate:
        """Triangulate the minutiae of a template and describe their rings."""
        return method.prepare(template, self.parameters)

    def compare(self, probe: PreparedTemplate, reference: PreparedTemplate) -> Comparison:
        """Match two prints in the order of their content, unless the prefilter rejects them."""
        swapped = reference.key < probe.key
        a, b = (reference, probe) if swapped else (probe, reference)
        if min(len(a), len(b)) < MIN_MINUTIAE:
            return nothing_found(too_few(probe, reference))
        rejected = None if a.key == b.key else method.rejected(a, b, self.parameters)
        if rejected is not None:
            return nothing_found(UNLIKE, as_similarity(rejected))
        matched = method.match(a, b, self.parameters)
        if matched is None:
            return nothing_found(too_few(probe, reference) or UNPAIRED)
        pairing, evidence = matched
        transform, rms = method.transform_of(a, b, pairing)
        i = np.flatnonzero(pairing.partner >= 0)
        pairs = np.stack([a.index[i], b.index[pairing.partner[i]]], axis=1)
        if swapped:
            transform, rms = transform.inverse(), rms / transform.scale
            pairs = pairs[np.argsort(pairs[:, 1], kind="stable"), ::-1]
        return Comparison(
            similarity=evidence.similarity,
            transform=transform,
            pairs=pairs,
            rms_px=rms,
            agreement=evidence.agreement,
            overlap=evidence.overlap,
            reason=main_reason(evidence),
            detail=(_alignment(pairing), evidence),
        )


MATCHER: Final = ReferenceMatcher()


def _alignment(pairing: Pairing) -> Alignment:
    """Return a pairing as explanations and drawings read it."""
    (linear, shift), (_, place, direction, _) = pairing.move, pairing.mesh
    transform = np.array([linear.real, linear.imag, shift.real, shift.imag])
    predicted = np.stack([place.real, place.imag, direction.real, direction.imag])
    return Alignment(transform, pairing.partner.astype(np.int32), pairing.weight, predicted)
