"""The default matcher: the paper's mesh and unit circle, drawn through paired minutiae.

It uses eq. (1), (3) and (4) of the paper, and is not its Fig. 7, which the matcher "paper" is. It
describes the neighbours of each minutia (`prepare`), compares neighbourhoods, relaxes the local
matches, triangulates the pairs, predicts further pairs by the mesh (eq. 4), compares places on the
unit circle (eq. 3), and fits a transform (eq. 1). docs/explanation/how_it_works.md has the steps.
"""

from __future__ import annotations

import threading
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np

from fpmatch.matching.compiled import COMPILED
from fpmatch.matching.constants.comparison import MIN_MINUTIAE
from fpmatch.matching.parameters import USUAL, MatchParameters
from fpmatch.matching.pipeline import evidence as score
from fpmatch.matching.pipeline.evidence import (
    Alignment,
    Evidence,
    amount_terms,
    as_similarity,
    main_reason,
)
from fpmatch.matching.prints.prepared import lies_off_ridges
from fpmatch.matching.result import Compared, Comparison, Matcher, nothing_found
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.matching.prints.prepared import PreparedTemplate
    from fpmatch.matching.reference.ridges import RidgeMap
    from fpmatch.templates.minutiae import Template

if COMPILED:
    from fpmatch.matching.pipeline._kernels._local_kernel import NeighbourIndex
    from fpmatch.matching.pipeline._kernels._pipeline_kernel import Pipeline
    from fpmatch.matching.prints._kernels._template_view_kernel import TemplateView
    from fpmatch.matching.prints.prepare import (
        encode,
        prefilter_of,
        prepare,
        score_descriptors,
    )

