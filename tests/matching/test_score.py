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
    moved,
    seeds,
    spread_points,
    template_of,
    templates,
)
from numpy.typing import NDArray

from fpmatch.matching import _evidence_kernel as kernel
from fpmatch.matching._print_kernel import Print
from fpmatch.matching.align import Alignment, align
from fpmatch.matching.local import local_likeness, most_alike
from fpmatch.matching.neighbourhood import Neighbourhoods, neighbourhoods
from fpmatch.matching.prepare import PreparedTemplate, Region, prepare
from fpmatch.matching.rounding import flow_of
from fpmatch.matching.score import Evidence, ScoreParameters, gather_evidence, similarity
from fpmatch.minutiae import Template

P = ScoreParameters()
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


def ring_agreement_twin(partner: Ints, a: Neighbourhoods, b: Neighbourhoods) -> float:
    """Return the ring agreement with a dictionary for each ring."""

    def rings(n: Neighbourhoods) -> list[dict[int, tuple[complex, float]]]:
        found = []
        for i in range(len(n.count)):
            entries = range(n.ring_start[i], n.ring_start[i + 1])
            found.append(
                {int(n.ring[k]): (complex(*n.circle[:2, k]), n.circle[2, k]) for k in entries}
            )
        return found

    rings_a, rings_b = rings(a), rings(b)
    total = 0.0
    for i, j in enumerate(partner.tolist()):
        for neighbour, (place, weight) in rings_a[i].items() if j >= 0 else ():
            if partner[neighbour] in rings_b[j]:
                place_b, weight_b = rings_b[j][partner[neighbour]]
                total += min(weight, weight_b) * (place * place_b.conjugate()).real
    return total


def field_agreement_twin(transform: Floats, a: Region, b: Region) -> tuple[float, float]:
    """Return the number of common cells and the sum of their agreement, with complex numbers."""
    linear, shift = transform[0] + 1j * transform[1], transform[2] + 1j * transform[3]
    x, y, c, s = a.cells
    z = shift + linear * (x + 1j * y)
    inside = b.holds(z.real, z.imag)
    column = np.floor(z.real[inside] / b.step).astype(int) - b.first_column
    row = np.floor(-z.imag[inside] / b.step).astype(int) - b.first_row
    doubled = (c + 1j * s) * linear**2 / abs(linear) ** 2
    there = flow_of(b.code)[:, row, column]
    agreement = doubled[inside] * (there[0] - 1j * there[1])
    return float(inside.sum()), float(agreement.real.sum())


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
) -> tuple[float, float]:
    """Return what the kernel finds: the number of common cells and the sum of their agreement."""
    sides = [print_of(np.empty((4, 0)), region, type_) for region in (a, b)]
    evidence = np.full(module.ENTRIES, np.nan)
    module.field_agreement(*sides, *transform.tolist(), evidence)
    return evidence[6], evidence[5]


def some_region(rng: np.random.Generator, step: float) -> Region:
    """Return a region of random cells and orientations, away from the corner."""
    code = rng.integers(0, 256, (9, 12)).astype(np.uint8) * (rng.random((9, 12)) < 0.7)
    return Region(step, code.astype(np.uint8), 2, 1, has_flow=True)


def ring_agreement(
    points_a: Points,
    points_b: Points,
    partner: Ints,
    module: ModuleType = kernel,
    type_: Any = Print,
) -> float:
    """Return what the kernel finds."""
    sides = [print_of(points, type_=type_) for points in (points_a, points_b)]
    return module.ring_agreement(*sides, partner)


def two_impressions(
    seed: int, n: int = 20, transform: tuple[float, complex] = (0.0, 0j)
) -> tuple[Points, Points, Ints]:
    """Return two impressions, and the partner in the second of each minutia of the first."""
    rng = np.random.default_rng(seed)
    a = spread_points(rng, n)
    order = rng.permutation(n)
    b = jittered(rng, moved(a, *transform), 1.5, 0.05)[:, order]
    partner = np.argsort(order).astype(np.int32)
    partner[rng.random(n) < 0.3] = -1
    return a, np.ascontiguousarray(b), partner


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


@given(seeds)
def test_ring_agreement_agrees_with_its_twin(seed: int) -> None:
    points_a, points_b, partner = two_impressions(seed)
    a, b = neighbourhoods(points_a), neighbourhoods(points_b)
    fast = ring_agreement(points_a, points_b, partner)
    assert fast == pytest.approx(ring_agreement_twin(partner, a, b), abs=1e-9)


def test_a_ring_agrees_with_itself_by_the_whole_of_its_weight() -> None:
    points = spread_points(np.random.default_rng(3), 25)
    rings = np.count_nonzero(np.diff(neighbourhoods(points).ring_start))
    agreement = ring_agreement(points, points, np.arange(25, dtype=np.int32))
    assert agreement == pytest.approx(rings)


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
        cells, sum_ = field_agreement(transform, a, b)
        assert cells > 400
        cosines[turn] = sum_ / cells
    # to the steps in which orientations are kept
    assert list(cosines.values()) == pytest.approx([1, math.cos(1.8), -1, 1], abs=0.03)


