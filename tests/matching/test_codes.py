"""Shortlists: what the kernel weighs is what a plain form of it weighs, of any print."""

from __future__ import annotations

import math
from functools import cache
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matching_prints import (
    COMPILED,
    jittered,
    moved,
    seeds,
    spread_points,
    striped_field,
    template_of,
    templates,
)

from fpmatch.errors import MatcherError
from fpmatch.matching.neighbourhood import NeighbourhoodParameters
from fpmatch.matching.prepare import PreparedTemplate, prepare
from fpmatch.matching.prepared_many import PreparedMany
from fpmatch.matching.rounding import ORIENTATIONS
from fpmatch.matching.shortlist import (
    BINS,
    TURNS,
    CodedPrints,
    ShortlistParameters,
    direction_codes,
)
from fpmatch.minutiae import Template

EXAMPLES = 6 if COMPILED else 3
PRINT_SIZE = 14 if COMPILED else 8
SECTORS = 16  # of a neighbour's direction, as the kernel has them
UNKNOWN = -1


@cache
def turns_of(print_: PreparedTemplate) -> list[int]:
    return [int(k) for k in direction_codes(print_.points[2:].T.astype(np.float32))]


@cache
def orientation_at(print_: PreparedTemplate, i: int, place: tuple[float, float]) -> float:
    """Return the ridge orientation at a place of a minutia's frame, in bins, or `UNKNOWN`."""
    x, y, c, s = print_.points[:, i].tolist()
    region = print_.region
    column = math.floor((x + c * place[0] - s * place[1]) / region.step) - region.first_column
    row = math.floor(-(y + s * place[0] + c * place[1]) / region.step) - region.first_row
    rows, columns = region.code.shape
    if not (region.has_flow and 0 <= row < rows and 0 <= column < columns):
        return UNKNOWN
    if not region.code[row, column]:
        return UNKNOWN
    relative = (int(region.code[row, column]) - 1.0) * BINS / ORIENTATIONS
    return (relative - turns_of(print_)[i] * 2.0 * BINS / TURNS) % BINS


