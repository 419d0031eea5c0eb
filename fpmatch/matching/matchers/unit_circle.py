"""The default matcher: the paper's unit circle, made tolerant and anchored by direction.

The steps are those of the paper's Fig. 7: triangulate and map the one-rings to the unit circle
(`prepare`), match them locally, let local matches propose a transform, overlay the prints and
count what agrees.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.matching.align import at_rest, kept, light_table
from fpmatch.matching.explain import explain, main_reason, rival_of
from fpmatch.matching.local import local_likeness, most_alike
from fpmatch.matching.one_to_many import MIN_MINUTIAE, similarities
from fpmatch.matching.prepare import PreparedTemplate, prepare
from fpmatch.matching.result import Comparison
from fpmatch.matching.score import evidence_on, gather_evidence, scales
from fpmatch.pointset.similarity import Similarity

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching._evidence_kernel import Scales
    from fpmatch.matching.align import Alignment
    from fpmatch.matching.prepared_many import PreparedMany
    from fpmatch.matching.score import Evidence
    from fpmatch.minutiae import Template

MIN_PAIRS_FOR_SCALE: Final = 6
MAX_STRETCH: Final = 1.25  # beyond what skin or a wrong resolution does: pairs too close together


class UnitCircleMatcher:
    """Compare prints by their Delaunay neighbourhoods on the unit circle.

    References
    ----------
    Choi, Lee, Lee, "Point pattern matching algorithm using unit-circle parametrization".
    """

    name = "unit-circle"

    def prepare(self, template: Template) -> PreparedTemplate:
        """Triangulate the minutiae and map their neighbourhoods to the unit circle."""
        return prepare(template)

    def compare(self, probe: PreparedTemplate, reference: PreparedTemplate) -> Comparison:
        """Match locally, then globally, and weigh what was found.

        The two are taken in the order of their content, so that exchanging them changes nothing
        but the direction of the transform.
        """
        swapped = reference.key < probe.key
        a, b = (reference, probe) if swapped else (probe, reference)
        if min(len(a), len(b)) < MIN_MINUTIAE:
            return _nothing(_too_few(probe, reference))
        laid = lay(a, b)
        if laid is None:
            return _nothing("no neighbourhood of one print is like one of the other")
        return _comparison(a, b, *laid, swapped=swapped)

    def explain(self, probe: PreparedTemplate, reference: PreparedTemplate) -> str:
        """Say why two prints do not match; looks for competing transforms too, unlike `compare`.

        Parameters
        ----------
        probe, reference : PreparedTemplate
            What `prepare` returned.

        Returns
        -------
        str
            The reason of `compare`, and what else speaks against one finger.
        """
        a, b = sorted((probe, reference), key=lambda side: side.key)
        laid = lay(a, b) if min(len(a), len(b)) >= MIN_MINUTIAE else None
        if laid is None:
            return self.compare(probe, reference).reason
        alignment, evidence = laid
        seeds = most_alike(local_likeness(a.neighbourhoods, b.neighbourhoods))
        return explain(probe, reference, evidence, rival_of(a, b, alignment, seeds))

    def similarities(
        self,
        probe: PreparedTemplate,
        references: PreparedMany,
        first: int = 0,
        last: int | None = None,
    ) -> NDArray[np.float64]:
        """Compare one print with many: to the last bit the similarities that `compare` finds.

        Parameters
        ----------
        probe : PreparedTemplate
            What `prepare` returned.
        references : PreparedMany
            Many such, packed.
        first, last : int
            Those from `first` up to, not including, `last` are compared (default: all).

        Returns
        -------
        ndarray of float64, shape (last - first,)
            The similarity to each, in their order.

        Examples
        --------
        >>> from fpmatch import Minutiae, Template
        >>> from fpmatch.matching.prepared_many import PreparedMany
        >>> minutiae = Minutiae(x=[50, 90, 60, 70], y=[40, 50, 80, 60], angle=[0, 1, 2, 3])
        >>> print_ = MATCHER.prepare(Template(minutiae, 100, 100))
        >>> many = PreparedMany.of([print_, print_])
        >>> found = MATCHER.similarities(print_, many)
        >>> found[1] == MATCHER.compare(print_, print_).similarity
        True
        """
        first, last, _ = slice(first, last).indices(len(references))
        found, left = similarities(probe, references, first, last)
        for k in left.tolist():
            found[k - first] = self.compare(probe, references[k]).similarity
        return found


MATCHER: Final = UnitCircleMatcher()


def lay(
    a: PreparedTemplate, b: PreparedTemplate, on: Scales | None = None
) -> tuple[Alignment, Evidence] | None:
    """Lay print A on print B, and weigh what that says.

    Parameters
    ----------
    a, b : PreparedTemplate
        Two prints, in the order of their content.
    on : Scales, optional
        What weighs; see `fpmatch.matching.score.scales`.

    Returns
    -------
    tuple of Alignment and Evidence, or None
        None where nothing of them is alike.
    """
    likeness = local_likeness(a.neighbourhoods, b.neighbourhoods)
    used = scales(len(b)) if on is None else on
    if a.key == b.key:  # neither comes first, and only lying still is its own inverse
        alignment = at_rest(a.points)
        return alignment, gather_evidence(a, b, alignment, likeness, used)
    seeds = most_alike(likeness)
    table = light_table(a.points, b.points, seeds=len(seeds))
    total = used.lay(a.for_kernels(), b.for_kernels(), table, seeds, len(seeds), likeness)
    return (kept(table), evidence_on(used, total)) if table.best_pairs else None


def _comparison(
    a: PreparedTemplate,
    b: PreparedTemplate,
    alignment: Alignment,
    evidence: Evidence,
    *,
    swapped: bool,
) -> Comparison:
    """Return the result in the user's order and in pixels of the two input images."""
    ia = np.flatnonzero(alignment.partner >= 0)
    ib = alignment.partner[ia]
    pa, pb = _in_input_pixels(a, ia), _in_input_pixels(b, ib)
    turned = Similarity(a.zoom / b.zoom, -math.atan2(*alignment.transform[1::-1]))  # y points down
    transform = _fit(pa, pb, turned, alignment.weight[ia])
    pairs = np.column_stack([a.index[ia], b.index[ib]])
    if swapped:
        transform = transform.inverse()
        pairs, pa, pb = pairs[:, ::-1], pb, pa
        pairs = pairs[np.argsort(pairs[:, 0], kind="stable")]
    residual = transform.apply(pa) - pb
    return Comparison(
        similarity=evidence.similarity,
        transform=transform,
        pairs=np.ascontiguousarray(pairs, np.int32),
        rms_px=float(np.sqrt((residual**2).sum(axis=1).mean())),
        agreement=evidence.agreement,
        overlap=evidence.overlap,
        reason=main_reason(evidence),
    )


