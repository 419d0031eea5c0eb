"""Evidence and score: the kernel against slow twins, known overlays, and what raises or lowers."""

from __future__ import annotations

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
from matching_prints import (
    COMPILED,
    Points,
    even_field,
    heaviest,
    jittered,
    moved,
    seeds,
    spread_points,
    striped_field,
    template_of,
    templates,
)
from matching_weights import ALWAYS, DISMISSING, NEVER, print_for, some_weights, weighing
from numpy.typing import NDArray

from fpmatch.errors import MatcherError
from fpmatch.matching.align import Alignment, at_rest
from fpmatch.matching.local import local_likeness, most_alike
from fpmatch.matching.prepare import PreparationParameters, PreparedTemplate, prepare
from fpmatch.matching.ridges import RidgeParameters, ridge_correlation
from fpmatch.matching.score import (
    FEATURES,
    NO_GLANCE,
    STANDARD,
    WEIGHTS_FILE,
    Evidence,
    ScoreParameters,
    ScoreWeights,
    gather_evidence,
    load_weights,
    scales,
)
from fpmatch.minutiae import RidgeField, Template

P = ScoreParameters()
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
ENTRIES = ("pairs", "local", "unpaired", "common", "overlap", "ridges", "cells")
FEW = 20 if COMPILED else 6

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


def laid_by(a: PreparedTemplate, partner: Ints, transform: Floats = IDENTITY) -> Alignment:
    """Return the alignment of given pairs under a given transform, without any bending."""
    linear, shift = transform[0] + 1j * transform[1], transform[2] + 1j * transform[3]
    z = shift + linear * (a.points[0] + 1j * a.points[1])
    bent = np.vstack([z.real, z.imag, a.points[2:]])
    return Alignment(transform, partner, (partner >= 0).astype(float), bent)


def overlay(
    a: PreparedTemplate,
    b: PreparedTemplate,
    partner: Ints,
    transform: Floats = IDENTITY,
    weights: ScoreWeights | None = None,
) -> Evidence:
    """Return the evidence of an alignment that is given."""
    likeness = local_likeness(a.neighbourhoods, b.neighbourhoods)
    on = scales(len(b), weights or some_weights())
    return gather_evidence(a, b, laid_by(a, partner, transform), likeness, on)


def alone(
    print_: PreparedTemplate, partner: Ints | None = None, weights: ScoreWeights | None = None
) -> Evidence:
    """Return the evidence of a print laid over itself, all minutiae paired or those given."""
    pairs = np.arange(len(print_), dtype=np.int32) if partner is None else partner
    return overlay(print_, print_, pairs, weights=weights)


def described(weights: ScoreWeights, **entries: float) -> list[float]:
    """Return the features of evidence of which all that is not given is 0."""
    on = scales(0, weights)
    np.asarray(on.evidence)[:] = [entries.get(name, 0.0) for name in ENTRIES]
    on.describe()
    return np.asarray(on.feature).tolist()


def total_of(weights: ScoreWeights, features: Any) -> float:
    """Return the weighted sum of features, as the module says it."""
    middle, spread, weight, _ = weights.standard
    return float(weights.bias + (weight * (features - middle) / spread).sum())


def some_case(seed: int) -> tuple[PreparedTemplate, PreparedTemplate, Ints, Floats]:
    """Return two prints, pairs of their minutiae, and a transform."""
    rng = np.random.default_rng(seed)
    points = spread_points(rng, int(rng.integers(0, 12)), size=150.0)
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
    partner = np.where(rng.random(n) < 0.6, rng.permutation(n), -1).astype(np.int32)
    linear = scale * np.exp(1j * turn)
    return *sides, partner, np.array([linear.real, linear.imag, shift.real, shift.imag])


