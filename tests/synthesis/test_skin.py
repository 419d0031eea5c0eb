"""Roughness, pores and creases that belong to the finger."""

from __future__ import annotations

import numpy as np
import pytest

from fpmatch.synthesis.master import Master, MasterParameters, make_master
from fpmatch.synthesis.skin import SkinParameters, draw_pores, skin_of


@pytest.fixture(scope="module")
def master() -> Master:
    return make_master(3, 0, MasterParameters(shape=(120, 112)))


def test_another_finger_of_the_same_ridges_has_another_skin(master: Master) -> None:
    other = make_master(3, 1, MasterParameters(shape=(120, 112)))
    roughness, others = (skin_of(m).relief - m.relief for m in (master, other))
    assert abs(np.corrcoef(roughness.ravel(), others.ravel())[0, 1]) < 0.1


def test_pores_are_pits_on_crests_that_keep_apart(master: Master) -> None:
    p = SkinParameters()
    depth = draw_pores(master.relief, np.random.default_rng(1), p)
    assert depth.min() >= 0
    pits = np.argwhere(depth > 0.7 * p.pore_depth)
    assert len(pits) > 20
    assert (master.relief[tuple(pits.T)] > 0).mean() > 0.95
    valley = np.full((50, 40), -1.0, np.float32)
    assert not draw_pores(valley, np.random.default_rng(1), p).any()


def test_without_roughness_pores_and_creases_the_skin_is_the_relief(master: Master) -> None:
    skin = skin_of(master, SkinParameters(texture=0, pore_depth=0, mean_creases=0))
    np.testing.assert_array_equal(skin.relief, master.relief)
    assert not skin.creases.any()
