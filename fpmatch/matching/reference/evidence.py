"""Evidence and score: the features of an alignment, weighed; see `pipeline.evidence`.

The bounds are the decades of the FMR that pairs and ridges justify at most.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from fpmatch.matching import constants as fixed
from fpmatch.matching.pipeline.evidence import (
    FEATURES,
    RIDGE_FEATURES,
    STANDARD,
    Evidence,
    amount_terms,
    load_weights,
)
from fpmatch.matching.prints.prepared import codes_at, lies_off_ridges
from fpmatch.matching.reference.pair_mesh import measure
from fpmatch.matching.reference.ridges import compare_ridges, drift_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.parameters import MatchParameters
    from fpmatch.matching.pipeline.evidence import ScoreModel
    from fpmatch.matching.prints.prepared import PreparedTemplate, PrintArea
    from fpmatch.matching.reference.alignment import Pairing
    from fpmatch.matching.reference.pair_mesh import Floats, Plane
    from fpmatch.matching.reference.relaxation import Candidates


def weigh(
    a: PreparedTemplate,
    b: PreparedTemplate,
    candidates: Candidates,
    pairing: Pairing,
    *,
    ridges_from: float = -math.inf,
) -> tuple[Pairing, Evidence]:
    """Return a pairing with the evidence in it, weighed.

    The ridges are compared where the sum of the minutiae is above `ridges_from`.
    """
    model = load_weights().model_of(a, b)
    p = pairing.parameters
    e = _gather(a, b, candidates, pairing)
    features = features_of(model, e, p)
    if model.sums(features) > ridges_from:
        drift = drift_of(a.region, *pairing.mesh[:2], pairing.move)
        ridges = compare_ridges(a.region, b.region, pairing.move, drift)
        e |= zip(("ridges", "cells"), ridges, strict=True)
        features = features_of(model, e, p)
    total = float(model.sums(features))
    # given the amount of evidence, -ln(FMR) grows with the sum
    amount = amount_terms(math.sqrt(e["fewest"] * e["common"] / 2.0), e["area"])
    low, high = (model.quantiles @ amount).tolist()
    decade = max(high - low, fixed.LEAST_SPREAD)
    limit = most_decades(e["pairs"], e["ridges"] - p.usual_correlation, e["cells"])
    estimate = float(fixed.LOG_10 * min(2.0 + (total - low) / decade, limit))
    estimate = _beyond_chance(a, b, pairing, e, estimate, p)
    e |= {"total": total, "minus_log_fmr": estimate}
    return pairing, Evidence(**e)


def _gather(
    a: PreparedTemplate, b: PreparedTemplate, candidates: Candidates, pairing: Pairing
) -> dict[str, Any]:
    """Return the evidence of the minutiae."""
    partner, (linear, shift) = pairing.partner, pairing.move
    p, (mesh, predicted, _, _) = pairing.parameters, pairing.mesh
    paired = np.flatnonzero(partner >= 0)
    others = np.flatnonzero(np.bincount(partner[paired], minlength=len(b)) == 0)
    back = (b.points[0, others] + 1j * b.points[1, others] - shift) / linear
    own = np.flatnonzero(partner < 0)
    common_a, unpaired_a = _unpaired(a, own, b.region, predicted[own], p)
    common_b, unpaired_b = _unpaired(b, others, a.region, back, p)
    common_a, common_b = common_a + len(paired), common_b + len(paired)
    row, column = np.nonzero(a.region.code)
    cells = (a.region.first_column + column + 0.5) - 1j * (a.region.first_row + row + 0.5)
    seen = np.count_nonzero(codes_at(b.region, shift + linear * a.region.step * cells))
    smaller = min(a.region.area, b.region.area)
    area = min(seen * a.region.step**2, smaller)
    return {
        "pairs": len(paired),
        "local": float(candidates.similarity[paired, partner[paired]].astype(np.float64).sum()),
        "unpaired": unpaired_a + unpaired_b,
        "common": common_a + common_b,
        "overlap": area / smaller if smaller > 0.0 else 0.0,
        "relaxed": float(candidates.relaxed[candidates.among(partner)].sum()),
        **measure(mesh, pairing.places[1], partner, predicted, p),
        "fewest": min(len(a), len(b)),
        "ridges": 0.0,
        "cells": 0,
        "area": area,
    }


def _unpaired(
    own: PreparedTemplate, which: NDArray[np.intp], other: PrintArea, at: Plane, p: MatchParameters
) -> tuple[int, float]:
    """Return how many unpaired minutiae lie in the other print, and the weight of those well in."""
    steps = (p.margin_px if other.has_flow else 0.0) * np.array([0, 1, -1, 1j, -1j])
    inside = codes_at(other, at + steps[:, None]) > 0
    squares = own.quality**2
    # poor qualities are raised to usual ones
    total, least = squares.sum(), fixed.LEAST_MEAN_SQUARE * len(own)
    raised = least / total if 0.0 < total < least else 1.0
    return int(inside[0].sum()), float(squares[which[inside.all(axis=0)]].sum() * raised)


def features_of(model: ScoreModel, e: dict[str, Any], p: MatchParameters) -> Floats:
    """Return the features of the evidence, in the order of `FEATURES`."""
    per_pair = 1.0 / (1.0 + e["pairs"])
    features = [
        math.log(fixed.LEAST_RELAXED + e["relaxed"]),
        *(e[name] * per_pair for name in ("places", "weights", "fullness")),
        math.log1p(e["local"]),
        math.sqrt(e["unpaired"] / (e["pairs"] + p.doubt_pairs)),
        e["overlap"],
        e["pairs"] / (e["fewest"] + p.doubt_minutiae),
    ]
    if e["cells"]:
        features += [e["ridges"], math.log(e["cells"] + p.doubt_cells)]
        features += [(e["ridges"] - p.usual_correlation) * math.sqrt(e["cells"])]
    else:
        usual = model.standard[STANDARD.index("impostor_mean")]
        features += [usual[FEATURES.index(name)] for name in RIDGE_FEATURES]
    return np.array(features)


def _beyond_chance(
    a: PreparedTemplate,
    b: PreparedTemplate,
    pairing: Pairing,
    e: dict[str, Any],
    estimate: float,
    p: MatchParameters,
) -> float:
    """Return -ln(FMR), lowered for pairs that chance would make, and for implausible prints."""
    least = fixed.LOG_10 * p.beyond_from
    if not estimate > least or p.beyond_share == 0.0:
        return estimate
    if lies_off_ridges(a) or lies_off_ridges(b):
        return least
    if load_weights().is_small(a, b):
        return estimate
    _, place, direction, _ = pairing.mesh
    squared = abs(pairing.places[1] - place[:, None]) ** 2
    cosine = (direction[:, None] * pairing.directions[1].conj()).real
    near = np.minimum(squared / fixed.BESIDE2, 1.0) * np.maximum(1.0 - squared / fixed.AROUND2, 0.0)
    around = near * np.maximum((cosine - fixed.LEAST_COSINE) / (1.0 - fixed.LEAST_COSINE), 0.0)
    nearness = np.log10(
        fixed.FAR_SHARE + fixed.DENSER_PLACE * np.exp(-0.5 * squared / fixed.PLACE2)
    )
    nearness += np.log10(fixed.FAR_SHARE + fixed.DENSER_TURN * np.exp((cosine - 1.0) / fixed.TURN2))
    nearness[squared >= fixed.AROUND2] = 0.0
    i = np.flatnonzero(pairing.partner >= 0)
    counted = nearness[i, pairing.partner[i]].sum()
    unusual = e["ridges"] - p.usual_correlation
    by_chance = fixed.PER_AROUND * around.sum()
    bound = decades_beyond_chance(e["pairs"], by_chance, counted, unusual, e["cells"])
    few = (fixed.ENOUGH_TO_HOLD - e["fewest"]) / (fixed.ENOUGH_TO_HOLD - fixed.FEW_TO_HOLD)
    less = p.beyond_less + p.beyond_few * min(max(few, 0.0), 1.0)
    above = estimate - fixed.LOG_10 * (bound - less)
    lowered = estimate - p.beyond_share * max(above, 0.0)
    return float(max(lowered, least))


def most_decades(pairs: int, ridges: float, cells: int) -> float:
    """Return the greatest -log10 of the FMR that so many pairs and cells of ridges justify.

    `ridges` is the ridge correlation less that of different fingers.
    """
    share = min(max(ridges / fixed.FULL_AGREEMENT, 0.0), 1.0)
    return fixed.DECADES_PER_PAIR * max(pairs - 1.0, 0.0) + share * cells / fixed.CELLS_PER_DECADE


def decades_beyond_chance(
    pairs: int, by_chance: float, nearness: float, ridges: float, cells: int
) -> float:
    """Return about how many decades of the FMR pairs and ridges justify under the best transform.

    `by_chance` is the number of pairs expected of the minutiae around, `nearness` the decades by
    which the pairs lie nearer to their predictions, in place and direction, than those would;
    half of them count, since the mesh fits the pairs.
    """
    decades = poisson_decades(pairs, max(by_chance, fixed.LEAST_BY_CHANCE)) + 0.5 * nearness
    share = min(max((ridges - fixed.ALIGNED) / fixed.FULLY_ALIGNED, 0.0), 1.0)
    counted = cells - 0.75 * max(cells - fixed.FULL_CELLS, 0.0)
    return decades + share * counted / fixed.CELLS_PER_DECADE


def poisson_decades(count: int, mean: float) -> float:
    """Return Chernoff's bound of -log10 of the probability of `count` or more Poisson events."""
    return (count * math.log(count / mean) - count + mean) / fixed.LOG_10 if count > mean else 0.0