def twin(a: PreparedTemplate, b: PreparedTemplate, alignment: Alignment) -> list[float]:
    """Return the evidence of an alignment, the ridges' aside, with arrays of complex numbers."""
    linear, shift = (complex(*alignment.transform[k : k + 2]) for k in (0, 2))
    likeness = local_likeness(a.neighbourhoods, b.neighbourhoods)
    i = np.flatnonzero(alignment.partner >= 0)
    j = alignment.partner[i]
    back = (b.points[0] + 1j * b.points[1] - shift) / linear
    common, unpaired = 2 * len(i), 0.0
    for one, other, x, y, paired in (
        (a, b, *alignment.bent[:2], i),
        (b, a, back.real, back.imag, j),
    ):
        single = np.setdiff1d(np.arange(len(one)), paired)
        u, v, holds = x[single], y[single], other.region.holds
        inside = holds(u, v)
        deep = inside.copy()
        for across, along in ((20.0, 0), (-20.0, 0), (0, 20.0), (0, -20.0)):
            deep &= holds(u + across, v + along)
        common += np.count_nonzero(inside)
        unpaired += float((one.quality[single][deep] ** 2).sum())
    x, y, *_ = a.region.cells
    laid = shift + linear * (x + 1j * y)
    shared = np.count_nonzero(b.region.holds(laid.real, laid.imag)) * a.region.step**2
    smaller = min(a.region.area, b.region.area)
    overlap = min(shared / smaller, 1.0) if smaller else 0.0
    return [len(i), float(likeness[i, j].sum()), unpaired, common, overlap]


def entries_of(found: Evidence) -> list[float]:
    return [getattr(found, name) for name in ENTRIES]


@given(seeds)
def test_evidence_agrees_with_its_twin(seed: int) -> None:
    a, b, partner, transform = some_case(seed)
    found = entries_of(overlay(a, b, partner, transform))
    alignment = laid_by(a, partner, transform)
    assert found[:5] == pytest.approx(twin(a, b, alignment), abs=1e-5)
    correlation, cells = ridge_correlation(a, b, alignment)
    assert found[5:] == [correlation if cells else 0.0, cells]


def test_the_cases_that_are_drawn_are_of_every_kind() -> None:
    found = [overlay(*some_case(seed)) for seed in range(40)]
    assert sum(one.cells > 0 for one in found) > 5
    assert sum(one.cells == 0 for one in found) > 5
    assert sum(one.unpaired > 0 for one in found) > 5
    assert sum(0 < one.overlap < 1 for one in found) > 10
    assert sum(one.common > 2 * one.pairs for one in found) > 10


@given(seeds, st.sampled_from([ALWAYS, NEVER, -12.0]))
@settings(max_examples=FEW)
def test_compiled_and_interpreted_agree(
    interpreted: Callable[[str], ModuleType], seed: int, gate: float
) -> None:
    a, b, partner, transform = some_case(seed)
    weights = some_weights(gate)
    prints, plain = interpreted("_print_kernel"), interpreted("_evidence_kernel")
    plain.RidgeLens = interpreted("_ridge_kernel").RidgeLens
    on = plain.Scales(P, RidgeParameters(), weights, len(b))
    bent = laid_by(a, partner, transform).bent
    likeness = local_likeness(a.neighbourhoods, b.neighbourhoods)
    sides = (print_for(prints, a), print_for(prints, b))
    total = on.weigh(*sides, partner, bent, *transform.tolist(), likeness)
    found = overlay(a, b, partner, transform, weights)
    assert total == pytest.approx(found.total, rel=1e-12)
    assert on.evidence.tolist() == pytest.approx(entries_of(found), rel=1e-12)
    assert on.feature.tolist() == pytest.approx(found.features.tolist(), rel=1e-12)
    assert plain.as_similarity(total) == pytest.approx(found.similarity, rel=1e-12)


@given(seeds)
@settings(max_examples=FEW)
def test_scales_remember_nothing(seed: int) -> None:
    """Not even of a print of more minutiae, or one that shows its ridges."""
    weights = some_weights()
    on = scales(12, weights)
    for a, b, partner, transform in map(some_case, (seed, seed + 1, seed + 2, seed)):
        likeness = local_likeness(a.neighbourhoods, b.neighbourhoods)
        again = gather_evidence(a, b, laid_by(a, partner, transform), likeness, on)
        fresh = overlay(a, b, partner, transform, weights)
        assert (entries_of(again), again.total) == (entries_of(fresh), fresh.total)


def test_evidence_keeps_what_the_scales_forget() -> None:
    print_ = prepare(template_of(spread_points(np.random.default_rng(1), 9)))
    likeness = local_likeness(print_.neighbourhoods, print_.neighbourhoods)
    on = scales(9, some_weights())
    first = gather_evidence(print_, print_, at_rest(print_.points), likeness, on)
    before = first.features.tolist()
    nobody = laid_by(print_, np.full(9, -1, np.int32))
    assert gather_evidence(print_, print_, nobody, likeness, on).features.tolist() != before
    assert first.features.tolist() == before


