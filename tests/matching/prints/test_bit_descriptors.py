"""Bit descriptors: the kernels agree with a plain form of them, whichever print comes first."""

import math
from functools import cache
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matching_prints import (
    COMPILED,
    impressions_of_a_finger,
    seeds,
    spread_points,
    striped_field,
    template_of,
    templates,
)

from fpmatch.matching.constants.prints import MAX_ENCODED, ORIENTATIONS, TURNS
from fpmatch.matching.prints import bit_descriptors
from fpmatch.matching.prints.bit_descriptors import (
    encode,
    prefilter,
    prefilter_of,
    score_descriptors,
)
from fpmatch.matching.prints.parameters import BitDescriptorParameters
from fpmatch.matching.prints.prepare import prepare

EXAMPLES = 20 if COMPILED else 4
PRINT_SIZE = 14 if COMPILED else 8
P = BitDescriptorParameters()
SIDE, SECTORS, BINS = 16, 8, 24  # as the kernel has them
APART = 0.25
NOWHERE = 0x8800


@cache
def turns_of(print_):
    angle = np.arctan2(print_.points[3], print_.points[2])
    return [round(k) % TURNS for k in (angle * TURNS / (2 * np.pi)).tolist()]


@cache
def cells_of(print_, i):
    """Return the cells of the neighbours of a minutia in the first grid and in the second."""
    n = print_.neighbourhoods
    first, second = set(), set()
    for k in range(n.count[i]):
        u, v, c, s = n.frame[i, :4, k]
        turn = (float(np.arctan2(s, c)) / (2 * np.pi) + APART) % 1.0
        place = np.array([float(v), float(u)]) / P.cell_px + SIDE / 2
        if not ((place >= 0) & (place < SIDE)).all():
            continue
        cell, sector = np.floor(place), min(int(turn * SECTORS), SECTORS - 1)
        first.add(int((cell[0] * SIDE + cell[1]) * SECTORS) + sector)
        further = np.floor(place + 0.5)
        if (further < SIDE).all():
            ahead = turn * SECTORS - sector >= 0.5
            second.add(int((further[0] * SIDE + further[1]) * SECTORS) + sector + ahead)
    return frozenset(first), frozenset(second)


@cache
def bins_of(print_, i):
    """Return the bins of the ridge orientation at the places around a minutia."""
    x, y, c, s = print_.points[:, i].tolist()
    region, found = print_.region, []
    rows, columns = region.code.shape
    for u, v in P.places.T.tolist():
        column = math.floor((x + c * u - s * v) / region.step) - region.first_column
        row = math.floor(-(y + s * u + c * v) / region.step) - region.first_row
        inside = region.has_flow and 0 <= row < rows and 0 <= column < columns
        if not inside or not region.code[row, column]:
            found.append(None)
            continue
        relative = (int(region.code[row, column]) - 1.0) * BINS / ORIENTATIONS
        relative = (relative - turns_of(print_)[i] * 2.0 * BINS / TURNS) % BINS
        found.append(min(int(relative), BINS - 1))
    return found


def shared(a, i, b, j):
    """Return in how many words of neighbours and of orientations two minutiae agree."""
    neighbours = sum(
        len(one & other) for one, other in zip(cells_of(a, i), cells_of(b, j), strict=True)
    )
    if not (a.region.has_flow and b.region.has_flow):
        return neighbours, 6
    along = 0
    for one, other in zip(bins_of(a, i), bins_of(b, j), strict=True):
        known = None not in {one, other}
        along += known and min((one - other) % BINS, (other - one) % BINS) <= 1
    return neighbours, along


def plain_similarity(a, b):
    """Return what two prints, of at most 64 minutiae, have in common."""
    pairs = []
    for j, i in product(range(len(b)), range(len(a))):
        n, f = shared(a, i, b, j)
        if n > 0 and 3 * n + f > 8:
            pairs.append((min(3 * n + f - 8, 18), j, i))
    order = sorted(range(len(pairs)), key=lambda k: -pairs[k][0])[: P.most_pairs]
    pairs = [pairs[k] for k in sorted(order)]
    best = 0
    for h in range(len(pairs)):
        total, used, last = 0, set(), None
        for g, (weight, j, i) in enumerate(pairs):
            fits = beside(a, b, pairs[min(g, h)], pairs[max(g, h)])
            if not fits or j == last or i in used:
                continue
            total, last = total + weight, j
            used.add(i)
        best = max(best, total)
    return best


