"""Kernel of impressions against the maps and outlines of impressions that are drawn."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.lab.synthesis import _impression_kernel as kernel
from fpmatch.lab.synthesis import template_impressions
from fpmatch.lab.synthesis.contact import outline_radius
from fpmatch.lab.synthesis.noise import keys_of
from fpmatch.lab.synthesis.plan import Plan, sensors_named
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import SENSORS
from fpmatch.lab.synthesis.template_fingers import STEP_PX, TURN, draw_fingers
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
