"""Sizes and resolutions of the FVC sensors; no impossible ones."""

from __future__ import annotations

import pytest

from fpmatch.errors import ImageError, ResolutionError
from fpmatch.synthesis.sensor import SENSORS, Sensor

FVC = [(388, 374, 500), (296, 560, 569), (300, 300, 500), (288, 384, 500), (640, 480, 500)]


def test_sensors_have_the_sizes_and_resolutions_of_the_fvc() -> None:
    known = [(s.width, s.height, s.dpi) for s in SENSORS.values()]
    assert known == [*FVC, (328, 364, 500)]
    assert list(SENSORS) == [sensor.name for sensor in SENSORS.values()]


@pytest.mark.parametrize(("width", "height"), [(0, 100), (100, -5), (31, 100), (100, 5000)])
def test_impossible_sizes_are_refused(width: int, height: int) -> None:
    with pytest.raises(ImageError, match=rf"^sensor bad: {width} x {height} pixels[^\n]*$"):
        Sensor("bad", width, height)


@pytest.mark.parametrize("dpi", [0, 99, 4001, float("nan")])
def test_impossible_resolutions_are_refused(dpi: float) -> None:
    with pytest.raises(ResolutionError):
        Sensor("bad", 100, 100, dpi)
