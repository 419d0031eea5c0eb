"""The fit of the score's weights, on samples drawn from distributions that are known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fpmatch.evaluation.dataset import Dataset, Impression
from fpmatch.evaluation.extraction import ExtractedSet, Extraction
from fpmatch.evaluation.score_fit import (
    FitParameters,
    ScoreSample,
    fit_weights,
    rates_of,
    sample_of,
)
from fpmatch.matching.score import FEATURES
from fpmatch.minutiae import Minutiae, RidgeField, Template

N = len(FEATURES)
EVEN = FitParameters(impostor_weight=1.0, lost_share=0.0, ridge=1e-9)


def sample(seed: int, count: int = 4000, apart: float = 2.0, lost: int = 0) -> ScoreSample:
    """Return features of unit spread whose kinds lie `apart` in the first; the rest are noise."""
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(2 * count + lost, N))
    genuine = np.arange(2 * count + lost) >= count
    x[count : 2 * count, 0] += apart
    return ScoreSample(f"set {seed}", x, genuine, (0, 0))


def raw_weights(samples: list[ScoreSample], parameters: FitParameters) -> np.ndarray:
    """Return the weights of features as they are, and the bias last."""
    weights = fit_weights(samples, parameters=parameters)
    middle, spread, weight = weights.standard
    slope = weight / spread
    return np.append(slope, weights.bias - slope @ middle)


def test_the_weights_are_those_of_the_likelihood_ratio() -> None:
    """Of two normal distributions of unit spread it is d·x - d²/2."""
    found = raw_weights([sample(1), sample(2)], EVEN)
    assert found == pytest.approx([2.0, *[0.0] * (N - 1), -2.0], abs=0.15)


@pytest.mark.parametrize("impostor_weight", [1.0, 10.0, 100.0])
def test_the_weight_of_impostors_moves_no_sum_where_the_model_is_right(
    impostor_weight: float,
) -> None:
    parameters = replace(EVEN, impostor_weight=impostor_weight)
    found = raw_weights([sample(1), sample(2)], parameters)
    assert found[0] == pytest.approx(2.0, abs=0.15)
    assert found[-1] == pytest.approx(-2.0, abs=0.3)


def test_lost_comparisons_do_not_pull_the_fit_where_they_are_allowed_for() -> None:
    samples = [sample(k, lost=400) for k in (1, 2)]
    pulled = raw_weights(samples, EVEN)
    kept = raw_weights(samples, replace(EVEN, lost_share=0.09))
    assert pulled[0] < 1.8 < kept[0] < 2.2


def test_features_left_out_have_no_weight() -> None:
    weights = fit_weights([sample(1)], without=(FEATURES[0], FEATURES[3]))
    assert weights.standard[2, [0, 3]].tolist() == [0.0, 0.0]
    assert (weights.standard[2, [1, 2]] != 0).all()


def test_the_same_samples_give_the_same_weights() -> None:
    samples = [sample(1), sample(2)]
    assert fit_weights(samples).as_json() == fit_weights(samples).as_json()


def test_rates_are_those_of_the_weighted_sums() -> None:
    samples = [sample(3, apart=8.0), replace(sample(4, apart=8.0), nothing=(1000, 0))]
    rates = rates_of(samples, [fit_weights(samples)] * 2)
    assert rates["sets"]["set 3"] == {"eer": 0.0, "fmr1000": 0.0}
    # a fifth of the genuine comparisons found nothing
    assert rates["sets"]["set 4"]["fmr1000"] == pytest.approx(20.0)
    assert rates["pooled"]["fmr1000"] == pytest.approx(100 * 1000 / 9000, abs=0.01)


def test_a_sample_is_all_comparisons_of_a_database(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    field = RidgeField(16.0, np.zeros((12, 12), np.float32), np.ones((12, 12), bool))
    impressions, extractions = [], []
    for finger in (1, 2):
        x, y, angle = rng.uniform(20, 180, (3, 9))
        for number in (1, 2):
            impressions.append(Impression(finger, number, tmp_path / f"{finger}_{number}.tif"))
            template = Template(Minutiae(x + number, y, angle), 192, 192, field=field)
            extractions.append(Extraction(template, "", 0.0))
    extractions[-1] = Extraction(None, "no ridges", 0.0)
    dataset = Dataset("two", 500.0, "", tuple(impressions))
    found = sample_of(ExtractedSet(dataset, tuple(extractions)))
    assert found.name == "two"
    assert found.features.shape == (len(found.genuine), N)
    assert found.genuine.sum() + found.nothing[0] == 2
    assert (~found.genuine).sum() + found.nothing[1] == 4
    assert found.nothing[0] >= 1
    assert found.genuine.any()
