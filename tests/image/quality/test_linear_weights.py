"""Weights are read back as they were written, and only for the features they belong to."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fpmatch.errors import FpmatchError
from fpmatch.image.quality.linear_weights import LinearWeights
from fpmatch.image.quality.polarity import load_polarity_weights
from fpmatch.image.quality.print_quality import load_quality_weights

WEIGHTS = {
    "scripts/train_polarity": load_polarity_weights(),
    "scripts/train_quality": load_quality_weights(),
}


@pytest.mark.parametrize("command", WEIGHTS)
def test_weights_survive_their_file(command: str) -> None:
    weights = WEIGHTS[command]
    again = LinearWeights.from_json(weights.as_json(), weights.names)
    for name in ("middle", "spread", "weight", "bias"):
        np.testing.assert_array_equal(getattr(again, name), getattr(weights, name))
    assert again.provenance["command"] == command


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"features": [{"name": "ridges"}]}'])
def test_other_files_are_refused_by_name(text: str, tmp_path: Path) -> None:
    path = tmp_path / "weights.json"
    path.write_text(text)
    with pytest.raises(FpmatchError, match=r"weights\.json: not a file of weights"):
        LinearWeights.load(path, ("ridges",))


def test_weights_of_other_features_are_refused() -> None:
    weights = load_quality_weights()
    with pytest.raises(FpmatchError, match="other features"):
        LinearWeights.from_json(weights.as_json(), weights.names[1:])
