"""`fpmatch.image.preprocess.blocks`: fields of cells, blurred and brought to pixels and back."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from fpmatch.image.enhancement.spectrum import SpectrumParameters, ridge_spectrum
from fpmatch.image.preprocess import _blocks_kernel as kernel
from fpmatch.image.preprocess.blocks import (
    Blocks,
    block_mean_product,
    blocks_to_pixels,
    blur_blocks,
    pixels_to_blocks,
)

EIGHT = SpectrumParameters(step_px=8)


def test_cells_to_pixels_is_linear_between_the_centres_of_cells() -> None:
    spectrum = ridge_spectrum(np.zeros((16, 37), np.float32))
    step = spectrum.step_px
    columns = spectrum.total.shape[1]
    ramp = np.tile(np.arange(columns, dtype=np.float32), (spectrum.total.shape[0], 1))
    pixels = blocks_to_pixels(ramp, spectrum)
    assert pixels.shape == (16, 37)
    between = np.arange(step // 2, (columns - 1) * step - step // 2)
    assert pixels[5, between] == pytest.approx((between + 0.5) / step - 0.5, abs=1e-4)
    assert blocks_to_pixels(np.dstack([ramp, ramp]), spectrum).shape == (16, 37, 2)


def test_pixels_to_cells_is_the_mean_of_each_cell(rng: np.random.Generator) -> None:
    spectrum = ridge_spectrum(np.zeros((24, 32), np.float32), EIGHT)
    pixels = rng.random((24, 32), dtype=np.float32)
    cells = pixels_to_blocks(pixels, spectrum)
    assert cells.shape == (3, 4)
    assert cells[1, 2] == pytest.approx(pixels[8:16, 16:24].mean())


def test_a_cell_cut_off_by_the_border_repeats_its_edge() -> None:
    spectrum = ridge_spectrum(np.zeros((20, 20), np.float32), EIGHT)
    assert (pixels_to_blocks(np.full((20, 20), 3, np.float32), spectrum) == 3).all()


@pytest.mark.parametrize("shape", [(1, 1), (7, 9), (8, 8), (17, 40), (48, 1)])
@pytest.mark.parametrize("step", [1, 8, 16])
def test_cells_cover_an_image_of_any_size(
    rng: np.random.Generator, shape: tuple[int, int], step: int
) -> None:
    grid = Blocks(step, shape)
    pixels = rng.random(shape, dtype=np.float32)
    cells = pixels_to_blocks(pixels, grid)
    assert cells.shape == (-(-shape[0] // step), -(-shape[1] // step))
    assert cells.dtype == np.float32
    repeated = np.pad(pixels, ((0, step - 1), (0, step - 1)), mode="edge")
    for (i, j), mean in np.ndenumerate(cells):
        cell = repeated[i * step : (i + 1) * step, j * step : (j + 1) * step]
        assert mean == pytest.approx(cell.mean(), rel=1e-4)
    at_pixels = blocks_to_pixels(cells, grid)
    assert at_pixels.shape == shape
    assert cells.min() - 1e-5 <= at_pixels.min() <= at_pixels.max() <= cells.max() + 1e-5


@pytest.mark.parametrize("shape", [(1, 1), (7, 9), (8, 8), (17, 40), (48, 1)])
@pytest.mark.parametrize("step", [1, 8, 16])
@pytest.mark.parametrize("compiled", [True, False])
def test_products_are_averaged_as_an_image_of_them_is(
    monkeypatch: pytest.MonkeyPatch,
    rng: np.random.Generator,
    shape: tuple[int, int],
    step: int,
    compiled: bool,
) -> None:
    monkeypatch.setattr(kernel, "COMPILED", compiled and kernel.COMPILED)
    a, b = rng.normal(0, 1, (2, *shape)).astype(np.float32)
    a.setflags(write=False)
    grid = Blocks(step, shape)
    expected = pixels_to_blocks(a * b, grid)
    for image in (a, np.asfortranarray(a)):
        np.testing.assert_allclose(block_mean_product(image, b, grid), expected, atol=1e-5)


@pytest.mark.parametrize("channels", [1, 3, 4, 5, 16])
def test_each_channel_is_blurred_by_itself(rng: np.random.Generator, channels: int) -> None:
    cells = rng.random((9, 7, channels), dtype=np.float32)
    blurred = blur_blocks(cells, 1.2)
    for k in range(channels):
        alone = np.ascontiguousarray(cells[:, :, k])
        once = cv2.GaussianBlur(alone, (0, 0), 1.2, borderType=cv2.BORDER_REPLICATE)
        np.testing.assert_allclose(blurred[:, :, k], once, rtol=1e-5, atol=1e-6)
        np.testing.assert_array_equal(blur_blocks(alone, 1.2), once)
