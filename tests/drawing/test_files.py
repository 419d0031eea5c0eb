from __future__ import annotations

import cv2
import numpy as np
import pytest

from fpmatch.drawing.files import png_bytes, webp_bytes


@pytest.mark.parametrize("shape", [(5, 7), (5, 7, 3), (5, 7, 4)])
def test_png_keeps_every_pixel(rng, shape):
    picture = rng.integers(0, 256, shape, dtype=np.uint8)
    stored = cv2.imdecode(np.frombuffer(png_bytes(picture), np.uint8), cv2.IMREAD_UNCHANGED)
    order = {2: [slice(None)], 3: [[2, 1, 0]], 4: [[2, 1, 0, 3]]}
    back = stored if len(shape) == 2 else stored[..., order[shape[2]][0]]
    np.testing.assert_array_equal(back, picture)


def test_webp_is_nearly_the_picture(rng):
    picture = np.repeat(np.repeat(rng.integers(0, 256, (4, 5, 3), dtype=np.uint8), 16, 0), 16, 1)
    stored = cv2.imdecode(np.frombuffer(webp_bytes(picture, 95), np.uint8), cv2.IMREAD_COLOR)
    assert np.abs(stored[..., ::-1].astype(int) - picture).mean() < 6