def _in_input_pixels(print_: PreparedTemplate, index: NDArray[np.integer]) -> NDArray[np.float64]:
    """Return positions of minutiae, shape (K, 2), x right and y down, in pixels of the image."""
    x, y = print_.points[:2, index] / print_.zoom
    return np.column_stack([x, -y])


def _fit(
    source: NDArray[np.float64],
    target: NDArray[np.float64],
    turned: Similarity,
    weights: NDArray[np.float64],
) -> Similarity:
    """Fit the transform; where the positions cannot tell, scale and rotation are those of `turned`.

    Those are the scale of the resolutions and the rotation that directions had a part in.
    """
    if len(source) >= MIN_PAIRS_FOR_SCALE:
        free = Similarity.fit(source, target, weights)
        if 1 / MAX_STRETCH <= free.scale / turned.scale <= MAX_STRETCH:
            return free
    tx, ty = np.average(target - turned.apply(source), axis=0, weights=weights).tolist()
    return Similarity(turned.scale, turned.rotation, tx, ty)


def _nothing(reason: str) -> Comparison:
    return Comparison(0.0, None, np.empty((0, 2), np.int32), 0.0, 0.0, 0.0, reason)


def _too_few(probe: PreparedTemplate, reference: PreparedTemplate) -> str:
    """Say which side has too few minutiae to be compared."""
    few = [
        f"the {name} has no ridges"
        if not len(side) and not side.region.inside
        else f"the {name} has too few minutiae ({len(side)})"
        for name, side in (("probe", probe), ("reference", reference))
        if len(side) < MIN_MINUTIAE
    ]
    return "; ".join(few)
