"""The default matcher: the paper's mesh and unit circle, drawn through paired minutiae.

It uses eq. (1), (3) and (4) of the paper, and is not its Fig. 7, which the matcher "paper" is. It
describes the neighbours of each minutia (`prepare`), compares neighbourhoods, relaxes the local
matches, triangulates the pairs, predicts further pairs by the mesh (eq. 4), compares places on the
unit circle (eq. 3), and fits a transform (eq. 1). docs/explanation/how_it_works.md has the steps.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, Final

import numpy as np

from fpmatch.matching.compiled import COMPILED
from fpmatch.matching.constants.comparison import (
    MAX_STRETCH,
    MIN_MINUTIAE,
    MIN_PAIRS_FOR_SCALE,
)
from fpmatch.matching.parameters import USUAL, MatchParameters
from fpmatch.matching.pipeline import evidence as score
from fpmatch.matching.pipeline.reasons import all_reasons
from fpmatch.matching.pipeline.score_model import amount_of_print, as_similarity
from fpmatch.matching.prints.prepared import lies_off_ridges
from fpmatch.matching.result import Compared, Comparison, Matcher, nothing_found
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.matching.pipeline.evidence import Evidence
    from fpmatch.matching.pipeline.match import Alignment
    from fpmatch.matching.prints.prepared import PreparedTemplate
    from fpmatch.matching.reference.alignment import Pairing
    from fpmatch.matching.reference.ridges import RidgeMap
    from fpmatch.templates.minutiae import Template

if COMPILED:
    from fpmatch.matching.pipeline._kernels._pipeline_kernel import fit_pairs
    from fpmatch.matching.pipeline.match import workspace_for
    from fpmatch.matching.prints.prepare import prepare

UNLIKE: Final = "the neighbourhoods of the two prints' minutiae have too little in common"
UNPAIRED: Final = "no minutiae of the two prints can be paired"
FEW_MINUTIAE: Final = 3  # fewer match by the ridges round them, if at all
MM2_PER_PX2: Final = (25.4 / STANDARD_DPI) ** 2
MIN_AT_SCALE: Final = 50  # descriptor similarity; 67 is the least of 984 prints of a wrong dpi


class UnitCircleMatcher(Matcher):
    """Compare prints by the Delaunay mesh of their pairs on the unit circle.

    Where the kernels are not compiled, the steps of `fpmatch.matching.reference` are taken.

    The arguments are the parameters in `fpmatch.matching.parameters`, which ``fpmatch
    doctor --matchers`` lists.

    References
    ----------
    Choi, Lee, Lee, "Point pattern matching algorithm using unit-circle parametrization".
    """

    name = "unit-circle"
    by_reference: ClassVar[bool] = not COMPILED
    parameters: MatchParameters = USUAL

    def prepare(self, template: Template, *_: NDArray[np.uint8]) -> PreparedTemplate:
        """Triangulate the minutiae of a template and describe their neighbourhoods."""
        if self.by_reference:
            from fpmatch.matching import reference as method  # noqa: PLC0415  (else not needed)

            return method.prepare(template, self.parameters)
        return prepare(template, self.parameters)

    def compare(self, probe: PreparedTemplate, reference: PreparedTemplate) -> Comparison:
        """Match locally, then globally, and score the evidence, unless the prefilter rejects them.

        The two are taken in the order of their content, so that exchanging them changes nothing
        but the direction of the transform.
        """
        a, b, swapped = _in_order(probe, reference)
        if min(len(a), len(b)) < MIN_MINUTIAE:
            return nothing_found(too_few(probe, reference))
        find = self._match_by_reference if self.by_reference else self._match_by_kernels
        rejected, compared = find(a, b, swapped=swapped)
        if rejected is not None:
            return nothing_found(UNLIKE, as_similarity(rejected))
        return compared or nothing_found(too_few(probe, reference) or UNPAIRED)

    def _match_by_kernels(
        self, a: PreparedTemplate, b: PreparedTemplate, *, swapped: bool
    ) -> tuple[float | None, Comparison | None]:
        """Return what stands for -ln(FMR) of a rejected pair, or the comparison if it pairs any."""
        probe, reference = (b, a) if swapped else (a, b)
        workspace = workspace_for(max(len(a), len(b)), self.parameters)
        workspace.load(probe)
        same = a.key == b.key
        rejected = None if same else workspace.rejected(reference, reference_first=swapped)
        if rejected is not None:
            return rejected, None
        matched = workspace.match(reference, reference_first=swapped)
        if same and not (matched and _is_identity(matched[0])):
            # of two equal prints neither comes first: only the identity is its own inverse
            return self._match_by_reference(a, b, swapped=swapped)
        return None, matched and _comparison(a, b, matched, swapped=swapped)

    def _match_by_reference(
        self, a: PreparedTemplate, b: PreparedTemplate, *, swapped: bool
    ) -> tuple[float | None, Comparison | None]:
        """Return the same by the steps of the reference."""
        from fpmatch.matching import reference as method  # noqa: PLC0415  (else not needed)

        rejected = None if a.key == b.key else method.rejected(a, b, self.parameters)
        matched = method.match(a, b, self.parameters) if rejected is None else None
        return rejected, matched and _comparison_by_reference(a, b, matched, swapped=swapped)

    def explain(
        self, probe: PreparedTemplate, reference: PreparedTemplate, comparison: Comparison
    ) -> Comparison:
        """Match two prints in any case, and give all reasons against one finger.

        The result has the similarity of `comparison`, which `compare` returned, and the best
        transform there is; competing transforms are among the reasons.
        """
        from fpmatch.matching import reference as method  # noqa: PLC0415  (else not needed)

        a, b, swapped = _in_order(probe, reference)
        p, whole = self.parameters, comparison
        if comparison.detail is None and min(len(a), len(b)) >= MIN_MINUTIAE:
            matched = method.match(a, b, p) or method.match(a, b, p, however_weak=True)
            if matched:
                whole = _comparison_by_reference(a, b, matched, swapped=swapped)
        if whole.detail is None:
            return comparison
        pairing, evidence = _pairing(a, b, whole.detail[0], p), whole.detail[1]
        competing = method.competing_pairs(a, b, pairing, p)
        reason = all_reasons(probe, reference, evidence, competing)
        return replace(whole, similarity=comparison.similarity, reason=reason)

    def compared(
        self, probe: PreparedTemplate, reference: PreparedTemplate, comparison: Comparison
    ) -> Compared | None:
        """Return how much of two prints was compared; None where nothing was aligned."""
        if comparison.detail is None:
            return None
        evidence: Evidence = comparison.detail[1]
        first = min(probe, reference, key=lambda side: side.key)
        return Compared(
            minutiae=evidence.common,
            area_mm2=evidence.area * MM2_PER_PX2,
            ridge_agreement=evidence.ridges if evidence.cells else None,
            ridge_area_mm2=evidence.cells * first.region.step**2 * MM2_PER_PX2,
        )

    def ridge_map(
        self, probe: PreparedTemplate, reference: PreparedTemplate, comparison: Comparison
    ) -> RidgeMap | None:
        """Return where the ridges agree; None where they were not compared."""
        if comparison.detail is None or not comparison.detail[1].cells:
            return None
        from fpmatch.matching.reference.ridges import ridge_map  # noqa: PLC0415  (else not needed)

        a, b, swapped = _in_order(probe, reference)
        pairing = _pairing(a, b, comparison.detail[0], self.parameters)
        return ridge_map(a, b, pairing, swapped=swapped)

    def amount(self, prepared: PreparedTemplate, factor: float = 1.0) -> NDArray[np.float64]:
        """Return the amount of evidence in a print with `factor` times as much skin, shape (5,).

        It has no minutiae where they do not lie along the print's own ridges.
        """
        region = prepared.region
        area, shown = factor * region.inside * region.step**2, region.ridges is not None
        held = self.parameters.beyond_share > 0.0
        off = held and lies_off_ridges(prepared)
        return amount_of_print(0.0 if off else factor * len(prepared), area, shown=shown)

    def typical_similarities(
        self, probe: NDArray[np.float64], references: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the similarities that half of the genuine comparisons of as much skin reach.

        The smaller of two prints bounds the skin that they share. `probe` and `references` are
        amounts of evidence, shape (..., 5). Measured on synthetic prints and parts of them.
        """
        typical = score.load_weights().typical(probe, references)
        enough = np.minimum(probe[..., 0], references[..., 0]) >= MIN_MINUTIAE
        return np.where(enough, np.logaddexp(0.0, typical), 0.0)

    def possible_scales(
        self, probe: PreparedTemplate, reference: PreparedTemplate, ratios: Sequence[float]
    ) -> list[float]:
        """Return the ratios at which the prints can match with a high score, by bit descriptors.

        The probe's lengths are multiplied by each.
        """
        from fpmatch.matching.reference.prefilter import (  # noqa: PLC0415  (else not needed)
            descriptor_similarity,
            rescaled,
        )

        p, ours = self.parameters, reference.bit_descriptors
        return [
            ratio
            for ratio in ratios
            if descriptor_similarity(ours, rescaled(probe, ratio, p), p) >= MIN_AT_SCALE
        ]


