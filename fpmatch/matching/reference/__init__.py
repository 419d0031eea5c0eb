"""The default method, which uses eq. (1), (3) and (4) of the paper, in numpy and scipy.

The algorithm of the paper's Fig. 7 itself is `fpmatch.pointset.paper.matcher`.

Two prints are prepared: each is *triangulated*, and the *rings* of its minutiae are described
(`neighbourhood`). `match` compares them: the *local match* (`neighbourhood`), *relaxed* so that
local matches that agree support each other (`relaxation`); *pairs* that *grow* over their mesh on
the unit circle by eq. (3) and (4) (`alignment`, `pair_mesh`); the *ridges* (`ridges`); the
*evidence*, its *bounds* and the *score* (`evidence`). `transform_of` fits eq. (1) in the pixels of
the images. Before `match`, `rejected` applies the *prefilter* (`prefilter`). The area of a print is
a `fpmatch.matching.prints.prepared.PrintArea`; `fpmatch.matching.verify` calibrates and decides.

The compiled matcher takes the same steps, many times as fast. Both make the same pairs, and the
same evidence to 1e-9, unless the last bit of a sum decides between equals, because numpy adds in
another order: minutiae at the same distance from a prediction, a cell on the border of a print.
Minutiae within about 1e-9 of the extent of a print, which scipy's Delaunay drops, are the other
exception.
"""

from __future__ import annotations

import cmath
import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching import constants as fixed
from fpmatch.matching.parameters import USUAL, MatchParameters
from fpmatch.matching.pipeline.evidence import load_weights
from fpmatch.matching.prints.prepared import encode, prepare_by
from fpmatch.matching.reference.alignment import Pairing, grow, one_pair, seeded
from fpmatch.matching.reference.evidence import weigh
from fpmatch.matching.reference.neighbourhood import local_similarity, neighbourhoods
from fpmatch.matching.reference.prefilter import descriptor_similarity
from fpmatch.matching.reference.relaxation import relax
from fpmatch.matching.reference.ridges import search_by_ridges
from fpmatch.pointset.geometry.similarity import Similarity

if TYPE_CHECKING:
    from collections.abc import Iterable

    from fpmatch.matching.pipeline.evidence import Evidence
    from fpmatch.matching.prints.prepared import PreparedTemplate
    from fpmatch.templates.minutiae import Template


def prepare(template: Template, parameters: MatchParameters = USUAL) -> PreparedTemplate:
    """Triangulate the minutiae of a template and describe their rings."""
    return prepare_by(neighbourhoods, encode, template, parameters)


def rejected(
    a: PreparedTemplate, b: PreparedTemplate, parameters: MatchParameters = USUAL
) -> float:
    """Return the estimate of -ln(FMR) of two prints that the prefilter rejects; else 0."""
    base, growth, limit = load_weights().model_of(a, b).prefilter
    enough = min(base + growth * min(len(a), len(b)), limit)
    bits = a.bit_descriptors, b.bit_descriptors
    shortfall = enough - descriptor_similarity(*bits, parameters)
    return fixed.REJECTED - fixed.SHORTFALL * shortfall if shortfall > 0.0 else 0.0


def match(
    a: PreparedTemplate, b: PreparedTemplate, parameters: MatchParameters = USUAL
) -> tuple[Pairing, Evidence] | None:
    """Align print A with print B, in the order of their content; None if nothing is paired."""
    p, model = parameters, load_weights().model_of(a, b)
    similarity = local_similarity(a.neighbourhoods, b.neighbourhoods, parameters)
    candidates = relax(a.points, b.points, similarity, parameters)
    start = partial(seeded, a.points, b.points, parameters=parameters)
    weighed = partial(weigh, a, b, candidates)
    if a.key == b.key:  # only the identity is its own inverse
        every = np.arange(len(a))
        identity = Pairing(a.points, b.points, every, np.ones(len(a)), parameters=parameters)
        return weighed(identity, ridges_from=model.refine_threshold)

    tried, seeds = [], candidates.seeds
    weak = candidates.strength < model.relaxation_threshold
    for _ in range(p.hypotheses):
        if not seeds:
            break
        pairing = grow(start(*candidates.hypothesis(len(a), seeds[0])), p.coarse_rounds)
        # a candidate that is among the pairs of one hypothesis starts no later one
        among = candidates.among(pairing.partner)
        seeds = [seed for seed in seeds[1:] if not among[seed]]
        if pairing.pairs:
            tried.append(weighed(pairing, ridges_from=math.inf))
            if weak or tried[-1][1].total > model.confident_threshold:
                break
    best = _greatest(tried)
    alone = best is not None and best[1].total > model.confident_threshold
    if best and best[1].total > model.refine_threshold:
        chosen = [best] if alone else [t for t in tried if t[1].total > model.refine_threshold]
        grown = [grow(one, p.rounds - p.coarse_rounds, settled=True) for one, _ in chosen]
        best = _greatest([weighed(one) for one in grown if one.pairs])
    shown = a.region.ridges is not None and b.region.ridges is not None
    if shown and not alone and not (best and best[1].total > model.confident_threshold):
        small = load_weights().is_small(a, b)
        proposed = None if small else (candidates.first, candidates.second)
        pairs = search_by_ridges(a, b, proposed, parameters)
        by_ridges = (grow(start(*one_pair(len(a), *pair)), p.rounds) for pair in pairs)
        found = [weighed(each) for each in by_ridges if each.pairs]
        best = _greatest([best, *found] if best else found)
    return best


def _greatest(weighed: Iterable[tuple[Pairing, Evidence]]) -> tuple[Pairing, Evidence] | None:
    """Return the pairing of the greatest sum, the first of equals; None of none."""
    return max(weighed, key=lambda each: each[1].total, default=None)


def transform_of(
    a: PreparedTemplate, b: PreparedTemplate, pairing: Pairing
) -> tuple[Similarity, float]:
    """Fit eq. (1) to the pairs in pixels; also return the root of their mean square distance.

    Where the places of few pairs do not determine it, the scale is that of the resolutions, and
    the rotation that of the pairing, to which the directions contribute.
    """
    i = np.flatnonzero(pairing.partner >= 0)
    weight = pairing.weight[i] / pairing.weight[i].sum()
    own, other = (
        of[:, paired].T @ [1.0, -1.0j] / side.to_500dpi  # y points down
        for side, of, paired in ((a, a.points[:2], i), (b, b.points[:2], pairing.partner[i]))
    )
    middle_own, middle_other = weight @ own, weight @ other
    span, scale = own - middle_own, a.to_500dpi / b.to_500dpi
    linear = weight @ (span.conj() * (other - middle_other))
    spread = weight @ (span.real * span.real + span.imag * span.imag)
    stretched = abs(linear) / spread if spread > 0.0 else 0.0
    most = fixed.MAX_STRETCH
    if len(i) < fixed.MIN_PAIRS_FOR_SCALE or not 1 / most <= stretched / scale <= most:
        stretched, linear = scale, pairing.move[0].conjugate()
    turn = cmath.phase(linear)
    linear = cmath.rect(stretched, turn)
    shift = complex(middle_other - linear * middle_own)
    off = shift + linear * own - other
    fitted = Similarity(float(stretched), turn, shift.real, shift.imag)
    return fitted, math.sqrt(np.mean(off.real * off.real + off.imag * off.imag))
