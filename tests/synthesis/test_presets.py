"""Four, each harder than the one before, and stretched prints."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import pytest

from fpmatch.errors import ImageError
from fpmatch.synthesis.presets import PRESETS, preset_named


def test_there_are_four_from_easy_to_hard_and_stretched_prints() -> None:
    assert list(PRESETS) == ["clean", "easy", "normal", "hard", "stretched"]
    assert all(preset_named(name) is preset for name, preset in PRESETS.items())
    assert [preset.name for preset in PRESETS.values()] == list(PRESETS)
    with pytest.raises(ImageError, match=r"^no preset 'harder': there are clean, easy, [^\n]*$"):
        preset_named("harder")


def test_each_turns_and_stretches_at_least_as_far_as_the_one_before() -> None:
    presets = [preset for preset in PRESETS.values() if preset.name != "stretched"]
    for easier, harder in pairwise(presets):
        for name in ("rotation_deg", "shift", "torsion_deg", "traction", "off_centre"):
            one, two = (getattr(p.placement, name)[1] for p in (easier, harder))
            assert one <= two, name
        assert easier.placement.tip_only <= harder.placement.tip_only
        assert easier.placement.cut_off <= harder.placement.cut_off
        assert easier.pressure.grain < harder.pressure.grain
        assert easier.pressure.max_spots < harder.pressure.max_spots
        assert easier.smear.chance < harder.smear.chance


def test_stretched_prints_differ_from_normal_ones_in_their_distortion_alone() -> None:
    normal, stretched = PRESETS["normal"], PRESETS["stretched"]
    for name in ("torsion_deg", "traction"):
        one, two = (getattr(p.placement, name) for p in (normal, stretched))
        assert one[0] < two[0]
        assert one[1] < two[1]
    same = {name: getattr(normal.placement, name) for name in ("torsion_deg", "traction")}
    placement = replace(stretched.placement, **same)
    assert replace(stretched, name="normal", placement=placement) == normal
