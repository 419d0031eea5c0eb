"""The default matcher: the paper's mesh and unit circle, drawn through paired minutiae.

It uses eq. (1), (3) and (4) of the paper, and is not its Fig. 7, which the matcher "paper" is. It
describes the neighbours of each minutia (`prepare`), compares neighbourhoods, relaxes the local
matches, triangulates the pairs, predicts further pairs by the mesh (eq. 4), compares places on the
unit circle (eq. 3), and fits a transform (eq. 1). docs/explanation/how_it_works.md has the steps.
"""

from __future__ import annotations

import threading
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np

from fpmatch.matching import reference as method
from fpmatch.matching.constants import COMPILED
from fpmatch.matching.parameters import USUAL, MatchParameters
from fpmatch.matching.pipeline import evidence as score
from fpmatch.matching.pipeline.evidence import Evidence, amount_terms, main_reason
from fpmatch.matching.prints import prepared as prints
from fpmatch.matching.reference.alignment import Pairing
from fpmatch.matching.reference.prefilter import descriptor_similarity
from fpmatch.matching.reference.ridges import ridge_map
from fpmatch.matching.result import Compared, Comparison, Matcher, nothing_found
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.matching.prints.prepared import PreparedTemplate
    from fpmatch.matching.reference.ridges import RidgeMap
    from fpmatch.templates.minutiae import Template

UNLIKE: Final = "the neighbourhoods of the two prints' minutiae have too little in common"
UNPAIRED: Final = "no minutiae of the two prints can be paired"
MM2_PER_PX2: Final = (25.4 / STANDARD_DPI) ** 2
MIN_AT_SCALE: Final = 60  # descriptor similarity; 67 is the least of 984 prints of a wrong dpi
PREPARED_KEPT: Final = 64  # views and indices of prints, used last: a fifth of a megabyte each
_THREAD: Final = threading.local()

