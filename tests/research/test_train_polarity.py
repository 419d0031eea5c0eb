"""`research.training.polarity`: the cue that separates dark lines from bright ones is learned."""

import numpy as np
import pytest

from fpmatch.image.quality.line_cues import LINE_CUES
from fpmatch.image.quality.polarity import evidence_of_cues
from research.training.polarity import cues_of_finger, fit_polarity


def test_the_cue_that_tells_has_the_weight(rng):
    cues = rng.normal(0, 1, (400, len(LINE_CUES)))
    cues[:, 2] = rng.normal(0.02, 0.01, 400)
    weights = fit_polarity(list(cues), {"seed": 1})
    assert np.argmax(weights.weight) == 2
    assert weights.weight[2] > 5 * np.abs(np.delete(weights.weight, 2)).max()
    assert (evidence_of_cues(cues, weights) > 0).mean() > 0.9
    assert weights.provenance["prints"] == 400
    flipped = fit_polarity(list(-cues))
    assert flipped.weight == pytest.approx(-weights.weight, abs=1e-3)


def test_one_finger():
    once, again = cues_of_finger(5, 1, impressions=2), cues_of_finger(5, 1, impressions=2)
    assert 1 <= len(once) <= 2
    assert np.array_equal(once, again)
    assert np.isfinite(once).all()
