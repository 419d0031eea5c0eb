"""Prints of all presets and sensors: what they were when the networks were trained with them."""

import numpy as np
import pytest

from fpmatch.lab.synthesis.impression import make_impression
from fpmatch.lab.synthesis.master import make_master
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import SENSORS

FINGER = 6  # of seed 5: has incipient ridges, thin creases and wide ones
# Minutiae and visible ones; mean, deviation, and mean difference of neighbouring rows and columns.
PRINTS = {
    ("clean", "optical-388x374", 1): (70, 39, 199.88, 78.16, 16.54, 12.87),
    ("easy", "optical-388x374", 1): (70, 37, 203.23, 74.95, 16.13, 13.13),
    ("stretched", "optical-388x374", 2): (65, 24, 243.76, 29.83, 5.49, 4.02),
    ("normal", "optical-388x374", 3): (54, 20, 235.47, 38.52, 6.89, 5.53),
    ("normal", "optical-296x560", 3): (49, 24, 156.65, 37.80, 8.78, 7.50),
    ("normal", "capacitive-300x300", 3): (44, 20, 96.58, 34.54, 13.84, 13.11),
    ("normal", "plain-288x384", 3): (47, 23, 141.19, 49.97, 13.09, 11.08),
    ("normal", "optical-640x480", 3): (70, 18, 246.40, 28.76, 3.97, 3.02),
    ("normal", "optical-328x364", 3): (50, 22, 173.01, 58.19, 8.87, 7.75),
    ("hard", "optical-388x374", 4): (40, 5, 251.28, 16.25, 1.59, 1.38),
    ("hard", "optical-328x364", 5): (63, 15, 195.07, 33.10, 4.66, 4.69),
    ("rolled", "rolled-512x512", 6): (85, 71, 154.58, 48.51, 10.31, 11.09),
    ("rolled", "rolled-512x512", 7): (79, 56, 131.89, 45.81, 7.90, 8.72),
}


@pytest.fixture(scope="module")
def masters():
    return {preset: make_master(5, FINGER, PRESETS[preset].master) for preset in ("hard", "rolled")}


@pytest.mark.parametrize(("preset", "sensor", "number"), PRINTS)
def test_prints_are_what_they_were(masters, preset, sensor, number):
    master = masters["rolled" if preset == "rolled" else "hard"]
    made = make_impression(master, number, PRESETS[preset], SENSORS[sensor])
    grey = made.image.astype(float)
    rough = [np.abs(np.diff(grey, axis=axis)).mean() for axis in (0, 1)]
    minutiae, visible, *levels = PRINTS[preset, sensor, number]
    assert (len(made.minutiae), made.visible.sum()) == (minutiae, visible)
    assert (grey.mean(), grey.std(), *rough) == pytest.approx(levels, abs=0.03)
