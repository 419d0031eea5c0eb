"""Kernels of templates against maps and outlines of impressions, plane waves and dislocations."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.lab.synthesis import _impression_kernel as kernel
from fpmatch.lab.synthesis import _ridge_phase_kernel as phases
from fpmatch.lab.synthesis import template_fingers, template_impressions
from fpmatch.lab.synthesis.classes import PatternClass
from fpmatch.lab.synthesis.contact import outline_radius
from fpmatch.lab.synthesis.master import MasterParameters, fingertip_silhouette
from fpmatch.lab.synthesis.noise import keys_of
from fpmatch.lab.synthesis.orientation import _Turn
from fpmatch.lab.synthesis.plan import Plan, sensors_named
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import SENSORS
from fpmatch.lab.synthesis.template_fingers import STEP_PX, TURN, draw_fingers, lattice_shape
from fpmatch.lab.synthesis.template_impressions import (
    ExtractionParameters,
    draw_impressions,
    draw_warps,
)
from fpmatch.lab.synthesis.warp import Similarity, Warp

MASTER = (560, 440)
NOTHING_LOST = ExtractionParameters(
    missed=0, doubtful=10, place_px=0, direction=0, kind=0, spurious=0, spurious_in_doubt=0,
    most_doubt=2, orientation_deg=0, phase=0,
)  # fmt: skip


def as_warp(row):
    """Return the map of a row of `draw_warps`."""
    placement = Similarity(row[6], math.atan2(row[5], row[4]), row[7], row[8])
    torsion = math.atan2(row[10], row[9])
    return Warp(placement, tuple(row[:2]), tuple(row[2:4]), torsion, tuple(row[11:]))


def drawn_warps(preset, count=20, sensor="optical-388x374"):
    keys = keys_of(3, np.arange(count), 1, 131)
    return draw_warps(keys, MASTER, SENSORS[sensor], PRESETS[preset].placement)


@given(st.floats(-math.pi, math.pi))
def test_cosine(angle):
    whole = round(angle * TURN / (2 * math.pi))
    assert kernel.cosine(whole) == pytest.approx(math.cos(whole * 2 * math.pi / TURN), abs=1e-5)


@pytest.mark.parametrize("preset", ["normal", "hard", "stretched"])
def test_corners_lie_where_the_warp_of_images_has_them(preset):
    rows = drawn_warps(preset)
    corner = np.empty((len(rows), 9, 8, 2))
    kernel.map_corners(rows, 40.0, corner)
    i, j = np.indices((9, 8))
    points = np.column_stack([j.ravel(), i.ravel()]) * 40.0
    for k, row in enumerate(rows):
        expected = as_warp(row).to_master(points)
        assert np.abs(corner[k].reshape(-1, 2) - expected).max() < 0.01


def test_the_outline_is_that_of_drawn_contacts():
    row = drawn_warps("normal")[0]
    points = np.random.default_rng(0).uniform(0, 400, (300, 2))
    expected = outline_radius(as_warp(row).upright(points))
    found = [kernel.outline_radius(x, y, row) for x, y in points]
    assert found == pytest.approx(expected, rel=1e-3)


def test_placements_have_the_distribution_of_drawn_ones():
    warps = drawn_warps("normal", 4000)
    p = PRESETS["normal"].placement
    rotation = np.degrees(np.arctan2(warps[:, 5], warps[:, 4]))
    assert np.abs(rotation).max() <= p.rotation_deg[1]
    assert abs(rotation.mean()) < 0.7
    far = np.abs(warps[:, :2] - np.array([388, 374]) / 2).max(axis=1) > p.shift[1] + 1
    assert 0.5 * p.cut_off < far.mean() <= 1.1 * p.cut_off


def undisturbed(monkeypatch, preset="normal", sensor="optical-388x374"):
    """Return a batch of fingers, the maps of their impressions, and undisturbed templates."""
    fingers = draw_fingers(3, np.arange(12, dtype=np.uint64))
    plan = Plan(3, preset, sensors_named([sensor]), 1)
    seen = []

    def draw(*arguments):
        seen.append(draw_warps(*arguments))
        return seen[-1]

    monkeypatch.setattr(template_impressions, "draw_warps", draw)
    numbers = np.array([1], np.uint64)
    made = list(draw_impressions(plan, fingers, numbers, SENSORS[sensor], NOTHING_LOST))
    return fingers, [as_warp(row) for row in seen[0]], made


def test_minutiae_lie_and_point_where_the_warp_takes_them(monkeypatch):
    fingers, warps, made = undisturbed(monkeypatch, "stretched")
    for k, (warp, template) in enumerate(zip(warps, made, strict=True)):
        x, y, direction = fingers.minutiae[k, : fingers.count[k]].T
        start = np.column_stack([x, y])
        angle = direction * (2 * np.pi / TURN)
        ahead = start + np.column_stack([np.cos(angle), -np.sin(angle)])
        there = warp.from_master(start)
        dx, dy = (warp.from_master(ahead) - there).T
        m = template.minutiae
        nearest = np.hypot(*(m.xy[:, None] - there[None]).transpose(2, 0, 1)).argmin(axis=1)
        assert np.abs(m.xy - there[nearest]).max() < 0.8  # pixels are whole
        off = np.exp(1j * m.angle) / np.exp(1j * np.arctan2(-dy, dx)[nearest])
        assert np.abs(np.degrees(np.angle(off))).max() < 4
        assert len(np.unique(nearest)) == len(m) > 8


def test_ridges_are_those_of_the_phase(monkeypatch):
    fingers, warps, made = undisturbed(monkeypatch, "easy")
    for k, (warp, template) in enumerate(zip(warps, made, strict=True)):
        field = template.field
        bits, known = field.bits, np.kron(field.mask, np.ones((8, 8), bool))
        i, j = np.nonzero(known)
        x, y = warp.to_master(np.column_stack([2 * j + 1.0, 2 * i + 1.0])).T
        row, column = np.rint(y / STEP_PX).astype(int), np.rint(x / STEP_PX).astype(int)
        angle = fingers.level[k, row, column] * (2 * np.pi / TURN)
        advance = -np.sin(angle) * (x - column * STEP_PX) - np.cos(angle) * (y - row * STEP_PX)
        phase = fingers.phase[k, row, column] / TURN + advance / fingers.period[k, row, column]
        ridge = np.abs(phase - np.rint(phase)) < 0.265
        assert (ridge == bits[i, j]).mean() > 0.9  # but for the nodes of neighbouring quarters
        turned = np.mod(template.field.orientation[field.mask], np.pi)
        assert 0 <= turned.min() <= turned.max() < np.pi


def test_minutiae_are_missed_and_added_more_where_ridges_are_in_doubt():
    fingers = draw_fingers(3, np.arange(30, dtype=np.uint64))
    count = {}
    for preset in ("clean", "hard"):
        plan = Plan(3, preset, sensors_named(["optical-640x480"]), 1)
        made = draw_impressions(plan, fingers, np.array([1], np.uint64), plan.sensors[0])
        count[preset] = np.mean([np.mean(t.minutiae.quality) for t in made])
    assert count["clean"] > count["hard"] + 5


SHAPE = (21, 17)
RADIANS = 2 * np.pi / TURN


@given(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3))
def test_angle_of_a_vector(y, x):
    if math.hypot(x, y) < 1e-6:
        return
    off = phases.angle_of(y, x) * RADIANS - math.atan2(y, x)
    assert abs((off + math.pi) % (2 * math.pi) - math.pi) < 2 * RADIANS


def plane(degrees, period):
    """Return levels and periods of a plane wave on the whole lattice, and all that is inside."""
    level = np.full((1, *SHAPE), round(degrees / 360 * TURN) // 16 * 16, np.int32)
    inside = np.tile(np.array([0, SHAPE[1]], np.int32), (1, SHAPE[0], 1))
    return level, np.full((1, *SHAPE), period, np.float32), inside


def vortices(level, period, inside, link, wave, spacing=0.0):
    """Return the phase, and the minutiae in the middle of their squares."""
    place = np.full((*level.shape, 2), 0.5, np.float32)
    phase, turns = np.zeros(level.shape, np.int32), np.zeros((2, *SHAPE))
    minutiae, count = np.empty((1, 50, 3)), np.empty(1, np.int32)
    phases.find_vortices(
        level, period, inside, link, wave, STEP_PX, spacing, place, phase, turns, minutiae, count
    )  # fmt: skip
    return phase[0], minutiae[0, : count[0]]


def wave_vector(degrees, period):
    """Return the advance of the phase in radians a pixel along x and y, y down."""
    angle = round(degrees / 360 * TURN) // 16 * 16 * RADIANS
    return -np.array([math.sin(angle), math.cos(angle)]) * 2 * np.pi / period


@pytest.fixture
def still(monkeypatch):
    monkeypatch.setattr(template_fingers, "PHASE_NOISE", 0.0)


@pytest.mark.parametrize("degrees", [0, 30, 90, 135, 179])
@pytest.mark.parametrize("period", [7.4, 9.1])
def test_straight_ridges_grow_as_a_plane_wave(still, degrees, period):
    fields = plane(degrees, period)
    link, wave = template_fingers._grow(np.array([5], np.uint64), *fields)
    phase, found = vortices(*fields, link, wave)
    assert len(found) == 0
    i, j = np.indices(SHAPE)
    expected = np.tensordot(wave_vector(degrees, period), [j * STEP_PX, i * STEP_PX], 1)
    off = np.exp(1j * (phase * RADIANS - expected))
    assert np.abs(off - off.mean()).max() < 0.05


@pytest.mark.parametrize("degrees", [0, 40, 90, 150])
@pytest.mark.parametrize("charge", [1, -1])
def test_a_dislocation_is_a_minutia_towards_the_side_with_more_ridges(still, degrees, charge):
    period, fields = 9.0, plane(degrees, 9.0)
    link, wave = template_fingers._grow(np.array([5], np.uint64), *fields)
    i, j = np.indices(SHAPE)
    x, y = j * STEP_PX, i * STEP_PX
    cx, cy = 85.0, 105.0  # middle of a square
    turning = charge * np.arctan2(-(y - cy), x - cx)  # counter-clockwise on screen
    phase = np.tensordot(wave_vector(degrees, period), [x, y], 1) + turning
    wave[0, 1:-1, 1:-1, 0], wave[1, 1:-1, 1:-1, 0] = np.cos(phase), np.sin(phase)
    _, found = vortices(*fields, link, wave)
    assert found[:, :2].tolist() == [[cx, cy]]
    ahead = found[0, 2] * RADIANS
    step = 60 * np.array([math.cos(ahead), -math.sin(ahead)])
    normal = wave_vector(degrees, period) * period / (2 * np.pi)
    lines = [ridges_across(np.array([cx, cy]) + side * step, normal, period, charge, (cx, cy))
             for side in (1, -1)]  # fmt: skip
    assert lines[0] > lines[1] + 0.3  # a whole one, along a line without end


def ridges_across(middle, normal, period, charge, centre):
    """Return the turns of the phase along a line of 100 px across the ridges."""
    along = np.linspace(-50, 50, 2001)[:, None]
    points = middle + along * normal
    x, y = points.T
    phase = points @ normal * 2 * np.pi / period
    phase = phase + charge * np.arctan2(-(y - centre[1]), x - centre[0])
    advance = np.angle(np.exp(1j * np.diff(phase)))
    return advance.sum() / (2 * np.pi)


def test_two_near_minutiae_are_both_left_out(still):
    period, fields = 9.0, plane(0, 9.0)
    link, wave = template_fingers._grow(np.array([5], np.uint64), *fields)
    i, j = np.indices(SHAPE)
    x, y = j * STEP_PX, i * STEP_PX
    phase = np.tensordot(wave_vector(0, period), [x, y], 1)
    for cx, charge in ((65.0, 1), (85.0, -1), (135.0, 1)):
        phase = phase + charge * np.arctan2(-(y - 105.0), x - cx)
    wave[0, 1:-1, 1:-1, 0], wave[1, 1:-1, 1:-1, 0] = np.cos(phase), np.sin(phase)
    assert sorted(vortices(*fields, link, wave)[1][:, 0]) == [65, 85, 135]
    assert vortices(*fields, link, wave, spacing=2.5)[1][:, 0].tolist() == [135]


def test_orientation_is_that_of_the_zero_pole_model():
    rng = np.random.default_rng(3)
    rows, columns = SHAPE
    points = rng.uniform(-60, 60, (1, 4, 2))
    share, counts = np.array([[0.5, 0.5, -0.5, 0.0]]), np.array([3], np.int32)
    bend = rng.normal(0, 2000, (1, 4, 8))
    arching = np.array([[5000.0, 90.0, 400.0, 105.0, 32.0, 1.0]])
    variation = rng.normal(0, 500, (1, *SHAPE)).astype(np.float32)
    inside = np.tile(np.array([0, columns], np.int32), (1, rows, 1))
    level = np.zeros((1, *SHAPE), np.int32)
    turns = [_Turn(complex(*points[0, k]), share[0, k], bend[0, k] * RADIANS) for k in range(3)]
    phases.draw_orientation(
        points, share, counts, bend, np.zeros(1), arching, variation, inside, STEP_PX, level
    )
    y, x = np.indices(SHAPE) * STEP_PX
    x, y = x - x.mean(), y.mean() - y
    place = x + 1j * y
    expected = sum(turn.around(place) for turn in turns)
    u = x / (90 * (1 + np.clip(y / 400, 0, None)))
    above = 1 / (1 + np.exp(-(y + 105) / 32))
    expected -= 5000 * RADIANS * u * np.exp((1 - u**2) / 2) * above
    expected += variation[0] * RADIANS
    off = np.mod(level[0] * RADIANS - expected + np.pi / 2, np.pi) - np.pi / 2
    assert np.abs(off).max() < 16 * RADIANS
    assert 0 <= level.min() <= level.max() < TURN // 2


def test_outlines_are_those_of_masters():
    p = MasterParameters()
    edges = draw_fingers(3, np.arange(16, dtype=np.uint64)).edges
    widths = np.clip(edges[..., 1] - edges[..., 0], 0, None)
    drawn = [
        fingertip_silhouette(p.shape, np.random.default_rng(k), p.silhouette) for k in range(40)
    ]
    area = np.mean([mask.sum() for mask in drawn])
    assert widths.sum(axis=1).mean() * STEP_PX == pytest.approx(area, rel=0.03)


@pytest.mark.parametrize("pattern", PatternClass)
def test_minutiae_lie_on_their_finger_along_its_ridges(pattern):
    batch = draw_fingers(5, np.arange(6, dtype=np.uint64), MasterParameters(pattern=pattern))
    assert batch.level.shape[1:] == lattice_shape(MasterParameters())
    for k in range(6):
        x, y, direction = batch.minutiae[k, : batch.count[k]].T
        assert batch.count[k] > 30
        i, j = np.rint(np.array([y, x]) / STEP_PX).astype(int)
        assert (j >= batch.inside[k, i, 0] - 1).all()
        assert (j <= batch.inside[k, i, 1]).all()
        off = (
            np.mod(
                direction
                - batch.level[k, i, np.minimum(j, lattice_shape(MasterParameters())[1] - 1)]
                + TURN / 4,
                TURN / 2,
            )
            - TURN / 4
        )
        assert np.median(np.abs(off)) * 360 / TURN < 6