UNLIKE: Final = "the neighbourhoods of the two prints' minutiae have too little in common"
UNPAIRED: Final = "no minutiae of the two prints can be paired"
FEW_MINUTIAE: Final = 3  # fewer match by the ridges round them, if at all
MM2_PER_PX2: Final = (25.4 / STANDARD_DPI) ** 2
MIN_AT_SCALE: Final = 50  # descriptor similarity; 67 is the least of 984 prints of a wrong dpi
PREPARED_KEPT: Final = 64  # views and indices of prints, used last: a fifth of a megabyte each
LEAST_CAPACITY: Final = 64  # minutiae, of a thread's pipeline
_THREAD: Final = threading.local()


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

    def prepare(self, template: Template) -> PreparedTemplate:
        """Triangulate the minutiae of a template and describe their neighbourhoods."""
        if self.by_reference:
            from fpmatch.matching import reference as method  # noqa: PLC0415  (else not needed)

            return method.prepare(template, self.parameters)
        return prepare(template, self.parameters)

    def compare(
        self, probe: PreparedTemplate, reference: PreparedTemplate, *, in_any_case: bool = False
    ) -> Comparison:
        """Match locally, then globally, and score the evidence, unless the prefilter rejects them.

        The two are taken in the order of their content, so that exchanging them changes nothing
        but the direction of the transform. The prefilter rejects none if `in_any_case`.
        """
        a, b, swapped = _in_order(probe, reference)
        same = a.key == b.key
        if min(len(probe), len(reference)) < MIN_MINUTIAE:
            return nothing_found(too_few(probe, reference))
        if self.by_reference:
            return self._compare_by_reference(probe, reference, in_any_case=in_any_case)
        pipeline = pipeline_for(probe, max(len(probe), len(reference)), self.parameters)
        view = view_of(reference)
        if not (same or in_any_case) and (estimate := pipeline.rejected(view, swapped)) < 0.0:
            return nothing_found(UNLIKE, as_similarity(estimate))
        index_neighbours(pipeline, probe)
        estimate = pipeline.match(view, swapped)
        result = None
        if pipeline.best >= 0:
            zooms = a.to_500dpi, b.to_500dpi
            pairs, fitted, (c, s, x, y), entries = pipeline.result(
                a.index, b.index, *zooms, swapped
            )
            evidence = Evidence._make([*entries, pipeline.scorer.total, estimate])
            alignment = Alignment(complex(c, s), complex(x, y), evidence)
            result = _result(Similarity(*fitted[:4]), pairs, fitted[4], alignment)
        if same and not (result and _is_identity(probe, result)):
            # of two equal prints neither comes first: only the identity is its own inverse
            return self._compare_by_reference(probe, reference, in_any_case=True)
        return result or nothing_found(too_few(probe, reference) or UNPAIRED)

    def _compare_by_reference(
        self, probe: PreparedTemplate, reference: PreparedTemplate, *, in_any_case: bool
    ) -> Comparison:
        """Compare two prints by the steps of the reference."""
        from fpmatch.matching import reference as method  # noqa: PLC0415  (else not needed)

        a, b, swapped = _in_order(probe, reference)
        if not in_any_case and a.key != b.key:
            rejected = method.rejected(a, b, self.parameters)
            if rejected is not None:
                return nothing_found(UNLIKE, as_similarity(rejected))
        matched = method.match(a, b, self.parameters)
        if matched is None:
            return nothing_found(too_few(probe, reference) or UNPAIRED)
        pairing, alignment = matched
        transform, rms = method.transform_of(a, b, pairing)
        i = np.flatnonzero(pairing.partner >= 0)
        pairs = np.stack([a.index[i], b.index[pairing.partner[i]]], axis=1)
        if swapped:
            transform, rms = transform.inverse(), rms / transform.scale
            pairs = pairs[np.argsort(pairs[:, 1], kind="stable"), ::-1]
        return _result(transform, pairs, rms, alignment)

    def explain(
        self, probe: PreparedTemplate, reference: PreparedTemplate, comparison: Comparison
    ) -> Comparison:
        """Match two prints in any case, also those that the prefilter rejected.

        The result has the similarity of `comparison`, which `compare` returned, and the best
        transform there is.
        """
        if comparison.detail is not None:
            return comparison
        whole = self.compare(probe, reference, in_any_case=True)
        if whole.detail is None:
            return comparison
        return replace(whole, similarity=comparison.similarity)

    def compared(
        self, probe: PreparedTemplate, reference: PreparedTemplate, comparison: Comparison
    ) -> Compared | None:
        """Return how much of two prints was compared; None where nothing was aligned."""
        if comparison.detail is None:
            return None
        evidence: Evidence = comparison.detail.evidence
        first, *_ = _in_order(probe, reference)
        return Compared(
            minutiae=int(evidence.common),
            area_mm2=evidence.area * MM2_PER_PX2,
            ridge_agreement=evidence.ridges if evidence.cells else None,
            ridge_area_mm2=evidence.cells * first.region.step**2 * MM2_PER_PX2,
        )

    def ridge_map(
        self, probe: PreparedTemplate, reference: PreparedTemplate, comparison: Comparison
    ) -> RidgeMap | None:
        """Return where the ridges agree; None where they were not compared."""
        if comparison.detail is None or not comparison.detail.evidence.cells:
            return None
        from fpmatch.matching.reference.alignment import Pairing  # noqa: PLC0415  (else not needed)
        from fpmatch.matching.reference.ridges import ridge_map  # noqa: PLC0415

        a, b, swapped = _in_order(probe, reference)
        pairs = comparison.pairs
        of_a, of_b = pairs[:, ::-1].T if swapped else pairs.T
        partner = np.full(len(a), -1)
        partner[np.searchsorted(a.index, of_a)] = np.searchsorted(b.index, of_b)
        weight, move = (partner >= 0).astype(np.float64), comparison.detail[:2]
        pairing = Pairing(a.points, b.points, partner, weight, move, self.parameters)
        return ridge_map(a, b, pairing, swapped=swapped)

    def amount(self, prepared: PreparedTemplate, factor: float = 1.0) -> NDArray[np.float64]:
        """Return the amount of evidence in a print with `factor` times as much skin, shape (5,).

        It has no minutiae where they do not lie along the print's own ridges.
        """
        region = prepared.region
        area, shown = factor * region.inside * region.step**2, region.ridges is not None
        held = self.parameters.beyond_share > 0.0
        off = held and lies_off_ridges(prepared)
        minutiae = 0.0 if off else factor * len(prepared)
        _, x, _, y, _ = amount_terms(minutiae, area)
        return np.array([minutiae, area, shown, x, y])

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
        p, ours = self.parameters, reference.bit_descriptors
        if self.by_reference:
            from fpmatch.matching.reference import prefilter as method  # noqa: PLC0415  (else not needed)

            rescaled = (method.rescaled(probe, ratio, p) for ratio in ratios)
            scores = [method.descriptor_similarity(ours, bits, p) for bits in rescaled]
        else:
            known = probe.points, probe.quality, probe.neighbourhoods, probe.region, p
            tables = prefilter_of(ours, p)
            scores = [score_descriptors(tables, encode(*known, ratio)) for ratio in ratios]
        return [k for k, value in zip(ratios, scores, strict=True) if value >= MIN_AT_SCALE]