def test_without_scales_the_weights_of_the_package_count() -> None:
    print_ = prepare(template_of(spread_points(np.random.default_rng(1), 9)))
    likeness = local_likeness(print_.neighbourhoods, print_.neighbourhoods)
    with weighing(some_weights(bias=7.0)):
        found = gather_evidence(print_, print_, at_rest(print_.points), likeness)
    assert found.total == alone(print_, weights=some_weights(bias=7.0)).total


def test_a_print_laid_over_itself() -> None:
    points = spread_points(np.random.default_rng(6), 25, spacing=20.0)
    found = alone(prepare(template_of(points, field=striped_field(side=25))))
    assert found.pairs == 25
    assert found.common == 50
    assert found.unpaired == 0
    assert found.agreement == 1.0
    assert found.overlap == 1.0
    assert found.ridges == 1.0
    assert found.cells == 625
    assert found.local >= 25 - 1e-3


def test_prints_side_by_side_have_nothing_in_common() -> None:
    field = striped_field(side=25)
    print_ = prepare(template_of(spread_points(np.random.default_rng(6), 25), field=field))
    nobody = np.full(25, -1, np.int32)
    found = overlay(print_, print_, nobody, np.array([1.0, 0.0, 900.0, 0.0]))
    assert entries_of(found) == [0] * 7
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
    found = alone(prepare(template_of(points, field=even_field(side=2))))
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
        alone(prepare(template_of(points, quality=np.full(12, quality))), partner).similarity
        for quality in (99, 60, 20, 0)
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
    likeness = local_likeness(a.neighbourhoods, b.neighbourhoods)
    alignment = heaviest(a.points, b.points, most_alike(likeness))
    if alignment is None:
        assert not likeness.any()
        return
    found = gather_evidence(a, b, alignment, likeness, scales(len(b), some_weights()))
    assert 0 <= found.pairs <= min(len(a), len(b))
    assert 2 * found.pairs <= found.common <= len(a) + len(b)
    assert 0 <= found.unpaired <= found.common - 2 * found.pairs + 1e-9
    assert 0 <= found.agreement <= 1
    assert 0 <= found.overlap <= 1
    assert -1 <= found.ridges <= 1
    assert 0 <= found.cells <= a.region.inside
    assert found.local >= 0
    assert np.isfinite(found.features).all()
    assert 0 < found.similarity < math.inf


def test_features_are_the_formulas_of_the_module() -> None:
    entries = {"pairs": 20, "local": 9.0, "unpaired": 6.0, "overlap": 0.7, "common": 52}
    of_minutiae = [math.log(1 + 9), math.log((1 + 9) / (1 + 20)), math.sqrt(6 / (20 + 2)), 0.7]
    weights = some_weights()
    found = described(weights, **entries, ridges=0.45, cells=130)
    assert found == pytest.approx([*of_minutiae, 0.45, math.log(130 + 10)])
    unseen = described(weights, **entries)
    assert unseen == pytest.approx([*of_minutiae, *weights.standard[3, 4:]])
    assert len(FEATURES) == 6


def test_features_and_sum_are_those_of_the_evidence() -> None:
    for seed in range(10):
        weights = some_weights()
        found = overlay(*some_case(seed), weights)
        expected = described(weights, **dict(zip(ENTRIES, entries_of(found), strict=True)))
        assert found.features.tolist() == expected
        assert found.total == pytest.approx(total_of(weights, found.features))


@given(seeds, st.floats(-5, 5))
def test_the_sum_is_linear_in_the_weights(seed: int, factor: float) -> None:
    case, rng = some_case(seed), np.random.default_rng(seed)
    middle, spread = rng.uniform(-1, 1, 6), rng.uniform(0.1, 3, 6)
    first, second = rng.normal(size=(2, 6))

    def total(weight: Floats, bias: float) -> float:
        standard = np.stack([middle, spread, weight, np.zeros(6)])
        return overlay(*case, ScoreWeights(standard, bias, NO_GLANCE, ALWAYS, NEVER, {})).total

    summed = total(first + factor * second, 3.0)
    assert summed == pytest.approx(total(first, 3.0) + factor * total(second, 0.0), abs=1e-9)
    assert total(np.zeros(6), -2.5) == -2.5