if COMPILED:
    from fpmatch.matching.pipeline._kernels._local_kernel import NeighbourIndex
    from fpmatch.matching.pipeline._kernels._pipeline_kernel import Pipeline
    from fpmatch.matching.prints._kernels._template_view_kernel import TemplateView
    from fpmatch.matching.prints.prepare import encode, prefilter_of, prepare, score_descriptors

    view_of = lru_cache(maxsize=PREPARED_KEPT)(TemplateView)  # a print as the kernels take it


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
            return method.prepare(template, self.parameters)
        return prepare(template, self.parameters)

    def compare(
        self, probe: PreparedTemplate, reference: PreparedTemplate, *, in_any_case: bool = False
    ) -> Comparison:
        """Match locally, then globally, and score the evidence, unless the prefilter rejects them.

        The two are taken in the order of their content, so that exchanging them changes nothing
        but the direction of the transform. The prefilter rejects none if `in_any_case`.
        """
        swapped = reference.key < probe.key
        a, b = (reference, probe) if swapped else (probe, reference)
        if not len(a) or not len(b):
            return nothing_found(UNPAIRED)
        same = a.key == b.key
        if self.by_reference:
            rejected = 0.0 if in_any_case or same else method.rejected(a, b, self.parameters)
            matched = None if rejected else method.match(a, b, self.parameters)
        else:
            pipeline, view = pipeline_for(probe, self.parameters), view_of(reference)
            rejected = 0.0 if in_any_case or same else pipeline.rejected(view, swapped)
            matched = None if rejected else _matched_by(pipeline, view, a, b, swapped)
            if same:  # neither comes first: only the identity is its own inverse
                found = matched and (matched[0].move, matched[0].partner.tolist())
                if found != ((1 + 0j, 0j), [*range(len(a))]):
                    matched = method.match(a, b, self.parameters)
        if rejected:
            return nothing_found(UNLIKE, float(np.logaddexp(0.0, rejected)))
        if matched is None:
            return nothing_found(UNPAIRED)
        return AlignedComparison(a, b, swapped, *matched)

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
        whole.similarity = comparison.similarity
        return whole

    def amount(self, prepared: PreparedTemplate, factor: float = 1.0) -> NDArray[np.float64]:
        """Return the amount of evidence in a print with `factor` times as much skin, shape (5,).

        It has no minutiae where they do not lie along the print's own ridges.
        """
        region = prepared.region
        area, shown = factor * region.inside * region.step**2, region.ridges is not None
        if self.by_reference:
            off = prints.lies_off_ridges(prepared)
        else:
            off = view_of(prepared).lies_off_ridges()
        held = self.parameters.beyond_share > 0.0
        minutiae = 0.0 if held and off else factor * len(prepared)
        _, x, _, y, _ = amount_terms(minutiae, area)
        return np.array([minutiae, area, shown, x, y])

    def typical_similarities(
        self, probe: NDArray[np.float64], references: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the similarities that half of the genuine comparisons of as much skin reach.

        The smaller of two prints bounds the skin that they share. `probe` and `references` are
        amounts of evidence, shape (..., 5). Measured on synthetic prints and parts of them.
        """
        return np.logaddexp(0.0, score.load_weights().typical(probe, references))

    def possible_scales(
        self, probe: PreparedTemplate, reference: PreparedTemplate, ratios: Sequence[float]
    ) -> list[float]:
        """Return the ratios at which the prints can match with a high score, by bit descriptors.

        The probe's lengths are multiplied by each.
        """
        p, ours = self.parameters, reference.bit_descriptors
        coded, bins = prints.which_encoded(probe.quality), probe.bit_descriptors.direction_bin
        known = probe.points, coded, bins, probe.neighbourhoods, probe.region, p
        if self.by_reference:
            scores = [descriptor_similarity(ours, prints.encode(*known, k), p) for k in ratios]
        else:
            tables = prefilter_of(ours, p)
            scores = [score_descriptors(tables, encode(*known, k)) for k in ratios]
        return [k for k, value in zip(ratios, scores, strict=True) if value >= MIN_AT_SCALE]


class ReferenceMatcher(UnitCircleMatcher):
    """The default matcher as it is where no kernels are compiled: to change, and to measure."""

    name = "reference"
    by_reference = True


MATCHER: Final = UnitCircleMatcher()
REFERENCE: Final = ReferenceMatcher()


def _matched_by(
    pipeline: Pipeline, view: TemplateView, a: PreparedTemplate, b: PreparedTemplate, swapped: bool
) -> tuple[Pairing, Evidence] | None:
    """Match the probe with a reference; return pairs and evidence, None where nothing is paired."""
    index_neighbours(pipeline, b if swapped else a)
    estimate = pipeline.match(view, swapped)
    if pipeline.best < 0:
        return None
    partner, weight, (c, s, x, y), entries = (of[pipeline.best].copy() for of in pipeline.kept)
    move = complex(c, s), complex(x, y)
    size, p = len(a), pipeline.parameters
    pairing = Pairing(a.points, b.points, partner[:size], weight[:size], move, p)
    return pairing, Evidence._make([*entries.tolist(), pipeline.scorer.total, estimate])


class AlignedComparison(Comparison):
    """The comparison of prints that are aligned: A and B, in the order of their content.

    All but the similarity is made when it is read: of many comparisons only the best are shown.
    """

    def __init__(
        self,
        a: PreparedTemplate,
        b: PreparedTemplate,
        swapped: bool,
        pairing: Pairing,
        evidence: Evidence,
    ) -> None:
        self.similarity, self.detail = evidence.similarity, evidence
        self.pairing, self._order = pairing, (a, b, swapped)

    def __getattr__(self, name: str) -> Any:
        """Make what is not made yet; Python calls this where an attribute is missing."""
        if name not in Comparison.__slots__:
            raise AttributeError(name)
        a, b, swapped = self._order
        transform, rms = method.transform_of(a, b, self.pairing)
        i = np.flatnonzero(self.pairing.partner >= 0)
        pairs = np.stack([a.index[i], b.index[self.pairing.partner[i]]], axis=1)
        if swapped:
            transform, rms = transform.inverse(), rms / transform.scale
            pairs = pairs[np.argsort(pairs[:, 1], kind="stable"), ::-1]
        self.transform, self.rms_px, self.pairs = transform, rms, pairs
        e: Evidence = self.detail
        self.agreement, self.overlap, self.reason = e.agreement, e.overlap, main_reason(e)
        self.compared = Compared(
            minutiae=int(e.common),
            area_mm2=e.area * MM2_PER_PX2,
            ridge_agreement=e.ridges if e.cells else None,
            ridge_area_mm2=e.cells * a.region.step**2 * MM2_PER_PX2,
        )
        return getattr(self, name)

    def ridge_map(self) -> RidgeMap | None:
        """Return where the ridges agree; None where they were not compared."""
        a, b, swapped = self._order
        return ridge_map(a, b, self.pairing, swapped=swapped) if self.detail.cells else None


def pipeline_for(probe: PreparedTemplate, parameters: MatchParameters = USUAL) -> Pipeline:
    """Return the thread's own pipeline, which holds a probe."""
    pipeline: Pipeline | None = getattr(_THREAD, "pipeline", None)
    weights, p = score.load_weights(), parameters
    if pipeline is None or pipeline.parameters is not p or pipeline.weights is not weights:
        pipeline = _THREAD.pipeline = Pipeline(p.max_minutiae, p, weights)
    pipeline.load(view_of(probe))
    return pipeline


def index_neighbours(pipeline: Any, probe: PreparedTemplate) -> None:
    """Let a pipeline have the index of the neighbours of the probe that it holds."""
    pipeline.neighbours = _index_of(probe, threading.get_ident(), pipeline.parameters)


@lru_cache(maxsize=PREPARED_KEPT)
def _index_of(
    prepared: PreparedTemplate, thread: int, parameters: MatchParameters
) -> NeighbourIndex:
    """Sort the neighbours of a print's minutiae so that similar ones are found at once.

    There is one a thread: an index has scratch arrays.
    """
    return NeighbourIndex(prepared.neighbourhoods.count, prepared.neighbourhoods.frame, parameters)