MATCHER: Final = UnitCircleMatcher()


def _in_order(
    probe: PreparedTemplate, reference: PreparedTemplate
) -> tuple[PreparedTemplate, PreparedTemplate, bool]:
    """Return the prints in the order of their content, and whether the reference comes first."""
    swapped = reference.key < probe.key
    return (reference, probe, True) if swapped else (probe, reference, False)


def _is_identity(side: PreparedTemplate, comparison: Comparison) -> bool:
    """Return whether each minutia is paired with the same one, by the transform that moves none."""
    own = np.column_stack([side.index, side.index])
    return np.array_equal(comparison.pairs, own) and comparison.detail[:2] == (1.0, 0.0)


def _result(
    transform: Similarity, pairs: NDArray[np.int32], rms_px: float, alignment: Alignment
) -> Comparison:
    evidence = alignment.evidence
    return Comparison(
        evidence.similarity,
        transform,
        pairs,
        rms_px,
        evidence.agreement,
        evidence.overlap,
        main_reason(evidence),
        detail=alignment,
    )


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


def pipeline_for(
    probe: PreparedTemplate, minutiae: int, parameters: MatchParameters = USUAL
) -> Pipeline:
    """Return the thread's own pipeline, which holds a probe.

    The larger of the two prints has so many `minutiae`.
    """
    pipeline: Pipeline | None = getattr(_THREAD, "pipeline", None)
    if (
        pipeline is None
        or pipeline.capacity < minutiae
        or pipeline.parameters is not parameters
        or pipeline.weights is not score.load_weights()
    ):
        capacity = max(LEAST_CAPACITY, 1 << (minutiae - 1).bit_length())
        pipeline = _THREAD.pipeline = Pipeline(capacity, parameters, score.load_weights())
    pipeline.load(view_of(probe))
    return pipeline


def index_neighbours(pipeline: Any, probe: PreparedTemplate) -> None:
    """Let a pipeline have the index of the neighbours of the probe that it holds."""
    pipeline.neighbours = _index_of(probe, threading.get_ident(), pipeline.parameters)


@lru_cache(maxsize=PREPARED_KEPT)
def view_of(prepared: PreparedTemplate) -> TemplateView:
    """Return a print as the kernels take it."""
    p, n = prepared, prepared.neighbourhoods
    return TemplateView(p.points, p.quality, n.count, n.frame, p.bit_descriptors, p.region)


@lru_cache(maxsize=PREPARED_KEPT)
def _index_of(
    prepared: PreparedTemplate, thread: int, parameters: MatchParameters
) -> NeighbourIndex:
    """Sort the neighbours of a print's minutiae so that similar ones are found at once.

    There is one a thread: an index has scratch arrays.
    """
    return NeighbourIndex(prepared.neighbourhoods.count, prepared.neighbourhoods.frame, parameters)