def agreeing_neighbours(
    a: PreparedTemplate, i: int, b: PreparedTemplate, j: int, p: ShortlistParameters
) -> int:
    """Return how many neighbours of j have a cell near which i has one."""
    frame = a.neighbourhoods.frame[i, :, : a.neighbourhoods.count[i], None].astype(np.float64)
    m = b.neighbourhoods.neighbour[j, : b.neighbourhoods.count[j]]
    turns = np.array(turns_of(b))
    c, s = b.points[2:, j].tolist()
    dx, dy = b.points[:2, m] - b.points[:2, j : j + 1]
    u = np.floor((c * dx + s * dy) / p.cell_px)
    v = np.floor((c * dy - s * dx) / p.cell_px)
    known = (np.stack([u, v]) >= -p.cells_from_middle) & (np.stack([u, v]) < p.cells_from_middle)
    angle = ((turns[m] - turns[j]) % TURNS * SECTORS // TURNS + 0.5) * 2 * np.pi / SECTORS
    near = np.hypot(frame[0] - (u + 0.5) * p.cell_px, frame[1] - (v + 0.5) * p.cell_px)
    alike = frame[2] * np.cos(angle) + frame[3] * np.sin(angle)
    within = near <= p.reach / np.sqrt(frame[4])
    within &= alike >= math.cos(math.radians(p.max_turn_deg))
    return int((within.any(axis=0) & known.all(axis=0)).sum())


def agreeing_flow(
    a: PreparedTemplate, i: int, b: PreparedTemplate, j: int, p: ShortlistParameters
) -> int:
    found = 0
    for place in map(tuple, p.places.T.tolist()):
        one, other = orientation_at(a, i, place), orientation_at(b, j, place)
        if UNKNOWN in {one, other}:
            continue
        apart = abs(math.floor(other) + 0.5 - one)
        found += min(apart, BINS - apart) <= p.flow_turn_deg * BINS / 180
    return found


def plain_weight(a: PreparedTemplate, b: PreparedTemplate, p: ShortlistParameters) -> int:
    """Return the weight of print B for the probe A, of at most 64 minutiae."""
    known = [(side.region.has_flow and side.region.code.any()) for side in (a, b)]
    pairs = []
    for j, i in product(range(len(b)), range(len(a))):
        n = agreeing_neighbours(a, i, b, j, p)
        if n < 2:
            continue
        f = agreeing_flow(a, i, b, j, p) if all(known) else 6
        if n >= 4 or (n == 3 and f >= 5) or (n >= 2 and f >= 9):
            pairs.append((min(4 * n + f - 15, 18), j, i))
    order = sorted(range(len(pairs)), key=lambda k: -pairs[k][0])[: p.most_pairs]
    pairs = [pairs[k] for k in sorted(order)]
    turns = [(turns_of(a)[i] - turns_of(b)[j]) % TURNS for _, j, i in pairs]
    best = 0
    for (_, j0, i0), turn in zip(pairs, turns, strict=True):
        total, used, last = 0, set(), None
        for (weight, j, i), other in zip(pairs, turns, strict=True):
            if abs((other - turn + TURNS // 2) % TURNS - TURNS // 2) > p.most_turn:
                continue
            way = complex(*(b.points[:2, j] - b.points[:2, j0]))
            expected = way * np.exp(2j * np.pi * turn / TURNS)
            error = abs(expected - complex(*(a.points[:2, i] - a.points[:2, i0])))
            if error > p.near_px + p.spread * abs(way) or j == last or i in used:
                continue
            total, last = total + weight, j
            used.add(i)
        best = max(best, total)
    return best


def impressions(seed: int) -> list[PreparedTemplate]:
    """Return a finger, two impressions of it, and other prints, with and without ridges."""
    rng = np.random.default_rng(seed)
    finger = spread_points(rng, PRINT_SIZE)
    sides = [
        finger,
        jittered(rng, moved(finger[:, 2:], 0.4, 30 - 20j), 1.5, 0.05),
        jittered(rng, moved(finger[:, :-3], -2.0, 300 - 100j), 1.5, 0.05)[:, ::-1],
        spread_points(rng, 9),
        spread_points(rng, 3),
        finger[:, :1],
    ]
    flows = (striped_field(orientation=0.3), striped_field(orientation=1.9), None)
    return [
        prepare(template_of(np.ascontiguousarray(side), field=flows[k % 3]))
        for k, side in enumerate(sides)
    ]


@given(seeds)
@settings(max_examples=EXAMPLES)
def test_weights_are_those_of_the_plain_form(seed: int) -> None:
    p = ShortlistParameters(most_pairs=16)
    prints = impressions(seed)
    coded = CodedPrints.of(PreparedMany.of(prints), p)
    for probe in prints[:2]:
        expected = [plain_weight(probe, print_, p) for print_ in prints]
        assert coded.weights(probe).tolist() == expected


@given(templates(), st.lists(templates(), max_size=3))
@settings(max_examples=EXAMPLES)
def test_any_templates_can_be_coded_and_looked_for(
    probe: Template, references: list[Template]
) -> None:
    prints = [prepare(template) for template in [*references, probe]]
    coded = CodedPrints.of(PreparedMany.of(prints))
    weights = coded.weights(prints[-1])
    assert weights.shape == (len(prints),)
    assert (weights >= 0).all()
    assert all(
        CodedPrints.of(PreparedMany.of([print_])).weights(prints[-1]).tolist() == [weight]
        for print_, weight in zip(prints, weights.tolist(), strict=True)
    )


def test_the_mate_is_first_and_parts_are_as_the_whole() -> None:
    rng = np.random.default_rng(7)
    finger = spread_points(rng, 30)
    others = [template_of(spread_points(rng, 30)) for _ in range(40)]
    mate = template_of(jittered(rng, moved(finger[:, 4:], 1.0, 20 - 9j), 2.0, 0.08))
    coded = CodedPrints.of(PreparedMany.of(map(prepare, [*others, mate])))
    probe = prepare(template_of(finger))
    whole = coded.weights(probe)
    assert np.argmax(whole) == 40
    assert whole[40] > 2 * whole[:40].max()
    assert np.concatenate([coded.weights(probe, 0, 13), coded.weights(probe, 13)]).tolist() == (
        whole.tolist()
    )
    assert coded.weights(probe, 30, 20).size == 0
    assert coded.shortlist(probe, 1).tolist() == [40]
    ten = coded.shortlist(probe, 10)
    assert ten.tolist() == sorted(np.argsort(-whole, kind="stable")[:10].tolist())
    assert coded.shortlist(probe, 99).tolist() == list(range(41))
    assert coded.shortlist(probe, 0).size == 0


@pytest.mark.parametrize("n", [0, 1, 2, 65, 200, 255])
def test_prints_of_any_size(n: int) -> None:
    rng = np.random.default_rng(n)
    sizes = [n, 30, 0] if COMPILED else [min(n, 70), 12, 0]
    prints = [prepare(template_of(spread_points(rng, k, 9.0, 400.0), size=500)) for k in sizes]
    coded = CodedPrints.of(PreparedMany.of(prints))
    weights = [coded.weights(print_) for print_ in prints]
    assert all(found.shape == (3,) for found in weights)
    if n >= 65:
        assert weights[0].argmax() == 0
        assert weights[0][0] > 0
    assert all(found[2] == 0 for found in weights)


def test_no_prints() -> None:
    coded = CodedPrints.of(PreparedMany.of([]))
    probe = prepare(template_of(spread_points(np.random.default_rng(1), 9)))
    assert (len(coded), coded.nbytes) == (0, 0)
    assert coded.weights(probe).size == 0
    assert coded.shortlist(probe, 5).size == 0


def test_prints_of_more_neighbours_cannot_be_coded() -> None:
    points = spread_points(np.random.default_rng(1), 20)
    many = PreparedMany.of([prepare(template_of(points), None, NeighbourhoodParameters(size=13))])
    with pytest.raises(MatcherError, match="12 neighbours"):
        CodedPrints.of(many)
