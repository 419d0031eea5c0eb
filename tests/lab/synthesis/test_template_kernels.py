"""Kernels of templates against maps and outlines of impressions, plane waves and dislocations."""

import math

import numpy as np
import pytest

from fpmatch.lab.synthesis import template_impressions
from fpmatch.lab.synthesis.classes import PatternClass
from fpmatch.lab.synthesis.master import MasterParameters
from fpmatch.lab.synthesis.noise import keys_of
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


SHAPE = (21, 17)


def plane(degrees, period):
    """Return levels and periods of a plane wave on the whole lattice, and all that is inside."""
    level = np.full((1, *SHAPE), round(degrees / 360 * TURN) // 16 * 16, np.int32)
    inside = np.tile(np.array([0, SHAPE[1]], np.int32), (1, SHAPE[0], 1))
    return level, np.full((1, *SHAPE), period, np.float32), inside


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
