"""Made prints for the tests of matching: as points, as templates, moved and worn."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fpmatch.matching.constants import COMPILED
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.reference.neighbourhood import local_similarity, neighbourhoods
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template

EMPTY = Template(Minutiae.empty(), 300, 300)
NO_POINTS = np.empty((4, 0))

SIZES = (12, 0, 3, 25, 2)
"""Minutiae of `some_templates`."""

seeds = st.integers(0, 2**32 - 1)
"""Seeds of prints whose minutiae are in general position."""


def spread_points(rng, n, spacing=14.0, size=300.0):
    """Return n minutiae (4, n), x and y up, no two nearer than `spacing`, of any direction."""
    kept = np.empty((0, 2))
    while len(kept) < n:
        candidate = rng.uniform((0, -size), (size, 0))
        if not len(kept) or np.hypot(*(kept - candidate).T).min() >= spacing:
            kept = np.vstack([kept, candidate])
    angle = rng.uniform(0, 2 * np.pi, n)
    return np.ascontiguousarray(np.vstack([kept.T, np.cos(angle), np.sin(angle)]))


def on_pixels(rng, n, side=6, step=9.0):
    """Return n minutiae on a small grid of few directions: coincident and collinear ones abound."""
    angle = rng.integers(0, 8, n) * np.pi / 4
    xy = rng.integers(0, side, (2, n)) * step
    return np.ascontiguousarray(np.vstack([xy[:1], -xy[1:], np.cos(angle), np.sin(angle)]))


def any_points(seed, most=25):
    """Return 0 to `most` minutiae, in general position or crowded."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(0, most + 1))
    return spread_points(rng, n) if rng.random() < 0.5 else on_pixels(rng, n)


def plane(points):
    """Return the positions of minutiae as complex numbers."""
    return points[0] + 1j * points[1]


def _of_planes(z, d):
    """Return minutiae (4, n) of positions and directions given as complex numbers."""
    return np.ascontiguousarray(np.vstack([z.real, z.imag, d.real, d.imag]))


def moved(points, turn, shift=0j, scale=1.0):
    """Return minutiae turned counter-clockwise (radians, y up), scaled and shifted."""
    by = np.exp(1j * turn)
    return _of_planes(plane(points) * scale * by + shift, plane(points[2:]) * by)


def jittered(rng, points, px, radians):
    """Return minutiae whose positions and directions have been read a little wrong."""
    z = plane(points)
    z = z + rng.normal(0, px, z.shape) + 1j * rng.normal(0, px, z.shape)
    return _of_planes(z, plane(points[2:]) * np.exp(1j * rng.normal(0, radians, z.shape)))


def distorted(points, towards=0.0, most_px=14.0, within_px=60.0):
    """Return minutiae as on skin that one side of the finger drags along, and the other does not.

    The displacement, in a direction of so many radians, grows smoothly from 0 to `most_px` across a
    band `within_px` wide through the middle of the print; the minutiae there turn with the skin.
    """
    across = np.clip(((points[0] - points[0].mean()) / within_px) + 0.5, 0, 1)
    z = plane(points) + most_px * np.exp(1j * towards) * (3 - 2 * across) * across**2
    slope = most_px / within_px * 6 * across * (1 - across) * np.exp(1j * towards)
    d = plane(points[2:]) + slope * points[2]
    return _of_planes(z, d / abs(d))


def two_impressions(seed, n=14):
    """Return a print, and another impression of it that lists its minutiae in another order."""
    rng = np.random.default_rng(seed)
    a = spread_points(rng, n)
    bent = distorted(a, rng.uniform(-3, 3)) if rng.random() < 0.5 else a
    b = jittered(rng, moved(bent, rng.uniform(-3, 3), complex(*rng.uniform(-90, 90, 2))), 2, 0.1)
    gone = int(rng.integers(0, 5))
    b = np.hstack([b[:, gone:], moved(spread_points(rng, gone), 1.0)])
    return a, np.ascontiguousarray(b[:, rng.permutation(b.shape[1])])


def impressions_of_a_finger(seed, n):
    """Return a print of n minutiae, others of its finger, two of any fingers, and two minutiae."""
    rng = np.random.default_rng(seed)
    a = spread_points(rng, n)
    parts = a[:, 3:], a[:, 2:-3], a[:, :-3]
    moves = (0.4, 30 - 20j), (0.1, 5 - 4j), (-2.0, 300 - 100j)
    b, c, d = (
        jittered(rng, moved(part, *move), 1.5, 0.05)
        for part, move in zip(parts, moves, strict=True)
    )
    sides = [a, b, c, d[:, ::-1], any_points(seed + 1), any_points(seed + 2), a[:, :2]]
    return [np.ascontiguousarray(side) for side in sides]


def doubled_prints(seed):
    """Return a print and one that holds it twice, in the order of their content.

    Two transforms compete. Some have no field, some one that shows their ridges.
    """
    rng = np.random.default_rng(seed)
    points = spread_points(rng, 10, size=130.0)
    again = moved(points, rng.uniform(-1, 1), 200 + 10j)
    both = np.hstack([jittered(rng, side, 2.0, 0.1) for side in (points, again)])
    field = (None, striped_field(side=25), striped_field(side=10))[seed % 3]
    sides = (MATCHER.prepare(template_of(side, field=field)) for side in (points, both))
    return sorted(sides, key=lambda side: side.key)


def similarity_of(a, b):
    """Return the local similarity of the minutiae of two prints."""
    return local_similarity(neighbourhoods(a), neighbourhoods(b))


