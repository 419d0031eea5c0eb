import numpy as np
import pytest

from fpmatch.image.enhancement.gabor import gabor_filter
from fpmatch.image.preprocess.normalize import normalize
from fpmatch.image.preprocess.spectrum import ridge_spectrum
from fpmatch.image.skeleton.binarize import binarize
from fpmatch.image.skeleton.minutiae import find_nodes, minutia_quality
from fpmatch.image.skeleton.thin import thin
from tests.image.made_images import as_picture, plane_wave

WAVE = plane_wave(33, 7, (60, 90))
RIDGES = WAVE > 0
WHOLE = np.ones_like(RIDGES)
AT = np.array([30, 59]), np.array([20, 0])
STAGES = {
    "normalize": (normalize, as_picture(WAVE)),
    "ridge_spectrum": (ridge_spectrum, WAVE),
    "gabor_filter": (lambda pixels: gabor_filter(pixels, WHOLE, 0 * WAVE, 0 * WAVE + 7), WAVE),
    "binarize": (lambda enhanced: binarize(enhanced, WHOLE), WAVE),
    "binarize, mask": (lambda mask: binarize(WAVE, mask), RIDGES),
    "thin": (thin, RIDGES),
    "thin, bytes": (thin, RIDGES.astype(np.uint8) * 255),
    "find_nodes": (lambda skeleton: find_nodes(skeleton, 12), thin(RIDGES)),
    "minutia_quality": (lambda pixels: minutia_quality(pixels, WAVE, *AT), WAVE),
}


@pytest.mark.parametrize("name", STAGES)
def test_memory_layout_does_not_matter(name):
    stage, array = STAGES[name]
    kept = array.copy()
    array = array.copy()
    array.setflags(write=False)
    expected = stage(array)
    assert np.array_equal(array, kept)
    wide = np.repeat(array, 2, axis=1)
    for other in (np.asfortranarray(array), wide[:, ::2], array[::-1, ::-1][::-1, ::-1]):
        found = stage(other)
        both = (expected, found) if isinstance(expected, tuple) else ([expected], [found])
        assert all(map(np.array_equal, *both))