MATCHER: Final = UnitCircleMatcher()


def _in_order(
    probe: PreparedTemplate, reference: PreparedTemplate
) -> tuple[PreparedTemplate, PreparedTemplate, bool]:
    """Return the prints in the order of their content, and whether the reference comes first."""
    swapped = reference.key < probe.key
    return (reference, probe, True) if swapped else (probe, reference, False)


def _is_identity(alignment: Alignment) -> bool:
    """Return whether each minutia is paired with the same one, by the transform that moves none."""
    own = np.arange(len(alignment.partner))
    return bool((alignment.partner == own).all() and (alignment.transform == (1, 0, 0, 0)).all())


def _comparison(
    a: PreparedTemplate, b: PreparedTemplate, matched: tuple[Alignment, Evidence], *, swapped: bool
) -> Comparison:
    """Return the result in the user's order and in pixels of the two input images.

    Where the positions of few pairs do not determine it, the scale is that of the resolutions, and
    the rotation that of the alignment, which the directions contribute to.
    """
    alignment, evidence = matched
    c, s, _, _ = alignment.transform.tolist()
    pairs, fitted = np.empty((evidence.pairs, 2), np.int32), np.empty(5)
    prints = a.points, b.points, a.to_500dpi, b.to_500dpi, a.index, b.index
    limits = MIN_PAIRS_FOR_SCALE, MAX_STRETCH
    turn = 0.0 - math.atan2(s, c)  # y points down
    fit_pairs(*prints, alignment.partner, alignment.weight, turn, *limits, swapped, pairs, fitted)
    *transform, rms = fitted.tolist()
    return _result(Similarity(*transform), pairs, rms, matched)


