"""A wave shows as its own angle and period, where it is."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_images import plane_wave, turn_between

from fpmatch.image.enhancement.spectrum import RidgeSpectrum, SpectrumParameters, ridge_spectrum

PARAMETERS = SpectrumParameters()
STEP = PARAMETERS.step_px


def peak(spectrum: RidgeSpectrum, row: int, column: int) -> tuple[float, float]:
    """Return angle (degrees) and period of the strongest wave of a block."""
    energy = spectrum.energy[row, column]
    a, f = np.unravel_index(energy.argmax(), energy.shape)
    return float(np.degrees(spectrum.angles[a])), float(spectrum.periods[f])


@pytest.mark.parametrize("shape", [(1, 1), (1, 50), (50, 1), (48, 48), (49, 63), (16, 200)])
def test_the_cells_cover_the_image(shape: tuple[int, int]) -> None:
    spectrum = ridge_spectrum(np.ones(shape, np.float32))
    blocks = (-(-shape[0] // STEP), -(-shape[1] // STEP))
    assert spectrum.shape == shape
    assert spectrum.total.shape == blocks
    assert spectrum.energy.shape == (*blocks, spectrum.angles.size, spectrum.periods.size)
    assert (spectrum.total > 0).all()
    nothing = ridge_spectrum(np.zeros(shape, np.float32))
    assert not nothing.energy.any()
    assert not nothing.total.any()


@pytest.mark.parametrize("period", PARAMETERS.periods_px)
@pytest.mark.parametrize("index", range(0, PARAMETERS.angles, 3))
def test_a_sampled_wave_is_the_peak_and_holds_all_energy(index: int, period: float) -> None:
    angle = index * 180 / PARAMETERS.angles
    spectrum = ridge_spectrum(plane_wave(angle, period, (72, 72), phase=0.7))
    found, found_period = peak(spectrum, 4, 4)
    assert found == pytest.approx(angle)
    assert found_period == pytest.approx(period)
    share = spectrum.energy[4, 4].max() / spectrum.total[4, 4]
    assert share == pytest.approx(1, abs=0.08)


@given(st.floats(0, 180), st.floats(5, 15), st.floats(0, 7))
def test_any_wave_peaks_near_its_angle_and_period(
    angle: float, period: float, phase: float
) -> None:
    spectrum = ridge_spectrum(plane_wave(angle, period, (72, 72), phase))
    found, found_period = peak(spectrum, 4, 4)
    assert turn_between(found, angle, period_deg=180) <= 180 / PARAMETERS.angles
    assert 1 / 1.2 < found_period / period < 1.2


def test_energy_does_not_depend_on_the_phase_and_grows_with_the_square() -> None:
    one = ridge_spectrum(plane_wave(45, 8)).energy[6, 6]
    other = ridge_spectrum(plane_wave(45, 8, phase=1.3)).energy[6, 6]
    double = ridge_spectrum(2 * plane_wave(45, 8)).energy[6, 6]
    assert other == pytest.approx(one, abs=0.05 * float(one.max()))
    assert double == pytest.approx(4 * one, rel=1e-3, abs=1e-5)


def test_brightness_is_no_wave() -> None:
    wave = plane_wave(45, 8)
    inside = (slice(3, 9), slice(3, 9))
    plain, brighter = ridge_spectrum(wave), ridge_spectrum(wave + np.float32(0.5))
    assert brighter.energy[inside] == pytest.approx(plain.energy[inside], abs=1e-4)
    assert (brighter.total[inside] > plain.total[inside] + 0.1).all()


def test_no_wave_holds_more_than_the_whole(rng: np.random.Generator) -> None:
    spectrum = ridge_spectrum(rng.normal(0, 1, (100, 120)).astype(np.float32))
    assert (spectrum.energy >= 0).all()
    assert (spectrum.energy <= 1.05 * spectrum.total[..., None, None]).all()


def test_a_wave_is_found_in_its_own_cells() -> None:
    pixels = plane_wave(90, 8, (96, 192))
    pixels[:, 96:] = 0
    spectrum = ridge_spectrum(pixels)
    assert (spectrum.total[2:-2, 2:9] > 0.4).all()
    assert (spectrum.total[:, 16:] < 1e-6).all()


def test_moving_the_image_by_a_cell_moves_the_spectrum_by_a_cell(rng: np.random.Generator) -> None:
    pixels = rng.normal(0, 1, (96, 112)).astype(np.float32)
    moved = np.roll(pixels, (STEP, 2 * STEP), axis=(0, 1))
    one, other = ridge_spectrum(pixels), ridge_spectrum(moved)
    assert other.energy[5:8, 6:9] == pytest.approx(one.energy[4:7, 4:7], rel=1e-3, abs=1e-4)
    assert other.total[5:8, 6:9] == pytest.approx(one.total[4:7, 4:7], rel=1e-4)


def test_turning_the_image_turns_the_spectrum() -> None:
    pixels = plane_wave(20, 9, (96, 96))
    half = PARAMETERS.angles // 2
    one, other = ridge_spectrum(pixels), ridge_spectrum(np.rot90(pixels))
    turned = np.roll(np.rot90(one.energy), half, axis=2)
    assert other.energy[4:8, 4:8].argmax(axis=2) == pytest.approx(turned[4:8, 4:8].argmax(axis=2))


def test_the_parameters_reach_the_computation() -> None:
    spectrum = ridge_spectrum(
        plane_wave(0, 8, (40, 60)), SpectrumParameters(step_px=10, angles=4, periods_px=(6.0, 8.0))
    )
    assert spectrum.energy.shape == (4, 6, 4, 2)
    assert peak(spectrum, 2, 3) == (0.0, 8.0)
