"""Evidence and score: the kernel against plain twins, known alignments, thresholds, the file."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable
from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from matching_prints import (
    COMPILED,
    Points,
    even_field,
    jittered,
    moved,
    seeds,
    spread_points,
    striped_field,
    template_of,
    templates,
)
from matching_weights import (
    ALWAYS,
    NEVER,
    OF_RIDGES,
    REJECTING,
    all_with,
    interpreted_kernels,
    print_for,
    scored_by,
    some_model,
    some_weights,
    weights_of,
)
from numpy.typing import NDArray
from scipy.stats import poisson

from fpmatch.errors import MatcherError
from fpmatch.matching._ridge_kernel import RidgeCorrelator
from fpmatch.matching._ridge_search_kernel import RidgeSearch
from fpmatch.matching.align import (
    Alignment,
    AlignmentParameters,
    PairMeshParameters,
    RelaxationParameters,
    aligner_of,
    alignments,
    best_alignment,
    identity_alignment,
    make_aligner,
)
from fpmatch.matching.compare import align
from fpmatch.matching.local import local_similarity
from fpmatch.matching.prepare import PreparationParameters, PreparedTemplate, prepare
from fpmatch.matching.ridges import RidgeSearchParameters, ridge_correlation
from fpmatch.matching.score import (
    WEIGHTS_FILE,
    Evidence,
    ScoreParameters,
    evidence_scorer,
    gather_evidence,
    load_weights,
)
from fpmatch.matching.score_model import (
    AMOUNTS,
    FEATURES,
    LIMITS,
    MODELS,
    NO_PREFILTER,
    RATES,
    STANDARD,
    ScoreModel,
    ScoreWeights,
)
from fpmatch.minutiae import RidgeField, Template

P = ScoreParameters()
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
ENTRIES = (
    "pairs",
    "local",
    "unpaired",
    "common",
    "overlap",
    "relaxed",
    "places",
    "weights",
    "fullness",
    "turned",
    "strain",
    "fewest",
    "ridges",
    "cells",
    "area",
    "chance",
)
SUMS = ("total", "decade", "minus_log_fmr")
N = len(FEATURES)
FEW = 20 if COMPILED else 6
FRAME = 8  # frame points of the mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


def given_pairs(a: PreparedTemplate, partner: Ints, transform: Floats = IDENTITY) -> Alignment:
    """Return the alignment of given pairs under a given transform."""
    linear, shift = transform[0] + 1j * transform[1], transform[2] + 1j * transform[3]
    z = shift + linear * (a.points[0] + 1j * a.points[1])
    predicted = np.vstack([z.real, z.imag, a.points[2:]])
    return Alignment(transform, partner, (partner >= 0).astype(float), predicted)


def overlay(
    a: PreparedTemplate,
    b: PreparedTemplate,
    partner: Ints,
    transform: Floats = IDENTITY,
    weights: ScoreWeights | None = None,
) -> Evidence:
    """Return the evidence of an alignment that is given."""
    similarity = local_similarity(a.neighbourhoods, b.neighbourhoods)
    scorer = evidence_scorer(max(len(a), len(b)), weights or some_weights())
    return gather_evidence(a, b, given_pairs(a, partner, transform), similarity, scorer)


def with_itself(
    print_: PreparedTemplate, partner: Ints | None = None, weights: ScoreWeights | None = None
) -> Evidence:
    """Return the evidence of a print aligned with itself, all minutiae paired or those given."""
    pairs = np.arange(len(print_), dtype=np.int32) if partner is None else partner
    return overlay(print_, print_, pairs, weights=weights)


def described(
    weights: ScoreWeights, /, *, shown: bool = True, small: bool = False, **entries: float
) -> list[float]:
    """Return the features of evidence of which all that is not given is 0."""
    scorer = evidence_scorer(0, weights)
    np.asarray(scorer.evidence)[:] = [entries.get(name, 0.0) for name in ENTRIES]
    scorer.choose_model(shown, shown, 0.0 if small else math.inf)
    scorer.describe()
    return np.asarray(scorer.feature).tolist()


def features_twin(impostor_mean: Floats, **entries: float) -> list[float]:
    """Return the features as the docstring of `score` defines them."""
    pairs, cells = entries["pairs"], entries["cells"]
    sums = [entries[name] for name in ("places", "weights", "fullness", "turned")]
    above = (entries["ridges"] - 0.2) * math.sqrt(cells)
    compared = (entries["ridges"], math.log(cells + P.doubt_cells), above)
    return [
        math.log(0.01 + entries["relaxed"]),
        *(value / (1.0 + pairs) for value in sums),
        entries["strain"],
        math.log(1.0 + entries["local"]),
        math.sqrt(entries["unpaired"] / (pairs + P.doubt_pairs)),
        entries["overlap"],
        pairs / (entries["fewest"] + P.doubt_minutiae),
        *(compared if cells else impostor_mean[OF_RIDGES].tolist()),
    ]


def total_of(model: ScoreModel, features: Any) -> float:
    """Return the weighted sum of features, as the docstring of `score` defines it."""
    middle, spread, weight, _ = model.standard
    return float(model.bias + (weight * (features - middle) / spread).sum())


def minus_log_fmr_twin(model: ScoreModel, evidence: Evidence) -> float:
    """Return -ln(FMR) of a weighted sum, as the docstring of `score` defines it."""

    def saturated(amount: float, enough: float) -> float:
        return float((amount**-4 + enough**-4) ** -0.25) if amount else 0.0

    n = saturated(math.sqrt(evidence.fewest * evidence.common / 2), 12.0)
    area = math.log(max(saturated(evidence.area, 30_000.0), 256.0) / 10_000)
    amounts = np.array([1.0, 1 / (n + 1), 1 / (n + 1) ** 2, area, area / (n + 1)])
    percent, permille = model.quantiles @ amounts
    decades = 2 + (evidence.total - percent) / max(permille - percent, 0.5)
    return float(min(decades, most_decades_twin(evidence)) * math.log(10))


def most_decades_twin(evidence: Evidence) -> float:
    """Return the most that pairs and ridges can say, as the docstring of `score` defines it."""
    decades = 1.2 * max(evidence.pairs - 1, 0)
    mean = evidence.chance * float(np.clip((evidence.chance - 3) / 2, 0, 1))
    if mean > 0:
        n = max(evidence.pairs, mean)
        decades = min(decades, (n * math.log(n / mean) - n + mean) / math.log(10))
    agreeing = float(np.clip((evidence.ridges - 0.2) / 0.2, 0, 1))
    return decades + agreeing * evidence.cells / 12


def some_case(seed: int) -> tuple[PreparedTemplate, PreparedTemplate, Ints, Floats]:
    """Return two prints, pairs of their minutiae, and a transform."""
    rng = np.random.default_rng(seed)
    points = spread_points(rng, int(rng.integers(0, 14)), size=150.0)
    n = points.shape[1]
    turn, scale = rng.uniform(-0.5, 0.5), rng.uniform(0.94, 1.06)
    shift = complex(*rng.uniform(-30, 30, 2))
    sides = []
    for side in (points, jittered(rng, moved(points, turn, shift, scale), 3.0, 0.1)):
        field = striped_field(side=int(rng.integers(2, 10)), step=rng.choice([12.0, 16.0, 21.7]))
        mask = rng.random(field.mask.shape) < rng.choice([0.6, 0.9, 1.0])
        ridges = field.ridges if rng.random() < 0.7 else None
        quality = rng.integers(0, 101, n)
        chosen = replace(field, mask=mask, ridges=ridges) if rng.random() < 0.85 else None
        sides.append(prepare(template_of(side, quality=quality, field=chosen)))
    likely = np.arange(n) if rng.random() < 0.5 else rng.permutation(n)
    partner = np.where(rng.random(n) < 0.7, likely, -1).astype(np.int32)
    linear = scale * np.exp(1j * turn)
    return *sides, partner, np.array([linear.real, linear.imag, shift.real, shift.imag])


def mesh_twin(aligner: Any) -> list[float]:
    """Return the triangles turned over and the mean strain, from the triangles of the mesh."""
    mesh = aligner.mesh
    corner = np.asarray(mesh.corner)[: mesh.triangles]
    (ax, ay), (bx, by) = (
        np.array([np.asarray(x)[: mesh.vertices], np.asarray(y)[: mesh.vertices]])
        for x, y in ((mesh.ax, mesh.ay), (mesh.bx, mesh.by))
    )
    p, q, r = corner.T
    area = (bx[q] - bx[p]) * (by[r] - by[p]) - (by[q] - by[p]) * (bx[r] - bx[p])
    turned = int(((corner >= FRAME).sum(axis=1) * (area <= 0)).sum())
    sides = {
        (min(u, v), max(u, v))
        for t in corner.tolist()
        for u, v in zip(t, t[1:] + t[:1], strict=True)
    }
    strain = []
    for u, v in sorted(side for side in sides if side[0] >= FRAME):
        in_a, in_b = (
            math.hypot(ax[u] - ax[v], ay[u] - ay[v]),
            math.hypot(bx[u] - bx[v], by[u] - by[v]),
        )
        strain.append(2 * abs(in_a - in_b) / (in_a + in_b + 16.0))
    return [turned, float(np.mean(strain)) if strain else 0.0]


def twin(a: PreparedTemplate, b: PreparedTemplate, partner: Ints, transform: Floats) -> list[float]:
    """Return the evidence of an alignment, the ridges' aside, with arrays of complex numbers.

    Relaxation and mesh have twins of their own; here their results are summed over the pairs.
    """
    linear, shift = (complex(*transform[k : k + 2]) for k in (0, 2))
    similarity = local_similarity(a.neighbourhoods, b.neighbourhoods)
    aligner = aligner_of(a.points, b.points)
    count = aligner.relax(similarity)
    aligner.impose(partner, *transform.tolist())
    i = np.flatnonzero(partner >= 0)
    j = partner[i]
    back = (b.points[0] + 1j * b.points[1] - shift) / linear
    common, unpaired = 2 * len(i), 0.0
    for one, other, x, y, paired in (
        (a, b, *np.asarray(aligner.predicted)[:2, : len(a)], i),
        (b, a, back.real, back.imag, j),
    ):
        single = np.setdiff1d(np.arange(len(one)), paired)
        u, v, holds = x[single], y[single], other.region.contains
        inside = holds(u, v)
        deep = inside.copy()
        margin = P.margin_px if other.region.has_flow else P.hull_margin_px
        for across, along in ((margin, 0), (-margin, 0), (0, margin), (0, -margin)):
            deep &= holds(u + across, v + along)
        common += np.count_nonzero(inside)
        square = one.quality**2
        least = 0.25 * len(one)
        poor = least / square.sum() if 0 < square.sum() < least else 1.0
        unpaired += poor * float(square[single][deep].sum())
    x, y, *_ = a.region.cells
    mapped = shift + linear * (x + 1j * y)
    shared = np.count_nonzero(b.region.contains(mapped.real, mapped.imag)) * a.region.step**2
    smaller = min(a.region.area, b.region.area)
    overlap = min(shared / smaller, 1.0) if smaller else 0.0
    relaxation = aligner.relaxation
    first, second = (np.asarray(x)[:count] for x in (relaxation.first, relaxation.second))
    relaxed = float(np.asarray(relaxation.relaxed)[:count][partner[first] == second].sum())
    agreement = [
        float(np.asarray(values)[i].sum())
        for values in (
            aligner.mesh.place_agreement,
            aligner.mesh.weight_agreement,
            aligner.mesh.fullness,
        )
    ]
    local = float(similarity[i, j].sum())
    fewest = min(len(a), len(b))
    evidence = [len(i), local, unpaired, common, overlap, relaxed, *agreement]
    return [*evidence, *mesh_twin(aligner), fewest]


def entries_of(found: Evidence) -> list[float]:
    return [getattr(found, name) for name in ENTRIES]


@given(seeds)
def test_evidence_agrees_with_its_twin(seed: int) -> None:
    a, b, partner, transform = some_case(seed)
    found = entries_of(overlay(a, b, partner, transform))
    assert found[:12] == pytest.approx(twin(a, b, partner, transform), abs=1e-5)
    correlation, cells = ridge_correlation(a, b, given_pairs(a, partner, transform))
    assert found[12:14] == [correlation if cells else 0.0, cells]
    smaller = min(side.region.inside * side.region.step**2 for side in (a, b))
    assert found[14] == pytest.approx(found[4] * smaller)


@given(seeds)
def test_expected_pairs_are_those_of_minutiae_that_lie_anywhere(seed: int) -> None:
    """Of M minutiae each has so many of N others within 12 px and 30 degrees in the mean."""
    a, b, partner, transform = some_case(seed)
    found = overlay(a, b, partner, transform)
    if not found.area:
        assert found.chance == 0
        return
    most = found.common**2 / 4 * 75.0 / found.area
    assert 0 <= found.chance <= most * (1 + 1e-12)
    one_for_one = with_itself(a)
    assert one_for_one.chance == pytest.approx(len(a) ** 2 * 75.0 / one_for_one.area)


def test_pairs_of_dense_prints_are_bounded_by_what_chance_gives() -> None:
    """Up to 3 of them are as usual."""
    few = Evidence(**dict.fromkeys(ENTRIES, 0), features=np.zeros(N), **dict.fromkeys(SUMS, 0.0))
    scorer = evidence_scorer(0, some_weights())
    scorer.choose_model(False, False, math.inf)
    bounds = []
    for chance, cells in ((0.0, 0), (3.0, 0), (5.0, 0), (8.0, 0), (40.0, 0), (40.0, 24)):
        entries = {"pairs": 10, "chance": chance, "cells": cells, "ridges": 0.3}
        np.asarray(scorer.evidence)[:] = [entries.get(name, 0.0) for name in ENTRIES]
        bounds.append(scorer.condition(1e9) / math.log(10))
        assert bounds[-1] == pytest.approx(most_decades_twin(replace(few, **entries)))
        chances = np.exp([poisson.logsf(9, chance)])[0] if chance > 4 and not cells else 0.0
        assert chances <= 10 ** -bounds[-1] * (1 + 1e-9)
    assert bounds[:2] == pytest.approx([10.8, 10.8])
    assert bounds[2] > bounds[3] > 0
    assert bounds[-2:] == pytest.approx([0.0, 1.0])


def test_the_cases_that_are_drawn_are_of_every_kind() -> None:
    """Otherwise the agreement with the twin would show little."""
    found = [overlay(*some_case(seed)) for seed in range(40)]
    assert sum(one.cells > 0 for one in found) > 5
    assert sum(one.cells == 0 for one in found) > 5
    assert sum(one.unpaired > 0 for one in found) > 5
    assert sum(0 < one.overlap < 1 for one in found) > 10
    assert sum(one.common > 2 * one.pairs for one in found) > 10
    assert sum(one.relaxed > 0 for one in found) > 10
    assert sum(one.turned > 0 for one in found) > 5
    assert sum(one.turned == 0 and one.strain > 0 for one in found) > 5
    assert sum(0 < one.places < one.pairs - 0.1 for one in found) > 10
    assert any(one.pairs == 0 for one in found)


@given(seeds, st.sampled_from([ALWAYS, NEVER, -12.0]))
@settings(max_examples=FEW)
def test_compiled_and_interpreted_agree(
    interpreted: Callable[[str], ModuleType], seed: int, refine: float
) -> None:
    a, b, partner, transform = some_case(seed)
    weights = some_weights(refine, apart=3.0)
    plain = interpreted_kernels(interpreted)
    room = max(len(a), len(b))
    scorer = plain.evidence.EvidenceScorer(P, weights, room, RidgeSearchParameters())
    similarity = local_similarity(a.neighbourhoods, b.neighbourhoods)
    aligner = plain.align.Aligner(
        len(a), len(b), AlignmentParameters(), RelaxationParameters(), PairMeshParameters()
    )
    aligner.load_a(a.points, len(a))
    aligner.load_b(b.points, len(b))
    aligner.relax(similarity)
    aligner.impose(partner, *transform.tolist())
    sides = (print_for(plain.print, a), print_for(plain.print, b))
    minus_log_fmr = scorer.score_alignment(*sides, aligner, similarity)
    found = overlay(a, b, partner, transform, weights)
    assert minus_log_fmr == pytest.approx(found.minus_log_fmr, rel=1e-9, abs=1e-9)
    assert scorer.total == pytest.approx(found.total, rel=1e-9, abs=1e-9)
    assert scorer.evidence.tolist() == pytest.approx(entries_of(found), rel=1e-9, abs=1e-9)
    assert scorer.feature.tolist() == pytest.approx(found.features.tolist(), rel=1e-9, abs=1e-9)
    assert plain.amount.as_similarity(minus_log_fmr) == pytest.approx(found.similarity, rel=1e-9)


@given(seeds)
@settings(max_examples=FEW)
def test_a_scorer_used_before_gives_the_same(seed: int) -> None:
    """Whatever it scored before: a print of more minutiae, with or without ridges."""
    weights = some_weights(apart=3.0)
    scorer = evidence_scorer(14, weights)
    for a, b, partner, transform in map(some_case, (seed, seed + 1, seed + 2, seed)):
        similarity = local_similarity(a.neighbourhoods, b.neighbourhoods)
        again = gather_evidence(a, b, given_pairs(a, partner, transform), similarity, scorer)
        fresh = overlay(a, b, partner, transform, weights)
        assert (entries_of(again), again.total) == (entries_of(fresh), fresh.total)


def test_evidence_is_kept_when_the_scorer_is_used_again() -> None:
    print_ = prepare(template_of(spread_points(np.random.default_rng(1), 9)))
    similarity = local_similarity(print_.neighbourhoods, print_.neighbourhoods)
    scorer = evidence_scorer(9, some_weights())
    first = gather_evidence(print_, print_, identity_alignment(print_.points), similarity, scorer)
    before = first.features.tolist()
    unpaired = given_pairs(print_, np.full(9, -1, np.int32))
    second = gather_evidence(print_, print_, unpaired, similarity, scorer)
    assert second.features.tolist() != before
    assert first.features.tolist() == before


def test_without_a_scorer_the_weights_of_the_package_are_used() -> None:
    print_ = prepare(template_of(spread_points(np.random.default_rng(1), 9)))
    similarity = local_similarity(print_.neighbourhoods, print_.neighbourhoods)
    with scored_by(some_weights(bias=7.0)):
        found = gather_evidence(print_, print_, identity_alignment(print_.points), similarity)
    assert found.total == with_itself(print_, weights=some_weights(bias=7.0)).total


def test_a_print_aligned_with_itself() -> None:
    points = spread_points(np.random.default_rng(6), 25, spacing=20.0)
    found = with_itself(prepare(template_of(points, field=striped_field(side=25))))
    assert found.pairs == 25
    assert found.common == 50
    assert found.unpaired == 0
    assert found.agreement == 1.0
    assert found.overlap == 1.0
    assert found.ridges == 1.0
    assert found.cells == 625
    assert found.local >= 25 - 1e-3
    assert found.relaxed > 0


@given(seeds, st.floats(-math.pi, math.pi), st.sampled_from([1.0, 0.95, 1.05]))
@settings(max_examples=FEW)
def test_the_mesh_of_an_exact_copy_agrees_wholly(seed: int, turn: float, scale: float) -> None:
    """Places and weights do not change under a similarity; lengths do by its scale."""
    points = spread_points(np.random.default_rng(seed), 15)
    shift = 40 - 70j
    a, b = (prepare(template_of(side)) for side in (points, moved(points, turn, shift, scale)))
    linear = scale * np.exp(1j * turn)
    transform = np.array([linear.real, linear.imag, shift.real, shift.imag])
    found = overlay(a, b, np.arange(15, dtype=np.int32), transform)
    assert found.places == pytest.approx(15, abs=1e-6)
    assert found.weights == pytest.approx(15, abs=1e-6)
    assert found.turned == 0
    if scale == 1.0:
        assert found.strain == pytest.approx(0, abs=1e-5)
    else:
        assert 0 < found.strain < 2 * abs(scale - 1) / (scale + 1)
    assert 0 < found.fullness < 15


@given(seeds)
@settings(max_examples=FEW)
def test_a_mirrored_copy_turns_triangles_over(seed: int) -> None:
    """Edges keep their lengths, but the rings run the other way round."""
    points = spread_points(np.random.default_rng(seed), 15)
    mirrored = np.ascontiguousarray(np.vstack([300 - points[0], points[1], -points[2], points[3]]))
    a, b = (prepare(template_of(side)) for side in (points, mirrored))
    found = overlay(a, b, np.arange(15, dtype=np.int32))
    assert found.turned > 15
    assert found.strain == pytest.approx(0, abs=1e-5)


@given(seeds, st.floats(3, 30))
@settings(max_examples=FEW)
def test_displaced_partners_disturb_the_mesh(seed: int, px: float) -> None:
    rng = np.random.default_rng(seed)
    points = spread_points(rng, 15)
    displaced = jittered(rng, points, px, 0.0)
    a, b, c = (prepare(template_of(side)) for side in (points, points, displaced))
    everyone = np.arange(15, dtype=np.int32)
    whole, found = overlay(a, b, everyone), overlay(a, c, everyone)
    assert found.places < whole.places
    assert found.weights < whole.weights
    assert found.strain > 0
    assert found.fullness == pytest.approx(whole.fullness)


def test_prints_side_by_side_have_nothing_in_common() -> None:
    field = striped_field(side=25)
    print_ = prepare(template_of(spread_points(np.random.default_rng(6), 25), field=field))
    nobody = np.full(25, -1, np.int32)
    found = overlay(print_, print_, nobody, np.array([1.0, 0.0, 900.0, 0.0]))
    assert entries_of(replace(found, fewest=0)) == [0] * len(ENTRIES)
    assert found.agreement == 0.0


def inside_by(points: Points, shift: float, margin: float) -> NDArray[np.bool_]:
    """Tell which minutiae, shifted sideways, lie so far inside a square of 400 px."""
    x, y = points[0] + shift, -points[1]
    return (np.minimum(x, y) >= margin) & (np.maximum(x, y) < 400 - margin)


def test_minutiae_count_in_the_common_region_alone() -> None:
    """Of a print moved by half its width, minutiae outside the other print do not count."""
    points = spread_points(np.random.default_rng(6), 30, size=400.0)
    print_ = prepare(template_of(points, field=even_field()))
    nobody = np.full(30, -1, np.int32)
    found = overlay(print_, print_, nobody, np.array([1.0, 0.0, 208.0, 0.0]))
    expected = np.count_nonzero(points[0] + 208 < 400) + np.count_nonzero(points[0] - 208 >= 0)
    assert found.common == expected
    inner = np.count_nonzero(inside_by(points, 208, 20)) + np.count_nonzero(
        inside_by(points, -208, 20)
    )
    assert 0 < inner < expected
    assert found.unpaired == pytest.approx(inner * PreparationParameters().usual_quality ** 2)
    assert found.overlap == pytest.approx(12 / 25)


def test_pairs_count_as_common_wherever_they_lie() -> None:
    points = spread_points(np.random.default_rng(6), 10)
    found = with_itself(prepare(template_of(points, field=even_field(side=2))))
    assert found.common == 20
    assert found.agreement == 1.0


def test_unpaired_minutiae_count_by_the_square_of_their_quality() -> None:
    points = spread_points(np.random.default_rng(6), 12)
    points[:2] += [[50], [-50]]
    quality = np.array([100, 50, 0, 30] + [80] * 8)
    print_ = prepare(template_of(points, quality=quality, field=even_field()))
    partner = np.arange(12, dtype=np.int32)
    partner[:4] = -1
    found = with_itself(print_, partner)
    assert found.unpaired == pytest.approx(2 * (1 + 0.25 + 0.09))
    assert found.pairs == 8
    assert found.common == 24


def test_minutiae_that_are_all_poor_count_like_those_of_a_poor_print() -> None:
    """A template made to match must not gain by saying that its minutiae are worth nothing."""
    points = spread_points(np.random.default_rng(6), 12)
    points[:2] += [[50], [-50]]
    partner = np.arange(12, dtype=np.int32)
    partner[:4] = -1
    for quality in (1, 20, 50):
        print_ = prepare(template_of(points, quality=np.full(12, quality), field=even_field()))
        assert with_itself(print_, partner).unpaired == pytest.approx(2 * 4 * 0.25)


@pytest.mark.parametrize("margin", [0.0, 12.0, 40.0])
def test_the_margin_is_another_where_the_hull_stands_for_the_print(margin: float) -> None:
    """The hull of the minutiae ends where the print does not."""
    points = spread_points(np.random.default_rng(6), 30, size=400.0)
    whole, bare = (prepare(template_of(points, field=field)) for field in (even_field(), None))
    nobody = np.full(30, -1, np.int32)
    similarity = local_similarity(whole.neighbourhoods, bare.neighbourhoods)
    parameters = ScoreParameters(margin_px=20.0, hull_margin_px=margin)
    scorer = evidence_scorer(30, some_weights(), parameters)
    usual2 = PreparationParameters().usual_quality ** 2
    x, y = points[:2]

    def inside(region: Any, px: float) -> int:
        found = region.contains(x, y)
        for across, along in ((px, 0), (-px, 0), (0, px), (0, -px)):
            found &= region.contains(x + across, y + along)
        return int(np.count_nonzero(found))

    of_hull, of_field = inside(bare.region, margin), inside(whole.region, 20.0)
    assert of_hull < 30 or margin == 0.0
    for a, b in ((whole, bare), (bare, whole)):
        found = gather_evidence(a, b, given_pairs(a, nobody), similarity, scorer)
        assert found.unpaired == pytest.approx(usual2 * (of_hull + of_field))
    found = gather_evidence(bare, bare, given_pairs(bare, nobody), similarity, scorer)
    assert found.unpaired == pytest.approx(usual2 * 2 * of_hull)


def test_a_template_without_qualities_has_the_usual_one() -> None:
    points = spread_points(np.random.default_rng(6), 6)
    usual = PreparationParameters().usual_quality
    for none in (None, np.full(6, 100), np.zeros(6, int)):
        assert prepare(template_of(points, quality=none)).quality.tolist() == [usual] * 6
    worst = prepare(template_of(points, quality=np.array([0] * 5 + [1]))).quality
    assert worst.tolist() == [0.0] * 5 + [0.01]
    known = prepare(template_of(points, quality=np.array([100] * 5 + [99]))).quality
    assert known.tolist() == [1.0] * 5 + [0.99]


def test_unpaired_minutiae_of_poor_quality_lower_the_score_less() -> None:
    points = spread_points(np.random.default_rng(6), 12)
    partner = np.arange(12, dtype=np.int32)
    partner[:4] = -1
    scores = [
        with_itself(prepare(template_of(points, quality=np.full(12, quality))), partner).similarity
        for quality in (99, 60, 20, 1)
    ]
    assert scores == sorted(scores)
    assert scores[0] < scores[-1]


@pytest.mark.parametrize("steps", [(8.0, 16.0), (16.0, 8.0)])
def test_overlap_is_a_share_of_area_whatever_the_cells(steps: tuple[float, float]) -> None:
    points = spread_points(np.random.default_rng(6), 20)
    a, b = (
        prepare(template_of(points, field=even_field(step, round(400 / step)))) for step in steps
    )
    nobody = np.full(20, -1, np.int32)
    found = overlay(a, b, nobody, np.array([1.0, 0.0, 192.0, 0.0]))
    assert found.overlap == pytest.approx(208 / 400, abs=0.02)


@given(templates(), templates())
def test_evidence_is_within_its_bounds(probe: Template, reference: Template) -> None:
    a, b = prepare(probe), prepare(reference)
    similarity = local_similarity(a.neighbourhoods, b.neighbourhoods)
    scorer = evidence_scorer(max(len(a), len(b)), some_weights())
    # none where the local matches lead to no pair, as with minutiae that coincide
    found = alignments(a.points, b.points, similarity) if len(a) and len(b) else []
    for alignment in found:
        one = gather_evidence(a, b, alignment, similarity, scorer)
        assert 0 < one.pairs <= min(len(a), len(b))
        assert 2 * one.pairs <= one.common <= len(a) + len(b)
        # where all minutiae of a print are poor, the best of them count for more than one
        assert 0 <= one.unpaired <= len(a) + len(b)
        assert 0 < one.agreement <= 1
        assert 0 <= one.overlap <= 1
        assert -1 <= one.ridges <= 1
        assert 0 <= one.cells <= a.region.inside
        assert one.local >= 0
        assert one.relaxed >= 0
        for value in (one.places, one.weights, one.fullness):
            assert 0 <= value <= one.pairs + 1e-9
        assert 0 <= one.turned <= 6 * (one.pairs + FRAME)
        assert 0 <= one.strain < 2
        assert np.isfinite(one.features).all()
        assert 0 <= one.similarity < math.inf


USUAL = {
    "pairs": 20,
    "local": 9.0,
    "unpaired": 6.0,
    "common": 52,
    "overlap": 0.7,
    "relaxed": 0.6,
    "places": 18.0,
    "weights": 15.0,
    "fullness": 14.0,
    "turned": 2,
    "strain": 0.07,
    "fewest": 30,
    "ridges": 0.45,
    "cells": 130,
}


@given(
    st.fixed_dictionaries(
        {
            **{name: st.floats(0, 50) for name in ENTRIES},
            "pairs": st.integers(0, 80),
            "turned": st.integers(0, 20),
            "ridges": st.floats(-1, 1),
            "cells": st.integers(0, 900),
        }
    ),
    st.booleans(),
)
def test_features_agree_with_their_twin(entries: dict[str, float], shown: bool) -> None:
    weights = some_weights()
    entries["cells"] *= shown
    found = described(weights, shown=shown, **entries)
    model = weights.models[0 if shown else 1]
    assert found == pytest.approx(features_twin(model.standard[3], **entries), rel=1e-12)


@given(seeds, st.floats(-20, 20), st.floats(-4, 4))
@settings(max_examples=FEW)
def test_sums_are_conditioned_on_the_amount_of_evidence(
    seed: int, bias: float, level: float
) -> None:
    weights = some_weights(bias=bias)
    quantiles = weights.models[0].quantiles + np.array([[level], [1.5 * level]])
    weights = all_with(weights, quantiles=quantiles)
    a, b, partner, transform = some_case(seed)
    found = overlay(a, b, partner, transform, weights)
    model = weights.model_of(a, b)
    assert found.minus_log_fmr == pytest.approx(minus_log_fmr_twin(model, found), rel=1e-9)
    assert found.similarity == pytest.approx(np.logaddexp(0.0, found.minus_log_fmr), rel=1e-9)


def test_the_same_sum_is_worth_less_where_less_was_compared() -> None:
    """By the weights of the package: less of both minutiae and area."""
    for model in load_weights().models:
        scorer = evidence_scorer(0, load_weights())
        scorer.choose_model(*[model is load_weights().models[0]] * 2, math.inf)

        def worth(minutiae: int, area: float, scorer: Any = scorer) -> float:
            entries = {"fewest": minutiae, "common": 2 * minutiae, "area": area}
            np.asarray(scorer.evidence)[:] = [entries.get(name, 0.0) for name in ENTRIES]
            return float(scorer.condition(8.0))

        parts = ((4, 5000.0), (6, 8000.0), (8, 12000.0), (12, 25000.0))
        found = [worth(*part) for part in parts]
        assert found == sorted(found)
        assert worth(60, 90000.0) == pytest.approx(worth(200, 120000.0), rel=0.02)


def test_features_and_sum_are_those_of_the_evidence() -> None:
    weights = some_weights(apart=5.0)
    for seed in range(10):
        a, b, partner, transform = some_case(seed)
        found = overlay(a, b, partner, transform, weights)
        model = weights.model_of(a, b)
        entries = dict(zip(ENTRIES, entries_of(found), strict=True))
        assert found.features == pytest.approx(features_twin(model.standard[3], **entries))
        assert found.total == pytest.approx(total_of(model, found.features))


@given(seeds, st.floats(-5, 5))
def test_the_sum_is_linear_in_the_weights(seed: int, factor: float) -> None:
    case, rng = some_case(seed), np.random.default_rng(seed)
    middle, spread = rng.uniform(-1, 1, N), rng.uniform(0.1, 3, N)
    first, second = rng.normal(size=(2, N))

    def total(weight: Floats, bias: float) -> float:
        standard = np.stack([middle, spread, weight, np.zeros(N)])
        return overlay(*case, weights_of(standard, bias)).total

    summed = total(first + factor * second, 3.0)
    assert summed == pytest.approx(total(first, 3.0) + factor * total(second, 0.0), abs=1e-9)
    assert total(np.zeros(N), -2.5) == -2.5


@pytest.mark.parametrize("bias", [-800.0, -40.0, -1.0, 0.0, 1.0, 40.0, 800.0])
def test_similarity_is_the_logarithm_of_one_and_the_ratio(bias: float) -> None:
    print_ = prepare(template_of(spread_points(np.random.default_rng(1), 9)))
    standard = np.array([[0.0], [1.0], [0.0], [0.0]]).repeat(N, axis=1)
    found = with_itself(print_, weights=weights_of(standard, bias, NEVER))
    assert found.total == bias
    decades = min(2 + bias, most_decades_twin(found))  # NO_QUANTILES
    assert found.minus_log_fmr == pytest.approx(decades * math.log(10))
    assert found.similarity == pytest.approx(np.logaddexp(0.0, found.minus_log_fmr), rel=1e-12)
    assert found.similarity > 0 or bias == -800.0


LOWERING = ("unpaired", "turned", "strain", "fewest")


@given(
    st.sampled_from(sorted({*ENTRIES} - {"pairs", "common", "area", "chance"})),
    st.floats(0.01, 1),
    st.floats(0.01, 1),
)
def test_what_agrees_raises_the_sum_and_what_does_not_lowers_it(
    name: str, low: float, more: float
) -> None:
    weights = some_weights()
    scale = 100 if name == "cells" else 1
    less, greater = (
        total_of(weights.models[0], described(weights, **{**USUAL, name: scale * value}))
        for value in (low, low + more)
    )
    assert (less > greater) if name in LOWERING else (less < greater)


@given(st.floats(0.5, 1), st.floats(0, 1), st.integers(2, 40))
def test_a_good_pair_that_is_lost_lowers_the_sum(each: float, quality: float, pairs: int) -> None:
    weights = some_weights()
    sums = []
    for n, unpaired in ((pairs, 3.0), (pairs - 1, 3.0 + 2 * quality**2)):
        agreeing = dict.fromkeys(("local", "relaxed", "places", "weights", "fullness"), n * each)
        features = described(weights, pairs=n, unpaired=unpaired, overlap=0.7, **agreeing)
        sums.append(total_of(weights.models[0], features))
    assert sums[1] < sums[0]


@given(seeds)
@settings(max_examples=FEW)
def test_the_more_pairs_are_lost_the_lower_the_similarity(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = 16 if COMPILED else 8
    points = spread_points(rng, n)
    a = prepare(template_of(points, quality=rng.integers(50, 99, n), field=even_field()))
    b = prepare(template_of(jittered(rng, points, 1.5, 0.05), field=even_field()))
    partner = np.arange(n, dtype=np.int32)
    lost = rng.permutation(n)
    found = []
    for _ in range(4):
        found.append(overlay(a, b, partner).similarity)
        partner[lost[: n // 4]] = -1
        lost = lost[n // 4 :]
    assert found == sorted(found, reverse=True)


SHOWN = striped_field(side=25)
NOT_SHOWN = replace(SHOWN, ridges=None)


def with_fields(*fields: RidgeField | None) -> list[PreparedTemplate]:
    """Return prints of the same minutiae, with these fields."""
    points = spread_points(np.random.default_rng(6), 20)
    return [prepare(template_of(points, field=field)) for field in fields]


EVERYONE = np.arange(20, dtype=np.int32)


@pytest.mark.parametrize("refine", [ALWAYS, NEVER])
@pytest.mark.parametrize("first", [SHOWN, NOT_SHOWN, None])
@pytest.mark.parametrize("second", [SHOWN, NOT_SHOWN, None])
def test_the_model_is_that_of_the_pictures_that_both_prints_have(
    first: RidgeField | None, second: RidgeField | None, refine: float
) -> None:
    a, b = with_fields(first, second)
    weights = some_weights(refine, apart=100.0)
    found = overlay(a, b, EVERYONE, weights=weights)
    shown = (first is SHOWN) + (second is SHOWN)
    model = weights.models[(1, 2, 0)[shown]]
    assert weights.model_of(a, b) is model
    assert found.total == pytest.approx(total_of(model, found.features))
    compared = first is second is SHOWN and refine == ALWAYS
    assert found.cells == (625 if compared else 0)
    if not compared:
        assert found.ridges == 0.0
        assert found.features[OF_RIDGES].tolist() == model.standard[3, OF_RIDGES].tolist()


@pytest.mark.parametrize("fields", [(SHOWN, NOT_SHOWN), (NOT_SHOWN, SHOWN), (NOT_SHOWN, NOT_SHOWN)])
def test_on_minutiae_alone_the_ridges_have_no_part(fields: tuple[RidgeField, RidgeField]) -> None:
    """Which of the prints has pictures, and what the model with ridges is, changes nothing."""
    plain = with_itself(with_fields(NOT_SHOWN)[0]).total
    weights = some_weights()
    other = replace(weights, models=(some_model(NEVER, bias=-50.0), *weights.models[1:]))
    for used in (weights, other):
        assert overlay(*with_fields(*fields), EVERYONE, weights=used).total == plain


def test_ridges_like_the_mean_of_impostors_change_nothing() -> None:
    """Whether they are compared or not: the sum is the same."""
    a, b = with_fields(SHOWN, replace(SHOWN, ridges=SHOWN.ridges[::-1]))  # type: ignore[index]
    compared = overlay(a, b, EVERYONE)
    assert compared.cells > 0
    standard = some_model().standard.copy()
    standard[3, OF_RIDGES] = compared.features[OF_RIDGES]
    weights = all_with(some_weights(NEVER), standard=standard)
    assert overlay(a, b, EVERYONE, weights=weights).total == pytest.approx(compared.total)


def test_above_the_refine_threshold_ridges_are_compared() -> None:
    (shown,) = with_fields(SHOWN)
    on_minutiae = with_itself(shown, weights=some_weights(NEVER)).total
    for refine, compared in (
        (on_minutiae - 1e-9, True),
        (on_minutiae, False),
        (on_minutiae + 1.0, False),
    ):
        found = with_itself(shown, weights=some_weights(refine))
        assert (found.cells == 625) is compared
        assert (found.total > on_minutiae) is compared
        assert compared or found.total == on_minutiae


def test_the_sum_without_ridges_is_held_against_the_refine_threshold() -> None:
    """Ridges that disagree may take the sum back below it."""
    a, b = with_fields(SHOWN, striped_field(side=25, orientation=0.6 + math.pi / 2))
    standard = some_model().standard.copy()
    standard[3, OF_RIDGES[0]] = 0.8  # so that any ridges agree less than those of impostors

    def weights(refine: float) -> ScoreWeights:
        return all_with(some_weights(refine), standard=standard)

    refine = overlay(a, b, EVERYONE, weights=weights(NEVER)).total - 1e-6
    found = overlay(a, b, EVERYONE, weights=weights(refine))
    assert found.cells > 0
    assert found.total < refine


def test_each_model_has_its_own_refine_threshold() -> None:
    shown, plain = with_fields(SHOWN, NOT_SHOWN)
    for first, second in ((ALWAYS, NEVER), (NEVER, ALWAYS)):
        alone = some_model(second, ridges=False)
        weights = ScoreWeights((some_model(first), alone, alone, some_model(second)), {})
        assert (with_itself(shown, weights=weights).cells > 0) is (first == ALWAYS)
        assert with_itself(plain, weights=weights).cells == 0


def test_a_print_that_shows_its_ridges_is_more_similar_to_itself() -> None:
    shown, plain, bare = with_fields(SHOWN, NOT_SHOWN, None)
    compared, not_compared = (
        with_itself(shown, weights=some_weights(refine)) for refine in (ALWAYS, NEVER)
    )
    assert compared.total > not_compared.total
    assert compared.ridges == 1.0
    assert with_itself(plain).cells == with_itself(bare).cells == 0


finite = st.floats(-1e4, 1e4)


@given(
    *[st.tuples(finite, finite, finite)] * 4,
    st.tuples(finite, finite),
    st.integers(0, 4000),
    st.integers(3, 200),
)
def test_the_prefilter_shortfall_is_that_of_the_model(
    first: tuple[float, float, float],
    second: tuple[float, float, float],
    third: tuple[float, float, float],
    fourth: tuple[float, float, float],
    refine: tuple[float, float],
    score: int,
    smaller: int,
) -> None:
    weights = ScoreWeights(
        (
            some_model(refine[0], prefilter=first),
            some_model(refine[1], prefilter=second, ridges=False),
            some_model(refine[1], prefilter=third, ridges=False),
            some_model(refine[0], prefilter=fourth),
        ),
        {},
        small_area=5000.0,
    )
    scorer = evidence_scorer(0, weights)
    sides = itertools.product((True, False), (True, False), (5000.0, 5000.1))
    for ridges_a, ridges_b, area in sides:
        model = weights.models[(1, 2, 0 if area > 5000.0 else 3)[ridges_a + ridges_b]]
        assert scorer.choose_model(ridges_a, ridges_b, area) == weights.models.index(model)
        base, growth, limit = model.prefilter
        shortfall = scorer.prefilter_shortfall(score, smaller)
        assert shortfall == pytest.approx(min(base + growth * smaller, limit) - score)
        rejected = scorer.prefilter_rejected(abs(shortfall))
        assert rejected == pytest.approx(-5.0 - abs(shortfall) / 4)
        assert scorer.prefilter_rejected(abs(shortfall) + 1.0) < rejected


def test_all_prints_pass_without_a_prefilter() -> None:
    scorer = evidence_scorer(0, some_weights(prefilter=NO_PREFILTER))
    for ridges in (True, False):
        scorer.choose_model(ridges, ridges, math.inf)
        for smaller in (0, 3, 200):
            assert scorer.prefilter_shortfall(0, smaller) <= 0


def doubled(seed: int) -> tuple[PreparedTemplate, PreparedTemplate]:
    """Return a print, and one that contains it twice, so that two transforms compete."""
    rng = np.random.default_rng(seed)
    points = spread_points(rng, 10, size=130.0)
    again = moved(points, rng.uniform(-1, 1), 200 + 10j)
    both = np.hstack([jittered(rng, points, 2.0, 0.1), jittered(rng, again, 2.0, 0.1)])
    field = (None, SHOWN, striped_field(side=10))[seed % 3]
    a, b = (
        prepare(template_of(np.ascontiguousarray(side), field=field)) for side in (points, both)
    )
    return (a, b) if a.key < b.key else (b, a)


def alignment_twin(
    a: PreparedTemplate, b: PreparedTemplate, weights: ScoreWeights
) -> tuple[Alignment, float, int] | None:
    """Return the best alignment, its sum, and how many were refined, as `align` describes it."""
    similarity = local_similarity(a.neighbourhoods, b.neighbourhoods)
    model = weights.model_of(a, b)

    def sum_of(alignment: Alignment, refine: float) -> float:
        scorer = evidence_scorer(max(len(a), len(b)), all_with(weights, refine_threshold=refine))
        return gather_evidence(a, b, alignment, similarity, scorer).total

    aligner = aligner_of(a.points, b.points)
    aligner.relax(similarity)
    weak = aligner.relaxation.strength < model.relaxation_threshold
    coarse: dict[int, tuple[Alignment, float]] = {}
    for k in range(AlignmentParameters().hypotheses):
        if aligner.start_hypothesis(k):
            aligner.save_best()
            found = best_alignment(aligner)
            coarse[k] = found, sum_of(found, NEVER)
            if coarse[k][1] > model.confident_threshold:
                coarse = {k: coarse[k]} if coarse[k][1] > model.refine_threshold else coarse
                break
            if weak:
                break
    passing = [k for k, (_, total) in coarse.items() if total > model.refine_threshold]
    refined = []
    for k in passing:
        if aligner.refine(k):
            aligner.save_best()
            refined.append(best_alignment(aligner))
    rows = [(one, sum_of(one, ALWAYS)) for one in refined]
    if not passing:
        rows = list(coarse.values())
    sure = any(total > model.confident_threshold for _, total in coarse.values())
    best = max((total for _, total in rows), default=-math.inf)
    shown = a.region.ridges is not None and b.region.ridges is not None
    if shown and not sure and not best > model.confident_threshold:
        search, correlator = RidgeSearch(RidgeSearchParameters()), RidgeCorrelator(len(b))
        sides = a.for_kernels(), b.for_kernels()
        if model is weights.models[3]:
            found_by_ridges = search.search(*sides, correlator)
        else:
            found_by_ridges = search.search_candidates(*sides, aligner.relaxation, correlator)
        for k in range(found_by_ridges):
            if aligner.start_from(search.first[k], search.second[k]):
                aligner.save_best()
                rows.append((best_alignment(aligner), sum_of(best_alignment(aligner), ALWAYS)))
    if not rows:
        return None
    return *max(rows, key=lambda row: row[1]), len(refined)


@given(
    seeds,
    st.sampled_from([ALWAYS, NEVER, -20.0, -8.0, -2.0, 3.0]),
    st.sampled_from([-math.inf, -5.0, 0.0, 5.0, math.inf]),
    st.sampled_from([-1.0, 0.01, 0.05, 0.2, math.inf]),
)
def test_align_agrees_with_its_twin(
    seed: int, refine: float, confident: float, relaxation: float
) -> None:
    """Which hypotheses are tried, which are refined, and which of them is the result."""
    a, b = doubled(seed)
    weights = some_weights(refine, confident=confident, relaxation=relaxation, apart=2.0)
    found = align(a, b, evidence_scorer(max(len(a), len(b)), weights))
    expected = alignment_twin(a, b, weights)
    assert (found is None) == (expected is None)
    if found is not None and expected is not None:
        assert found[0].partner.tolist() == expected[0].partner.tolist()
        assert found[0].transform.tolist() == expected[0].transform.tolist()
        assert found[0].predicted.tolist() == expected[0].predicted.tolist()
        assert found[1].total == expected[1]


def test_the_cases_to_align_are_of_every_kind() -> None:
    """Several hypotheses are tried; the first is not always the best; some sums are confident."""
    refined, first_is_best, one_alone = [], [], []
    for seed in range(30):
        a, b = doubled(seed)
        every, first, confident = (
            alignment_twin(a, b, some_weights(relaxation=relaxation, confident=sure))
            for relaxation, sure in ((-1.0, math.inf), (math.inf, math.inf), (-1.0, 0.0))
        )
        if every is None or first is None or confident is None:
            continue
        refined.append(every[2])
        first_is_best.append(every[0].partner.tolist() == first[0].partner.tolist())
        one_alone.append(confident[2] == 1 < every[2])
    assert max(refined) > 1
    assert 0 < sum(first_is_best) < len(first_is_best)
    assert any(one_alone)


@given(seeds, st.sampled_from([ALWAYS, -8.0, NEVER]), st.sampled_from([0.0, math.inf]))
@settings(max_examples=FEW // 2)
def test_compiled_and_interpreted_align_the_same(
    interpreted: Callable[[str], ModuleType], seed: int, refine: float, confident: float
) -> None:
    a, b = doubled(seed)
    weights = some_weights(refine, confident=confident)
    plain = interpreted_kernels(interpreted)
    room = max(len(a), len(b))
    scorer = plain.evidence.EvidenceScorer(P, weights, room, RidgeSearchParameters())
    aligner = plain.align.Aligner(
        room, room, AlignmentParameters(), RelaxationParameters(), PairMeshParameters()
    )
    aligner.load_a(a.points, len(a))
    aligner.load_b(b.points, len(b))
    similarity = local_similarity(a.neighbourhoods, b.neighbourhoods)
    sides = (print_for(plain.print, a), print_for(plain.print, b))
    minus_log_fmr = scorer.align(*sides, aligner, similarity)
    found = align(a, b, evidence_scorer(room, weights))
    assert (found is None) == (aligner.best_pairs == 0)
    if found is not None:
        assert aligner.best_partner[: len(a)].tolist() == found[0].partner.tolist()
        assert minus_log_fmr == pytest.approx(found[1].minus_log_fmr, rel=1e-9)
        assert scorer.evidence.tolist() == pytest.approx(entries_of(found[1]), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("hypotheses", [1, 16, 17, 40])
def test_any_number_of_hypotheses_can_be_asked_for(hypotheses: int) -> None:
    """The scorer tries no more than it has room for."""
    a, b = doubled(2)
    parameters = AlignmentParameters(hypotheses=hypotheses)
    aligner = make_aligner(len(a), len(b), parameters)
    aligner.load_a(a.points, len(a))
    aligner.load_b(b.points, len(b))
    scorer = evidence_scorer(max(len(a), len(b)), some_weights())
    similarity = local_similarity(a.neighbourhoods, b.neighbourhoods)
    total = scorer.align(a.for_kernels(), b.for_kernels(), aligner, similarity)
    assert aligner.best_pairs > 0
    assert math.isfinite(total)


def some_json() -> str:
    return some_weights(-1.25, prefilter=REJECTING, confident=7.5, relaxation=0.375).as_json()


numbers = st.floats(-1e6, 1e6)


@given(
    arrays(np.float64, (len(MODELS), 4, N), elements=numbers),
    arrays(np.float64, (len(MODELS), 7), elements=numbers),
    arrays(np.float64, (len(MODELS), len(RATES), len(AMOUNTS)), elements=numbers),
)
def test_weights_read_back_are_the_same(
    standard: Floats, limits: Floats, quantiles: Floats
) -> None:
    models = (
        ScoreModel(rows, bias, (base, growth, most), relaxation, refine, confident, reached)
        for rows, (base, growth, most, relaxation, refine, confident, bias), reached in zip(
            standard, limits.tolist(), quantiles, strict=True
        )
    )
    weights = ScoreWeights(tuple(models), {"sets": ["one", "two"], "n": 3})
    assert weights.limits.tolist() == limits.tolist()
    assert weights.standard.tolist() == standard.tolist()
    again = ScoreWeights.from_json(weights.as_json())
    assert again.standard.tolist() == standard.tolist()
    assert again.limits.tolist() == limits.tolist()
    assert again.quantiles.tolist() == quantiles.tolist()
    for model, other in zip(again.models, weights.models, strict=True):
        assert model.prefilter == other.prefilter
        assert model.relaxation_threshold == other.relaxation_threshold
        assert model.refine_threshold == other.refine_threshold
        assert model.confident_threshold == other.confident_threshold
        assert model.bias == other.bias
    assert again.provenance == weights.provenance
    assert again.as_json() == weights.as_json()


def test_the_arrays_are_what_the_kernel_takes() -> None:
    weights = some_weights()
    assert weights.standard.shape == (len(MODELS), len(STANDARD), N)
    assert weights.limits.shape == (len(MODELS), len(LIMITS))
    assert weights.quantiles.shape == (len(MODELS), len(RATES), len(AMOUNTS))
    for array in (weights.standard, weights.limits, weights.quantiles):
        assert array.flags.c_contiguous
        assert array.dtype == np.float64


def test_the_file_names_the_models_the_limits_and_every_feature() -> None:
    document = json.loads(some_json())
    assert list(document["models"]) == list(MODELS)
    assert document["provenance"] == {"by": "hand"}
    for name, model in zip(MODELS, some_weights().models, strict=True):
        written = document["models"][name]
        assert list(written) == [*LIMITS, "impostor_quantiles", "genuine_median", "features"]
        assert written["genuine_median"] == dict.fromkeys(AMOUNTS, 0.0)
        reached = written["impostor_quantiles"]
        assert [list(row) for row in reached.values()] == [list(AMOUNTS)] * len(RATES)
        assert [list(row.values()) for row in reached.values()] == model.quantiles.tolist()
        assert [written[key] for key in LIMITS] == [*REJECTING, 0.375, -1.25, 7.5, 0.4]
        assert [row["name"] for row in written["features"]] == list(FEATURES)
        for k, row in enumerate(written["features"]):
            assert list(row) == ["name", *STANDARD]
            assert [row[key] for key in STANDARD] == model.standard[:, k].tolist()


def test_the_weights_of_the_package_are_as_they_were_written() -> None:
    weights = load_weights()
    assert weights.as_json() == WEIGHTS_FILE.read_text(encoding="utf-8")
    for model in weights.models:
        assert np.isfinite(model.standard).all()
        assert np.isfinite(model.limits).all()
        assert (model.standard[1] > 0).all()
        assert model.confident_threshold > model.refine_threshold
        assert model.standard[2, FEATURES.index("unpaired")] < 0
        assert model.standard[2, FEATURES.index("relaxed similarity")] > 0
    first, second, third, small = weights.models
    assert first.standard[2, FEATURES.index("ridges")] > 0
    assert second.standard[2, OF_RIDGES].tolist() == [0.0, 0.0, 0.0]
    assert first.standard[2, OF_RIDGES[-1]] == 0.0
    assert small.standard[2, OF_RIDGES[-1]] > 0
    assert third.standard.tolist() == second.standard.tolist()
    assert third.quantiles.tolist() != second.quantiles.tolist()


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        "3",
        '{"models": []}',
        '{"models": {}}',
        '{"models": {"with ridges": {"features": [{}]}}}',
        '{"models": {"with ridges": {"features": "none"}}}',
        *(
            some_json().replace(f'"{name}"', '"other"')
            for name in (*MODELS, *LIMITS, *STANDARD, *AMOUNTS, "models", "features", "provenance")
        ),
        *(some_json().replace("-1.25", value) for value in ('"shut"', "null", "[]")),
    ],
)
def test_text_that_is_no_weights_is_refused(text: str) -> None:
    with pytest.raises(MatcherError, match="weights of the score: not such a file"):
        ScoreWeights.from_json(text)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("name", FEATURES)
def test_weights_of_other_features_are_refused(model: str, name: str) -> None:
    document = json.loads(some_json())
    row = document["models"][model]["features"][FEATURES.index(name)]
    row["name"] = "another feature"
    with pytest.raises(MatcherError, match="other features"):
        ScoreWeights.from_json(json.dumps(document))


@pytest.mark.parametrize("model", MODELS)
def test_weights_of_fewer_or_swapped_features_are_refused(model: str) -> None:
    for change in (lambda rows: rows[:-1], lambda rows: rows[::-1], lambda rows: []):
        document = json.loads(some_json())
        document["models"][model]["features"] = change(document["models"][model]["features"])
        with pytest.raises(MatcherError, match="other features"):
            ScoreWeights.from_json(json.dumps(document))
