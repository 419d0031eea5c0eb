"""Presets from easy to hard and stretched prints; sensors as those of the FVC."""

from itertools import pairwise

import pytest

from fpmatch.errors import ImageError, ResolutionError
from fpmatch.lab.synthesis.presets import PRESETS, preset_named
from fpmatch.lab.synthesis.sensor import Sensor


def test_there_are_four_from_easy_to_hard_and_stretched_prints():
    assert list(PRESETS) == ["clean", "easy", "normal", "hard", "stretched"]
    assert all(preset_named(name) is preset for name, preset in PRESETS.items())
    with pytest.raises(ImageError, match=r"^unknown preset 'harder'; known: clean, easy, [^\n]*$"):
        preset_named("harder")


def test_each_turns_and_stretches_at_least_as_far_as_the_one_before():
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


@pytest.mark.parametrize(("width", "height"), [(0, 100), (100, -5), (31, 100), (100, 5000)])
def test_impossible_sizes_are_refused(width, height):
    with pytest.raises(ImageError, match=rf"^sensor bad: {width} x {height} [^\n]*$"):
        Sensor("bad", width, height)


@pytest.mark.parametrize("dpi", [0, 99, 4001, float("nan")])
def test_impossible_resolutions_are_refused(dpi):
    with pytest.raises(ResolutionError):
        Sensor("bad", 100, 100, dpi)