def template_of(points, dpi=500.0, quality=None, field=None, size=400):
    """Return a template of minutiae given at 500 dpi, in pixels of its own resolution."""
    zoom = dpi / 500.0
    minutiae = Minutiae(
        x=points[0] * zoom,
        y=-points[1] * zoom,
        angle=np.arctan2(points[3], points[2]),
        quality=quality,
    )
    side = max(1, round(size * zoom))
    return Template(minutiae, side, side, dpi, field)


def turned_on_screen(template, move):
    """Return a template moved by a transform of its pixels; without a field."""
    m = template.minutiae
    x, y = move.apply(m.xy).T
    # On screen, the positive rotation of a y-down transform is clockwise.
    minutiae = Minutiae(x, y, m.angle - move.rotation, m.kind, m.quality)
    return Template(minutiae, template.width, template.height, template.dpi)


def even_field(step=16.0, side=25, orientation=0.6):
    """Return a field of ridges that run one way everywhere."""
    shape = (side, side)
    return RidgeField(step, np.full(shape, orientation, np.float32), np.ones(shape, bool))


def along(points, orientation=0.6):
    """Return points whose directions are turned into the ridges' orientation, either way."""
    ridges = np.array([[math.cos(orientation)], [math.sin(orientation)]])
    way = np.where((points[2:] * ridges).sum(axis=0) < 0.0, -1.0, 1.0)
    return np.concatenate([points[:2], ridges * way])


def packed_pictures(picture):
    """Return a picture of ridges, 8 pixels a cell along either side, as the bits of its cells."""
    rows, columns = (side // 8 for side in picture.shape)
    cells = picture.reshape(rows, 8, columns, 8).transpose(0, 2, 1, 3).reshape(rows, columns, 64)
    weights = np.uint64(1) << np.arange(64, dtype=np.uint64)
    return (cells * weights).sum(axis=2, dtype=np.uint64)


def striped_field(period=10.0, side=10, step=16.0, orientation=0.6):
    """Return a field that shows straight ridges, so many pixels apart, that run one way."""
    row, column = np.mgrid[: 8 * side, : 8 * side] + 0.5
    across = (column * np.sin(orientation) + row * np.cos(orientation)) * (step / 8)
    ridges = packed_pictures(np.cos(2 * np.pi * across / period) > 0)
    return replace(even_field(step, side, orientation), ridges=ridges)


def some_templates(sizes=SIZES):
    """Return templates of so many minutiae, with and without a field, and one with its ridges."""
    fields = None, even_field(side=9), striped_field(side=8)
    return [
        template_of(
            spread_points(np.random.default_rng(k), n),
            (500.0, 1000.0)[k % 2],
            np.random.default_rng(k).integers(0, 101, n),
            fields[k % 3],
        )
        for k, n in enumerate(sizes)
    ]


@st.composite
def fields(draw):
    """Draw a ridge field of a few cells, some of them empty, with or without their ridges."""
    shape = draw(st.tuples(st.integers(0, 8), st.integers(0, 8)))
    below_half_turn = st.floats(0, 3.125, width=32)
    return RidgeField(
        step=draw(st.sampled_from([4.0, 16.0, 33.3])),
        orientation=draw(arrays(np.float32, shape, elements=below_half_turn)),
        mask=draw(arrays(bool, shape)),
        ridges=draw(st.none() | arrays(np.uint64, shape, elements=st.integers(0, 2**64 - 1))),
    )


@st.composite
def templates(draw):
    """Draw any template: crowded, coincident, outside its image, of any resolution."""
    n = draw(st.integers(0, 60 if COMPILED else 25))
    anywhere, whole = st.floats(-500, 2000, width=32), st.integers(0, 400).map(float)
    coarse = st.integers(0, 6).map(lambda pixel: 20.0 * pixel)
    place = draw(st.sampled_from([anywhere, whole, coarse]))
    minutiae = Minutiae(
        x=draw(arrays(np.float64, n, elements=place)),
        y=draw(arrays(np.float64, n, elements=place)),
        angle=draw(arrays(np.float64, n, elements=st.floats(-10, 10))),
        kind=draw(arrays(np.uint8, n, elements=st.integers(0, 2))),
        quality=draw(arrays(np.uint8, n, elements=st.integers(0, 100))),
    )
    dpi = draw(st.sampled_from([100.0, 500.0, 569.0, 1000.0, 4000.0]) | st.floats(100, 4000))
    return Template(minutiae, 400, 400, dpi, draw(st.none() | fields()))


def assert_mirrored(forth, back):
    """Hold two comparisons to being each other with the sides exchanged, to the last bit."""
    for name in ("similarity", "agreement", "overlap"):
        assert getattr(forth, name) == getattr(back, name)
    assert forth.pairs.tolist() == sorted(back.pairs[:, ::-1].tolist())
    assert (forth.transform is None) == (back.transform is None)
    if forth.transform:
        inverse = back.transform.inverse().matrix
        assert inverse == pytest.approx(forth.transform.matrix, rel=1e-6, abs=1e-6)


def fragment(template, minutiae):
    """Return the minutiae nearest to the middle, and the ridges around them."""
    m, field = template.minutiae, template.field
    x, y = np.median(m.x), np.median(m.y)
    distance = np.hypot(m.x - x, m.y - y)
    near = np.sort(np.argsort(distance)[:minutiae])
    rows, columns = (np.indices(field.mask.shape) + 0.5) * field.step
    mask = field.mask & (np.hypot(columns - x, rows - y) < distance[near].max() + 8)
    return replace(template, minutiae=m.take(near), field=replace(field, mask=mask))