def _comparison_by_reference(
    a: PreparedTemplate, b: PreparedTemplate, matched: tuple[Pairing, Evidence], *, swapped: bool
) -> Comparison:
    """Return the same of a pairing of the reference."""
    from fpmatch.matching.reference import transform_of  # noqa: PLC0415  (else not needed)

    pairing, _evidence = matched
    transform, rms = transform_of(a, b, pairing)
    i = np.flatnonzero(pairing.partner >= 0)
    pairs = np.stack([a.index[i], b.index[pairing.partner[i]]], axis=1)
    if swapped:
        transform, rms = transform.inverse(), rms / transform.scale
        pairs = pairs[np.argsort(pairs[:, 1], kind="stable"), ::-1]
    return _result(transform, pairs, rms, matched)


def _result(
    transform: Similarity,
    pairs: NDArray[np.int32],
    rms_px: float,
    matched: tuple[Alignment | Pairing, Evidence],
) -> Comparison:
    evidence, reason = matched[1], score.main_reason(matched[1])
    shares = evidence.agreement, evidence.overlap
    return Comparison(
        evidence.similarity, transform, pairs, rms_px, *shares, reason, detail=matched
    )


def _pairing(
    a: PreparedTemplate,
    b: PreparedTemplate,
    aligned: Alignment | Pairing,
    parameters: MatchParameters,
) -> Pairing:
    """Return what kernels or the reference have paired, as the reference has it."""
    from fpmatch.matching.reference.alignment import Pairing  # noqa: PLC0415  (else not needed)

    if isinstance(aligned, Pairing):
        return aligned
    c, s, x, y = aligned.transform.tolist()
    move, partner = (complex(c, s), complex(x, y)), aligned.partner.astype(np.intp)
    return Pairing(a.points, b.points, partner, aligned.weight, move, parameters)


def too_few(probe: PreparedTemplate, reference: PreparedTemplate) -> str:
    """Return which side has too few minutiae to match; "" if neither."""
    few = [
        f"the {name} has no ridges"
        if not len(side) and not side.region.inside
        else f"the {name} has too few minutiae ({len(side)})"
        for name, side in (("probe", probe), ("reference", reference))
        if len(side) < FEW_MINUTIAE
    ]
    return "; ".join(few)