@pytest.mark.parametrize("bias", [-800.0, -40.0, -1.0, 0.0, 1.0, 40.0, 800.0])
def test_similarity_is_the_logarithm_of_one_and_the_ratio(bias: float) -> None:
    print_ = prepare(template_of(spread_points(np.random.default_rng(1), 9)))
    standard = np.array([[0.0], [1.0], [0.0], [0.0]]).repeat(6, axis=1)
    found = alone(print_, weights=ScoreWeights(standard, bias, NO_GLANCE, NEVER, NEVER, {}))
    assert found.total == bias
    assert found.similarity == pytest.approx(np.logaddexp(0.0, bias), rel=1e-12)
    assert found.similarity > 0 or bias == -800.0


@given(
    st.sampled_from(["local", "overlap", "ridges", "cells", "unpaired"]),
    st.floats(0.01, 1),
    st.floats(0.01, 1),
)
def test_what_agrees_raises_and_what_does_not_lowers(name: str, low: float, more: float) -> None:
    weights = some_weights()
    usual = {
        "pairs": 20, "local": 9.0, "unpaired": 6.0, "overlap": 0.7, "ridges": 0.5, "cells": 99
    }  # fmt: skip
    scale = 100 if name == "cells" else 1
    less, greater = (
        total_of(weights, described(weights, **{**usual, name: scale * v}))
        for v in (low, low + more)
    )
    assert (less > greater) if name == "unpaired" else (less < greater)


@given(st.floats(0.5, 1), st.floats(0, 1), st.integers(2, 40))
def test_a_good_pair_that_is_lost_lowers_the_sum(each: float, quality: float, pairs: int) -> None:
    weights = some_weights()
    before, after = (
        total_of(weights, described(weights, pairs=n, local=n * each, unpaired=u, overlap=0.7))
        for n, u in ((pairs, 3.0), (pairs - 1, 3.0 + 2 * quality**2))
    )
    assert after < before


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


@pytest.mark.parametrize(
    "fields", [(SHOWN, NOT_SHOWN), (NOT_SHOWN, SHOWN), (NOT_SHOWN, NOT_SHOWN), (SHOWN, SHOWN)]
)
def test_ridges_that_nobody_sees_count_as_those_of_strangers(
    fields: tuple[RidgeField, RidgeField],
) -> None:
    """Because a print does not show them, or because the gate is shut."""
    a, b = with_fields(*fields)
    everyone = np.arange(20, dtype=np.int32)
    gates = [NEVER] if fields == (SHOWN, SHOWN) else [NEVER, ALWAYS]
    for gate in gates:
        weights = some_weights(gate)
        found = overlay(a, b, everyone, weights=weights)
        assert (found.ridges, found.cells) == (0.0, 0)
        assert found.features[4:].tolist() == weights.standard[3, 4:].tolist()
        assert found.total == alone(with_fields(NOT_SHOWN)[0], weights=weights).total
        assert found.total == pytest.approx(total_of(weights, found.features))


def test_ridges_as_those_of_strangers_change_nothing() -> None:
    """Whether they are seen or not: the sum goes on where it was."""
    a, b = with_fields(SHOWN, replace(SHOWN, ridges=SHOWN.ridges[::-1]))  # type: ignore[index]
    everyone = np.arange(20, dtype=np.int32)
    seen = overlay(a, b, everyone)
    assert seen.cells > 0
    weights = some_weights(NEVER)
    weights.standard[3, 4:] = seen.features[4:]
    assert overlay(a, b, everyone, weights=weights).total == pytest.approx(seen.total)


def test_above_the_gate_ridges_count() -> None:
    shown, plain = with_fields(SHOWN, NOT_SHOWN)
    unseen = alone(plain).total
    for gate, looked in ((unseen - 1e-9, True), (unseen, False), (unseen + 1.0, False)):
        found = alone(shown, weights=some_weights(gate))
        assert (found.cells == 625) is looked
        assert (found.total > unseen) is looked
        assert looked or found.total == unseen