@given(seeds)
def test_compiled_and_interpreted_agree(
    interpreted: Callable[[str], ModuleType], seed: int
) -> None:
    points_a, points_b, partner = two_impressions(seed, 12)
    rng = np.random.default_rng(seed)
    a, b = some_region(rng, 16.0), some_region(rng, 12.0)
    plain, plain_print = interpreted("_evidence_kernel"), interpreted("_print_kernel").Print
    transform = np.array([0.8, 0.6, 30.0, 5.0])
    assert field_agreement(transform, a, b) == pytest.approx(
        field_agreement(transform, a, b, plain, plain_print), rel=1e-12
    )
    assert ring_agreement(points_a, points_b, partner) == ring_agreement(
        points_a, points_b, partner, plain, plain_print
    )
    evidence = rng.uniform(0, 5, kernel.ENTRIES)
    assert kernel.weigh(evidence, P.of_weighing) == plain.weigh(evidence, P.of_weighing)


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
    assert found.orientation == pytest.approx(cells / (cells + P.orientation_doubt_cells))
    assert found.local >= 25 - 1e-3
    assert found.circle == pytest.approx(
        np.count_nonzero(np.diff(print_.neighbourhoods.ring_start)), rel=1e-4
    )


def test_prints_side_by_side_have_nothing_in_common() -> None:
    print_ = prepare(template_of(spread_points(np.random.default_rng(6), 25), field=even_field()))
    nobody = np.full(25, -1, np.int32)
    found = overlay(print_, print_, nobody, np.array([1.0, 0.0, 900.0, 0.0]))
    assert dataclasses.astuple(found) == (0, 0.0, 0.0, 0.0, 0, 0.0, 0.0)
    assert found.agreement == 0.0


def test_minutiae_count_in_the_common_region_alone() -> None:
    """Of a print moved by half its width, the minutiae that come to lie beside it do not count."""
    points = spread_points(np.random.default_rng(6), 30, size=400.0)
    print_ = prepare(template_of(points, field=even_field()))
    nobody = np.full(30, -1, np.int32)
    found = overlay(print_, print_, nobody, np.array([1.0, 0.0, 208.0, 0.0]))
    expected = np.count_nonzero(points[0] + 208 < 400) + np.count_nonzero(points[0] - 208 >= 0)
    assert found.common == expected
    assert found.unpaired == pytest.approx(expected)
    assert found.overlap == pytest.approx(12 / 25)


def test_pairs_count_as_common_wherever_they_lie() -> None:
    points = spread_points(np.random.default_rng(6), 10)
    print_ = prepare(template_of(points, field=even_field(side=2)))
    found = alone(print_)
    assert found.common == 20
    assert found.agreement == 1.0


def test_unpaired_minutiae_count_by_their_quality() -> None:
    points = spread_points(np.random.default_rng(6), 12)
    quality = np.array([100, 50, 0, 25] + [80] * 8)
    print_ = prepare(template_of(points, quality=quality, field=even_field()))
    partner = np.arange(12, dtype=np.int32)
    partner[:4] = -1
    found = alone(print_, partner)
    assert found.unpaired == pytest.approx(2 * 1.75)
    assert found.pairs == 8
    assert found.common == 24


def test_poor_minutiae_without_a_partner_are_forgiven() -> None:
    points = spread_points(np.random.default_rng(6), 12)
    partner = np.arange(12, dtype=np.int32)
    partner[:4] = -1
    scores = [
        similarity(alone(prepare(template_of(points, quality=np.full(12, quality))), partner))
        for quality in (100, 60, 20, 0)
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
    assert found.orientation == P.unknown_orientation
    assert 0.8 < found.overlap <= 1.0


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
    assert found.local >= 0
    assert abs(found.circle) <= found.pairs * (1 + 1e-3)
    assert 0 < similarity(found) < math.inf


EVIDENCE = Evidence(
    pairs=20, local=9.0, circle=4.0, unpaired=6.0, common=52, orientation=0.8, overlap=0.7
)


@given(
    st.sampled_from(["local", "circle", "orientation", "overlap", "unpaired"]),
    st.floats(0.01, 1),
    st.floats(0.01, 1),
)
def test_what_agrees_raises_and_what_does_not_lowers(name: str, low: float, more: float) -> None:
    less, greater = (similarity(replace(EVIDENCE, **{name: v})) for v in (low, low + more))
    assert (less > greater) if name == "unpaired" else (less < greater)


def test_rings_that_disagree_count_as_none() -> None:
    assert similarity(replace(EVIDENCE, circle=-3.0)) == similarity(replace(EVIDENCE, circle=0.0))


def test_similarity_is_the_formula_of_its_docstring() -> None:
    p = ScoreParameters(
        local_power=3.0,
        circle_power=0.5,
        unpaired_power=1.0,
        unpaired_offset=2.0,
        orientation_weight=1.5,
        overlap_weight=1.0,
    )
    expected = (1 + 9) ** 3 * math.sqrt(1 + 4) * math.exp(1.5 * 0.8 + 0.7) / (2 + 6)
    assert similarity(EVIDENCE, p) == pytest.approx(expected)


@given(seeds)
def test_every_pair_that_is_lost_lowers_the_similarity(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = 16 if COMPILED else 8
    points = spread_points(rng, n)
    a = prepare(template_of(points, quality=rng.integers(1, 101, n), field=even_field()))
    b = prepare(template_of(jittered(rng, points, 1.5, 0.05), field=even_field()))
    partner = np.arange(n, dtype=np.int32)
    before = similarity(overlay(a, b, partner))
    for i in rng.permutation(n):
        partner[i] = -1
        after = similarity(overlay(a, b, partner))
        assert after < before
        before = after