def beside(a, b, one, other):
    """Tell whether two pairs lie on one another under the rotation of the first."""
    turn, turn_of_other = (turns_of(a)[i] - turns_of(b)[j] for _, j, i in (one, other))
    apart = (turn_of_other - turn + TURNS // 2) % TURNS - TURNS // 2
    way_b = complex(*(b.points[:2, other[1]] - b.points[:2, one[1]]))
    way_a = complex(*(a.points[:2, other[2]] - a.points[:2, one[2]]))
    off = abs(way_b * np.exp(2j * np.pi * turn / TURNS) - way_a)
    reach = math.hypot(P.near_px, P.near_per_px * abs(way_b))
    return bool(abs(apart) <= round(P.pair_turn_deg * TURNS / 360) and off <= reach)


def impressions(seed):
    """Return impressions of one finger and of others, with and without ridges."""
    sides = [
        *impressions_of_a_finger(seed, PRINT_SIZE),
        # a cell has one word however many neighbours are in it; those far away have none
        np.array([[0, 40, 41, 42], [0, 3, 4, 5], [1, 1, 1, 1], [0, 0, 0, 0]], float),
        np.array([[0, 140.0, 0], [0, 0, 135.0], [1, 1, 1], [0, 0, 0]]),
    ]
    flows = (striped_field(orientation=0.3), striped_field(orientation=1.9), None)
    return [prepare(template_of(side, field=flows[k % 3])) for k, side in enumerate(sides)]


def load(tables, own):
    bits = own.neighbour_bits, own.orientation_bins
    tables.load(own.xy, own.direction_bin, *bits, own.has_flow)


def score(tables, other, *, swapped=False):
    arrays = other.xy, other.direction_bin, other.neighbour_bits, other.orientation_bins
    return tables.score(0, len(other.xy), *arrays, other.has_flow, swapped)


def assert_same_both_ways(a, b):
    tables = prefilter()
    load(tables, a)
    one_way = score(tables, b)
    load(tables, b)
    assert one_way == score(tables, a, swapped=True) == score_descriptors(prefilter_of(a), b) >= 0


@given(seeds)
@settings(max_examples=EXAMPLES)
def test_prints_have_in_common_what_the_plain_form_finds(seed):
    """Whichever print is in the tables, and whatever was in them before."""
    prints, tables = impressions(seed), prefilter()
    for a, b in product(prints, prints):
        expected = plain_similarity(a, b)
        assert score_descriptors(prefilter_of(a.bit_descriptors), b.bit_descriptors) == expected
        for own, other, swapped in ((a, b, False), (b, a, True)):
            load(tables, own.bit_descriptors)
            assert score(tables, other.bit_descriptors, swapped=swapped) == expected


@given(templates(), templates())
@settings(max_examples=EXAMPLES)
def test_any_templates_have_something_or_nothing_in_common(one, other):
    assert_same_both_ways(*(prepare(template).bit_descriptors for template in (one, other)))


@pytest.mark.parametrize("n", [0, 1, 65, 130])
def test_crowds_are_compared_by_their_best(n):
    size = n if COMPILED else min(n, 70)
    rng = np.random.default_rng(n)
    quality = rng.integers(1, 100, size)
    points = spread_points(rng, size, 9.0, 400.0)
    crowd = prepare(template_of(points, size=500, quality=quality)).bit_descriptors
    few = prepare(template_of(spread_points(rng, 30), size=500)).bit_descriptors
    coded = (crowd.neighbour_bits != NOWHERE).any(axis=1)
    assert coded.sum() <= MAX_ENCODED
    if size > MAX_ENCODED:
        assert quality[coded].min() >= np.sort(quality)[-MAX_ENCODED]
        assert score_descriptors(prefilter_of(crowd), crowd) > 100
    for a, b in ((crowd, few), (crowd, crowd)):
        assert_same_both_ways(a, b)


@given(seeds, st.integers(0, 2))
@settings(max_examples=EXAMPLES)
def test_compiled_and_interpreted_agree(plain, seed, k):
    first, one = (impressions(seed)[place] for place in (0, k))
    turn = round(P.pair_turn_deg * TURNS / 360)
    tables = plain.prefilter.Prefilter(P.most_pairs, P.near_px, P.near_per_px, turn)
    load(tables, first.bit_descriptors)
    expected = score_descriptors(prefilter_of(first.bit_descriptors), one.bit_descriptors)
    assert score(tables, one.bit_descriptors) == expected
    with pytest.MonkeyPatch.context() as patch:
        for name in ("encode_neighbours", "encode_orientations"):
            patch.setattr(bit_descriptors, name, getattr(plain.encode, name))
        slow = encode(one.points, one.quality, one.neighbourhoods, one.region)
    for name in ("xy", "direction_bin", "neighbour_bits", "orientation_bins"):
        assert getattr(slow, name).tolist() == getattr(one.bit_descriptors, name).tolist()
