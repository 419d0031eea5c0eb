import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.image.preprocess.arrays import BLOCK_PX
from fpmatch.image.preprocess.spectrum import ANGLES, PERIODS_PX, ridge_spectrum
from tests.image.made_images import plane_wave, turn_between


def peak(spectrum, row, column):
    """Return angle (degrees) and period of the strongest wave of a block."""
    energy = spectrum.energy[row, column]
    a, f = np.unravel_index(energy.argmax(), energy.shape)
    return float(np.degrees(ANGLES[a])), float(PERIODS_PX[f])


@pytest.mark.parametrize("shape", [(1, 1), (1, 50), (50, 1), (48, 48), (49, 63), (16, 200)])
def test_the_blocks_cover_the_image(shape):
    spectrum = ridge_spectrum(np.ones(shape, np.float32))
    blocks = (-(-shape[0] // BLOCK_PX), -(-shape[1] // BLOCK_PX))
    assert spectrum.total.shape == blocks
    assert spectrum.energy.shape == (*blocks, ANGLES.size, PERIODS_PX.size)
    assert (spectrum.total > 0).all()
    nothing = ridge_spectrum(np.zeros(shape, np.float32))
    assert not nothing.energy.any()
    assert not nothing.total.any()


@pytest.mark.parametrize("period", PERIODS_PX)
@pytest.mark.parametrize("angle", np.degrees(ANGLES[::3]))
def test_a_sampled_wave_is_the_peak_and_holds_all_energy(angle, period):
    spectrum = ridge_spectrum(plane_wave(angle, period, (72, 72), phase=0.7))
    assert peak(spectrum, 4, 4) == pytest.approx((angle, period))
    share = spectrum.energy[4, 4].max() / spectrum.total[4, 4]
    assert share == pytest.approx(1, abs=0.08)


@given(st.floats(0, 180), st.floats(5, 15), st.floats(0, 7))
def test_any_wave_peaks_near_its_angle_and_period(angle, period, phase):
    found, found_period = peak(ridge_spectrum(plane_wave(angle, period, (72, 72), phase)), 4, 4)
    assert turn_between(found, angle, period_deg=180) <= 180 / ANGLES.size
    assert 1 / 1.2 < found_period / period < 1.2


def test_energy_does_not_depend_on_phase_or_brightness_and_grows_with_the_square():
    wave = plane_wave(45, 8)
    one, other, double, brighter = (
        ridge_spectrum(pixels)
        for pixels in (wave, plane_wave(45, 8, phase=1.3), 2 * wave, wave + np.float32(0.5))
    )
    middle, inside = (6, 6), np.s_[3:9, 3:9]
    tolerance = 0.05 * float(one.energy[middle].max())
    assert other.energy[middle] == pytest.approx(one.energy[middle], abs=tolerance)
    assert double.energy[middle] == pytest.approx(4 * one.energy[middle], rel=1e-3, abs=1e-5)
    assert brighter.energy[inside] == pytest.approx(one.energy[inside], abs=1e-4)
    assert (brighter.total[inside] > one.total[inside] + 0.1).all()
