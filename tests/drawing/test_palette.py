from __future__ import annotations

import numpy as np
import pytest

from fpmatch.drawing import palette

# Viénot, Brettel, Mollon, "Digital video colourmaps for checking the legibility of displays by
# dichromats" (1999): linear RGB as a protanope and a deuteranope see it.
SEEN = {
    "all": np.eye(3),
    "protanope": np.array([[0.1121, 0.8853, -0.0005], [0.1127, 0.8897, -0.0001], [0.0045, 0, 1]]),
    "deuteranope": np.array([[0.2920, 0.7054, -0.0003], [0.2934, 0.7089, 0], [-0.0210, 0.0256, 1]]),
}


@pytest.mark.parametrize("viewer", SEEN)
def test_inks_and_their_mixture_are_distinguishable(viewer):
    both = palette.mixed((palette.PROBE_INK, palette.REFERENCE_INK))
    colours = [palette.PAPER, palette.PROBE_INK, palette.REFERENCE_INK, both]
    linear = (np.array(colours) / 255) ** 2.2
    seen = np.clip(linear @ SEEN[viewer].T, 0, 1) ** (1 / 2.2)
    distances = np.linalg.norm(seen[:, None] - seen[None], axis=2)
    assert distances[np.triu_indices(4, 1)].min() > 0.35


def test_the_mixture_is_darker_than_either_ink():
    both = palette.mixed((palette.PROBE_INK, palette.REFERENCE_INK))
    assert max(both) < 90
    assert min(max(palette.PROBE_INK), max(palette.REFERENCE_INK)) > 200
