"""Evidence and score: kernels against slow twins, known overlays, and what raises or lowers."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matching_prints import (
    COMPILED,
    Points,
    even_field,
    jittered,
    seeds,
    spread_points,
    template_of,
    templates,
)
from numpy.typing import NDArray

from fpmatch.errors import MatcherError
from fpmatch.matching import _evidence_kernel as kernel
from fpmatch.matching._print_kernel import Print
from fpmatch.matching.align import Alignment, align
from fpmatch.matching.local import local_likeness, most_alike
from fpmatch.matching.neighbourhood import neighbourhoods
from fpmatch.matching.prepare import PreparationParameters, PreparedTemplate, Region, prepare
from fpmatch.matching.rounding import flow_of
from fpmatch.matching.score import (
    FEATURES,
    WEIGHTS_FILE,
    Evidence,
    ScoreParameters,
    ScoreWeights,
    features,
    gather_evidence,
    load_weights,
    similarity,
)
from fpmatch.minutiae import Template

P = ScoreParameters()
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


def field_agreement_twin(transform: Floats, a: Region, b: Region) -> tuple[float, ...]:
    """Return area, orientation, change and roughness, with arrays of complex numbers."""
    linear, shift = transform[0] + 1j * transform[1], transform[2] + 1j * transform[3]
    row, column = np.indices(a.code.shape) + 0.5
    z = (column + a.first_column) * a.step - 1j * (row + a.first_row) * a.step
    z = shift + linear * z
    inside = (a.code > 0) & b.holds(z.real.ravel(), z.imag.ravel()).reshape(z.shape)
    column = np.floor(z.real / b.step).astype(int) - b.first_column
    row = np.floor(-z.imag / b.step).astype(int) - b.first_row
    other = np.zeros_like(a.code)
    other[inside] = b.code[row[inside], column[inside]]
    here, there = (c + 1j * s for c, s in (flow_of(a.code), flow_of(other)))
    difference = (there * np.conj(here * linear**2 / abs(linear) ** 2))[inside]
    turns_a, turns_b = [], []
    for one, two in (((slice(1, None),), (slice(-1),)), ((..., slice(1, None)), (..., slice(-1)))):
        both = inside[one] & inside[two]
        turns_a.append((here[one] * np.conj(here[two]))[both])
        turns_b.append((there[one] * np.conj(there[two]))[both])
    u, v = np.concatenate(turns_a), np.concatenate(turns_b)
    bottom = np.sqrt((u.imag**2).sum() * (v.imag**2).sum()) + P.doubt_change
    return (
        float(inside.sum() * a.step**2),
        float(difference.real.sum() / (inside.sum() + P.doubt_cells)),
        float((u.imag * v.imag).sum() / bottom),
        float(1 - (u * np.conj(v)).real.sum() / (len(u) + P.doubt_cells)),
    )


def print_of(points: Points, region: Region | None = None, type_: Any = Print) -> Any:
    """Return a print as the kernels see it, all of the best quality."""
    n = neighbourhoods(points)
    quality = np.ones(points.shape[1])
    print_ = type_(points, quality, n.count, n.frame, n.ring_start, n.ring, n.circle)
    if region:
        at = (region.first_row, region.first_column)
        print_.set_region(region.code, *at, region.step, region.inside, region.has_flow)
    return print_


def field_agreement(
    transform: Floats, a: Region, b: Region, module: ModuleType = kernel, type_: Any = Print
) -> tuple[float, ...]:
    """Return what the kernel finds: area, orientation, change and roughness."""
    sides = [print_of(np.empty((4, 0)), region, type_) for region in (a, b)]
    evidence = np.full(module.ENTRIES, np.nan)
    above = np.full(a.code.shape[1], -7, np.int32)
    module.field_agreement(
        *sides, *transform.tolist(), P.doubt_cells, P.doubt_change, above, evidence
    )
    return evidence[4], *evidence[6:9]


def some_region(rng: np.random.Generator, step: float) -> Region:
    """Return a region of random cells and orientations, away from the corner."""
    code = rng.integers(0, 256, (9, 12)).astype(np.uint8) * (rng.random((9, 12)) < 0.7)
    return Region(step, code.astype(np.uint8), 2, 1, has_flow=True)


def overlay(
    a: PreparedTemplate, b: PreparedTemplate, partner: Ints, transform: Floats = IDENTITY
) -> Evidence:
    """Return the evidence of an alignment that is given."""
    linear, shift = transform[0] + 1j * transform[1], transform[2] + 1j * transform[3]
    z = shift + linear * (a.points[0] + 1j * a.points[1])
    bent = np.vstack([z.real, z.imag, a.points[2:]])
    alignment = Alignment(transform, partner, (partner >= 0).astype(float), bent)
    return gather_evidence(a, b, alignment, local_likeness(a.neighbourhoods, b.neighbourhoods))


def alone(print_: PreparedTemplate, partner: Ints | None = None) -> Evidence:
    """Return the evidence of a print laid over itself, all minutiae paired or those given."""
    n = len(print_)
    return overlay(print_, print_, np.arange(n, dtype=np.int32) if partner is None else partner)


@given(seeds, st.sampled_from([4.0, 16.0, 21.5]))
def test_field_agreement_agrees_with_its_twin(seed: int, step: float) -> None:
    rng = np.random.default_rng(seed)
    a, b = some_region(rng, 16.0), some_region(rng, step)
    turn, scale = rng.uniform(-4, 4), rng.uniform(0.9, 1.1)
    transform = np.array([scale * np.cos(turn), scale * np.sin(turn), *rng.uniform(-150, 150, 2)])
    found = field_agreement(transform, a, b)
    assert found == pytest.approx(field_agreement_twin(transform, a, b), abs=1e-9)


def test_a_turned_field_agrees_once_it_is_turned_back() -> None:
    """Cells of ridges at 0.6 rad, on a plane of ridges at 1.5: they agree when turned by 0.9."""
    a = prepare(template_of(np.empty((4, 0)), field=even_field(orientation=0.6))).region
    b = prepare(template_of(np.empty((4, 0)), field=even_field(orientation=1.5))).region
    cosines = {}
    for turn in (0.9, 0.0, 0.9 - np.pi / 2, 0.9 + np.pi):
        transform = np.array([np.cos(turn), np.sin(turn), 0.0, 0.0])
        middle = np.array([200.0, -200.0])
        turned = np.array([[transform[0], -transform[1]], [transform[1], transform[0]]]) @ middle
        transform[2:] = middle - turned
        area, orientation, *_ = field_agreement(transform, a, b)
        cells = area / 16.0**2
        assert cells > 400
        cosines[turn] = orientation * (cells + P.doubt_cells) / cells
    # to the steps in which orientations are kept
    assert list(cosines.values()) == pytest.approx([1, math.cos(1.8), -1, 1], abs=0.03)


def test_orientations_that_change_alike_are_told_from_those_that_do_not() -> None:
    rng = np.random.default_rng(4)
    bends = np.cumsum(rng.normal(0, 8, (12, 15)), axis=1)
    regions = [
        Region(16.0, (np.rint(field).astype(int) % 255 + 1).astype(np.uint8), 0, 0, has_flow=True)
        for field in (bends, bends + 40, bends[::-1])
    ]
    same, turned, other = (field_agreement(IDENTITY, regions[0], b) for b in regions)
    assert same[2] == turned[2] > 0.95
    assert other[2] < 0.5
    assert same[3] == turned[3] < 0.04 < other[3]
    assert same[1] > 0.9 > turned[1]


@given(seeds)
def test_compiled_and_interpreted_agree(
    interpreted: Callable[[str], ModuleType], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    a, b = some_region(rng, 16.0), some_region(rng, 12.0)
    plain, plain_print = interpreted("_evidence_kernel"), interpreted("_print_kernel").Print
    transform = np.array([0.8, 0.6, 30.0, 5.0])
    assert field_agreement(transform, a, b) == pytest.approx(
        field_agreement(transform, a, b, plain, plain_print), rel=1e-12
    )
    evidence, weights = rng.uniform(0, 5, kernel.ENTRIES), load_weights()
    constants = (P.doubt_pairs, P.doubt_area_px2, P.least_roughness)
    learned = (weights.standard, weights.bias, np.empty(len(FEATURES)))
    assert kernel.weigh(evidence, *constants, *learned) == pytest.approx(
        plain.weigh(evidence, *constants, *learned), rel=1e-12
    )


def test_a_print_laid_over_itself() -> None:
    points = spread_points(np.random.default_rng(6), 25, spacing=20.0)
    print_ = prepare(template_of(points, field=even_field()))
    found = alone(print_)
    cells = print_.region.cells.shape[1]
    assert found.pairs == 25
    assert found.common == 50
    assert found.unpaired == 0
    assert found.agreement == 1.0
    assert found.overlap == 1.0
    assert found.area == pytest.approx(cells * 16.0**2)
    assert found.orientation == pytest.approx(cells / (cells + P.doubt_cells))
    assert found.change == 0.0  # the ridges run one way everywhere
    assert 0 < found.roughness < 0.02
    assert found.flow
    assert found.local >= 25 - 1e-3


def test_prints_side_by_side_have_nothing_in_common() -> None:
    print_ = prepare(template_of(spread_points(np.random.default_rng(6), 25), field=even_field()))
    nobody = np.full(25, -1, np.int32)
    found = overlay(print_, print_, nobody, np.array([1.0, 0.0, 900.0, 0.0]))
    assert dataclasses.astuple(found) == (0, 0.0, 0.0, 0, 0.0, 0.0, 0.0, 0.0, 1.0, True)
    assert found.agreement == 0.0


def inside_by(points: Points, shift: float, margin: float) -> NDArray[np.bool_]:
    """Tell which minutiae, shifted sideways, lie so far inside a square of 400 px."""
    x, y = points[0] + shift, -points[1]
    return (np.minimum(x, y) >= margin) & (np.maximum(x, y) < 400 - margin)


def test_minutiae_count_in_the_common_region_alone() -> None:
    """Of a print moved by half its width, the minutiae that come to lie beside it do not count."""
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
    print_ = prepare(template_of(points, field=even_field(side=2)))
    found = alone(print_)
    assert found.common == 20
    assert found.agreement == 1.0


def test_unpaired_minutiae_count_by_the_square_of_their_quality() -> None:
    points = spread_points(np.random.default_rng(6), 12)
    points[:2] += [[50], [-50]]
    quality = np.array([100, 50, 0, 30] + [80] * 8)
    print_ = prepare(template_of(points, quality=quality, field=even_field()))
    partner = np.arange(12, dtype=np.int32)
    partner[:4] = -1
    found = alone(print_, partner)
    assert found.unpaired == pytest.approx(2 * (1 + 0.25 + 0.09))
    assert found.pairs == 8
    assert found.common == 24


def test_a_template_that_tells_no_qualities_has_the_usual_one() -> None:
    points = spread_points(np.random.default_rng(6), 6)
    usual = PreparationParameters().usual_quality
    assert prepare(template_of(points)).quality.tolist() == [usual] * 6
    told = prepare(template_of(points, quality=np.array([100] * 5 + [99]))).quality
    assert told.tolist() == [1.0] * 5 + [0.99]


def test_poor_minutiae_without_a_partner_are_forgiven() -> None:
    points = spread_points(np.random.default_rng(6), 12)
    partner = np.arange(12, dtype=np.int32)
    partner[:4] = -1
    scores = [
        similarity(alone(prepare(template_of(points, quality=np.full(12, quality))), partner))
        for quality in (99, 60, 20, 0)
    ]
    assert scores == sorted(scores)
    assert scores[0] < scores[-1]


@pytest.mark.parametrize("with_field", [(True, False), (False, True), (False, False)])
def test_unknown_orientation_is_neutral(with_field: tuple[bool, bool]) -> None:
    points = spread_points(np.random.default_rng(6), 20)
    a, b = (
        prepare(template_of(points, field=even_field() if known else None)) for known in with_field
    )
    found = overlay(a, b, np.arange(20, dtype=np.int32))
    assert not found.flow
    assert 0.8 < found.overlap <= 1.0
    any_flow = replace(found, orientation=-0.9, change=-0.5, roughness=1.4)
    assert similarity(any_flow) == similarity(found) > 0
    middles = dict(zip(FEATURES, load_weights().standard[0].tolist(), strict=True))
    halfway = replace(
        found,
        flow=True,
        orientation=middles["orientation"],
        change=middles["change of orientation"],
        roughness=math.exp(middles["roughness"]) - P.least_roughness,
    )
    assert similarity(halfway) == pytest.approx(similarity(found))


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
    likeness = local_likeness(a.neighbourhoods, b.neighbourhoods)
    alignment = align(a.points, b.points, most_alike(likeness))
    if alignment is None:
        assert not likeness.any()
        return
    found = gather_evidence(a, b, alignment, likeness)
    assert 0 <= found.pairs <= min(len(a), len(b))
    assert 2 * found.pairs <= found.common <= len(a) + len(b)
    assert 0 <= found.unpaired <= found.common - 2 * found.pairs + 1e-9
    assert 0 <= found.agreement <= 1
    assert 0 <= found.overlap <= 1
    assert -1 <= found.orientation <= 1
    assert -1 <= found.change <= 1
    assert 0 <= found.roughness <= 2
    assert found.area >= 0
    assert found.local >= 0
    assert np.isfinite(features(found)).all()
    assert 0 < similarity(found) < math.inf


EVIDENCE = Evidence(
    pairs=20,
    local=9.0,
    unpaired=6.0,
    common=52,
    area=40_000.0,
    overlap=0.7,
    orientation=0.8,
    change=0.6,
    roughness=0.05,
    flow=True,
)


@given(
    st.sampled_from(["local", "orientation", "change", "overlap", "area", "unpaired"]),
    st.floats(0.01, 1),
    st.floats(0.01, 1),
)
def test_what_agrees_raises_and_what_does_not_lowers(name: str, low: float, more: float) -> None:
    less, greater = (similarity(replace(EVIDENCE, **{name: v})) for v in (low, low + more))
    assert (less > greater) if name == "unpaired" else (less < greater)


def test_features_are_the_formulas_of_the_module() -> None:
    assert features(EVIDENCE).tolist() == pytest.approx(
        [
            math.log(1 + 9),
            math.log((1 + 9) / (1 + 20)),
            math.sqrt(6 / (20 + 2)),
            math.log(40_000 + 5_000),
            0.7,
            0.8,
            0.6,
            math.log(0.05 + 0.002),
        ]
    )


def test_similarity_is_the_standardised_features_weighted_sum() -> None:
    middle, spread, weight = np.random.default_rng(2).uniform(0.5, 2, (3, len(FEATURES)))
    total = float((weight * (features(EVIDENCE) - middle) / spread).sum())
    for bias in (-40.0, 0.0, 40.0):
        weights = ScoreWeights(np.stack([middle, spread, weight]), bias, {})
        found = similarity(EVIDENCE, weights=weights)
        assert found == pytest.approx(math.log1p(math.exp(total + bias)))


def test_weights_read_back_are_the_same() -> None:
    weights = load_weights()
    again = ScoreWeights.from_json(weights.as_json())
    assert again.as_json() == weights.as_json() == WEIGHTS_FILE.read_text(encoding="utf-8")
    assert again.standard.tolist() == weights.standard.tolist()


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"bias": 1, "features": [{}]}'])
def test_what_holds_no_weights_is_refused(text: str) -> None:
    with pytest.raises(MatcherError, match="weights of the score"):
        ScoreWeights.from_json(text)


def test_weights_of_other_features_are_refused() -> None:
    with pytest.raises(MatcherError, match="other features"):
        ScoreWeights.from_json(load_weights().as_json().replace("unpaired", "lonely"))


@given(st.floats(0.5, 1), st.floats(0, 1), st.integers(2, 40))
def test_a_good_pair_that_is_lost_lowers_the_similarity(
    each: float, quality: float, pairs: int
) -> None:
    before = replace(EVIDENCE, pairs=pairs, local=pairs * each)
    after = replace(
        before,
        pairs=pairs - 1,
        local=(pairs - 1) * each,
        unpaired=before.unpaired + 2 * quality**2,
    )
    assert similarity(after) < similarity(before)


@given(seeds)
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
        found.append(similarity(overlay(a, b, partner)))
        partner[lost[: n // 4]] = -1
        lost = lost[n // 4 :]
    assert found == sorted(found, reverse=True)
