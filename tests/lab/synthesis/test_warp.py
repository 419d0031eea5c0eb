import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.warp import Warp, draw_warp
from fpmatch.pointset.geometry.similarity import Similarity

PLACEMENT = Similarity(1.1, 0.3, 20.0, -35.0)
WARP = Warp(PLACEMENT, (190.0, 170.0), (110.0, 160.0), 0.08, (6.0, -4.0))
GRID = np.stack(np.meshgrid(np.linspace(-50, 450, 26), np.linspace(-60, 440, 26)), -1).reshape(
    -1, 2
)


@given(
    preset=st.sampled_from(sorted(PRESETS)),
    seed=st.integers(0, 2**32),
    dpi=st.sampled_from([250.0, 500.0, 569.0, 1000.0]),
)
def test_both_ways_agree_to_a_thousandth_of_a_pixel(preset, seed, dpi):
    rng = np.random.default_rng(seed)
    warp = draw_warp((560, 440), (374, 388), dpi, rng, PRESETS[preset].placement)
    back = warp.from_master(warp.to_master(GRID))
    assert np.abs(back - GRID).max() < 1e-3
    there = warp.to_master(warp.from_master(GRID))
    assert np.abs(there - GRID).max() < 1e-3


def test_all_that_presets_allow_leaves_the_skin_unfolded():
    for preset in PRESETS.values():
        p = preset.placement
        half_axes = p.half_width[0], p.half_width[0] * p.elongation[1]
        torsion, traction = math.radians(p.torsion_deg[1]), (p.traction[1], 0.0)
        warp = Warp(Similarity(), (0.0, 0.0), half_axes, torsion, traction)
        assert warp.steepness < 1


def test_waves_strain_the_skin_as_far_as_it_does_not_fold():
    for strain in (0.1, 0.9):
        p = replace(PRESETS["stretched"].placement, strain=(strain, strain))
        for seed in range(5):
            warp = draw_warp((560, 440), (374, 388), 500.0, np.random.default_rng(seed), p)
            still = replace(warp, waves=())
            lengths = [math.hypot(dx, dy) * math.hypot(kx, ky) for dx, dy, kx, ky, _ in warp.waves]
            assert sum(lengths) <= strain + 1e-9
            assert warp.steepness == pytest.approx(still.steepness + sum(lengths))
            assert warp.steepness < 1
            back = warp.from_master(warp.to_master(GRID))
            assert np.abs(back - GRID).max() < 1e-3
            assert np.abs(warp.drag(GRID) - still.drag(GRID)).max() > 0.2


def test_drag_never_differs_more_than_the_steepness_says(rng):
    one = rng.uniform(-50, 450, (500, 2))
    other = one + rng.normal(size=(500, 2))
    apart = np.hypot(*(one - other).T)
    difference = np.hypot(*(WARP.drag(one) - WARP.drag(other)).T)
    assert (difference <= WARP.steepness * apart).all()
