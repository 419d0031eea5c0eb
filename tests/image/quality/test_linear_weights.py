import numpy as np
import pytest

from fpmatch.errors import FpmatchError
from fpmatch.image.quality.measures import LinearWeights
from fpmatch.image.quality.print_quality import FEATURES, WEIGHTS_FILE


def test_weights_survive_their_file_and_are_refused_for_other_features(tmp_path):
    weights, path = LinearWeights.load(WEIGHTS_FILE, FEATURES), tmp_path / "weights.json"
    path.write_text(weights.as_json())
    again = LinearWeights.load(path, FEATURES)
    for name in ("middle", "spread", "weight", "bias"):
        np.testing.assert_array_equal(getattr(again, name), getattr(weights, name))
    with pytest.raises(FpmatchError, match=r"weights\.json: .*other features"):
        LinearWeights.load(path, FEATURES[1:])


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"features": [{"name": "ridges"}]}'])
def test_other_files_are_refused_by_name(text, tmp_path):
    path = tmp_path / "weights.json"
    path.write_text(text)
    with pytest.raises(FpmatchError, match=r"weights\.json: "):
        LinearWeights.load(path, ("ridges",))