def test_the_gate_is_passed_by_the_sum_without_ridges() -> None:
    """Ridges that disagree may well take the sum back below the gate."""
    a, b = with_fields(SHOWN, striped_field(side=25, orientation=0.6 + math.pi / 2))
    everyone = np.arange(20, dtype=np.int32)
    unseen = overlay(a, b, everyone, weights=some_weights(NEVER)).total
    weights = some_weights(unseen - 1e-6)
    weights.standard[3, 4] = 0.8  # so that any ridges are worse than a stranger's
    weights = replace(
        weights, gate=overlay(a, b, everyone, weights=replace(weights, gate=NEVER)).total - 1e-6
    )
    found = overlay(a, b, everyone, weights=weights)
    assert found.cells > 0
    assert found.total < weights.gate


def test_a_print_that_shows_its_ridges_is_more_like_itself() -> None:
    shown, plain, bare = with_fields(SHOWN, NOT_SHOWN, None)
    assert alone(shown).total > alone(plain).total
    assert alone(shown).ridges == 1.0
    assert alone(bare).cells == 0


def some_json() -> str:
    return some_weights(gate=-1.25, glance=DISMISSING, sure=7.5).as_json()


@given(st.lists(st.floats(-1e6, 1e6), min_size=30, max_size=30))
def test_weights_read_back_are_the_same(numbers: list[float]) -> None:
    standard = np.array(numbers[:24]).reshape(4, 6)
    bias, base, growth, most, gate, sure = numbers[24:]
    provenance = {"sets": ["one", "two"], "n": 3}
    weights = ScoreWeights(standard, bias, (base, growth, most), gate, sure, provenance)
    again = ScoreWeights.from_json(weights.as_json())
    assert again.standard.tolist() == standard.tolist()
    assert (again.bias, again.glance) == (weights.bias, weights.glance)
    assert (again.gate, again.sure) == (weights.gate, weights.sure)
    assert again.provenance == weights.provenance
    assert again.as_json() == weights.as_json()


def test_the_file_names_every_feature_and_what_is_known_of_it() -> None:
    document = json.loads(some_json())
    assert [row["name"] for row in document["features"]] == list(FEATURES)
    for k, row in enumerate(document["features"]):
        assert list(row) == ["name", *STANDARD]
        assert [row[key] for key in STANDARD] == some_weights().standard[:, k].tolist()
    assert (document["bias"], document["gate"], document["sure"]) == (0.4, -1.25, 7.5)
    assert document["glance"] == list(DISMISSING)
    assert document["provenance"] == {"by": "hand"}


def test_the_weights_of_the_package_are_as_they_were_written() -> None:
    weights = load_weights()
    assert weights.as_json() == WEIGHTS_FILE.read_text(encoding="utf-8")
    assert np.isfinite(weights.standard).all()
    assert math.isfinite(weights.bias)
    assert math.isfinite(weights.gate)
    assert weights.sure > weights.gate
    assert weights.glance[1] > 0
    assert (weights.standard[1] > 0).all()
    unpaired = FEATURES.index("unpaired")
    assert weights.standard[2, unpaired] < 0
    assert weights.standard[2, FEATURES.index("likeness")] > 0
    assert weights.standard[2, FEATURES.index("ridges")] > 0


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{}", "3", '{"bias": 1, "features": [{}]}', '{"features": "none"}']
    + [some_json().replace(f'"{name}"', '"other"') for name in ("bias", "gate", "provenance")]
    + [some_json().replace(f'"{name}"', '"other"') for name in STANDARD]
    + [some_json().replace("-1.25", value) for value in ('"shut"', "null", "[]")],
)
def test_what_holds_no_weights_is_refused(text: str) -> None:
    with pytest.raises(MatcherError, match="weights of the score: not such a file"):
        ScoreWeights.from_json(text)


@pytest.mark.parametrize("name", FEATURES)
def test_weights_of_other_features_are_refused(name: str) -> None:
    with pytest.raises(MatcherError, match="other features"):
        ScoreWeights.from_json(some_json().replace(f'"name": "{name}"', '"name": "loneliness"'))


def test_weights_of_fewer_features_are_refused() -> None:
    document = json.loads(some_json())
    del document["features"][-1]
    with pytest.raises(MatcherError, match="other features"):
        ScoreWeights.from_json(json.dumps(document))
