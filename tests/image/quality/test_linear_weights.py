import numpy as np
import pytest

from fpmatch.errors import FpmatchError
from fpmatch.image.quality import print_quality
from fpmatch.image.quality.line_cues import LINE_CUES, WEIGHTS_FILE
from fpmatch.image.quality.measures import LinearWeights

WEIGHTS = {
    "scripts/train_polarity": LinearWeights.load(WEIGHTS_FILE, LINE_CUES),
    "scripts/train_quality": LinearWeights.load(print_quality.WEIGHTS_FILE, print_quality.FEATURES),
}


@pytest.mark.parametrize("command", WEIGHTS)
def test_weights_survive_their_file_and_are_refused_for_other_features(command, tmp_path):
    weights, path = WEIGHTS[command], tmp_path / "weights.json"
    path.write_text(weights.as_json())
    again = LinearWeights.load(path, weights.names)
    for name in ("middle", "spread", "weight", "bias"):
        np.testing.assert_array_equal(getattr(again, name), getattr(weights, name))
    assert again.provenance["command"] == command
    with pytest.raises(FpmatchError, match=r"weights\.json: .*other features"):
        LinearWeights.load(path, weights.names[1:])


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"features": [{"name": "ridges"}]}'])
def test_other_files_are_refused_by_name(text, tmp_path):
    path = tmp_path / "weights.json"
    path.write_text(text)
    with pytest.raises(FpmatchError, match=r"weights\.json: "):
        LinearWeights.load(path, ("ridges",))
