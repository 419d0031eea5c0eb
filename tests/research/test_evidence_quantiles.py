import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.matching.constants import COMPILED
from fpmatch.matching.pipeline.evidence import (
    AMOUNTS,
    MODELS,
    RATES,
    SMALL_WITH_RIDGES,
    WITH_RIDGES,
    load_weights,
)
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template
from research.training.evidence_quantiles import (
    HAVE_RIDGES,
    AmountParameters,
    AmountSample,
    amount_samples,
    fit_amounts,
    fit_quantile,
)
from research.training.score_fit import as_json
from tests.research.made_sets import extracted_set

SLOW = pytest.mark.skipif(not COMPILED, reason="minutes where kernels are interpreted")
FEW = AmountParameters(fragments=(3, 6), windows_px=(96,), probes=6, references=5)
NONE = np.empty(0)


@pytest.fixture
def synthetic_set():
    """Two impressions of three fingers, whose minutiae are drawn at random."""
    rng = np.random.default_rng(1)
    shape = (15, 15)
    ridges = rng.integers(0, 2**63, shape).astype(np.uint64)
    field = RidgeField(16.0, np.zeros(shape, np.float32), np.ones(shape, bool), ridges)
    made = {}
    for finger in (1, 2, 3):
        x, y = rng.uniform(10, 230, (2, 30))
        angle = rng.uniform(0, 6, 30)
        for number in (1, 2):
            made[finger, number] = Template(Minutiae(x + number, y, angle), 240, 240, field=field)
    return extracted_set(made)


def sample(seed, count, slope=3.0):
    """Return sums whose distribution moves with the second term."""
    rng = np.random.default_rng(seed)
    amounts = np.column_stack([np.ones(count), *rng.uniform(-1, 1, (len(AMOUNTS) - 1, count))])
    return AmountSample(rng.exponential(size=count) + slope * amounts[:, 1], NONE, amounts, 1.0)


@given(st.integers(0, 20), st.floats(-5, 5))
def test_the_share_above_the_fit_is_the_one_requested_in_any_order(seed, slope):
    one, other = sample(seed, 4000, slope), sample(seed + 1, 700)
    found = fit_quantile([one], 0.1)
    assert np.mean(one.sums > one.amounts @ found) == pytest.approx(0.1, abs=0.02)
    assert found[1] == pytest.approx(slope, abs=0.6)
    turned = fit_quantile([other, one], 0.1)
    assert fit_quantile([one, other], 0.1) == pytest.approx(turned, rel=1e-3, abs=1e-3)


def test_kinds_weigh_what_they_are_given_whatever_their_number():
    def constant(value, count, weight):
        rows = np.eye(1, len(AMOUNTS)).repeat(count, axis=0)
        return AmountSample(value + np.random.default_rng(1).normal(size=count), NONE, rows, weight)

    low = constant(0.0, 8000, 1.0)
    assert fit_quantile([low, constant(50.0, 400, 0.001)], 0.1)[0] < 5.0
    assert fit_quantile([low, constant(50.0, 400, 1.0)], 0.1)[0] > 45.0


@SLOW
@pytest.mark.parametrize(("name", "ridges"), HAVE_RIDGES.items())
def test_parts_of_prints_are_compared(synthetic_set, name, ridges):
    parameters = {"weights": load_weights(), "model": name, "ridges": ridges, "parameters": FEW}
    found = amount_samples(synthetic_set, 1, **parameters)
    model = load_weights().models[MODELS.index(name)]
    for one in found:
        assert 0 < len(one.sums) <= FEW.probes * FEW.references
        assert one.amounts.shape == (len(one.sums), len(AMOUNTS))
        assert (one.amounts[:, 0] == 1).all()
        assert one.sums == pytest.approx(model.sums(one.features))
    weights = [one.weight for one in found]
    if name == SMALL_WITH_RIDGES:  # of parts
        assert weights == [1.0, 1.0, 1.0]
    elif name == WITH_RIDGES:  # of whole prints, thinned or not
        assert weights == [FEW.whole_weight, 0.5, 0.5]
    else:
        assert weights == [FEW.whole_weight, 1.0, 1.0, 0.5, 0.5, 1.0]
        whole, three, six, *_ = (one.amounts[:, 1].mean() for one in found)
        assert whole < six < three  # of 1 / (n + 1)


@SLOW
def test_quantiles_of_all_models_are_fitted(synthetic_set):
    weights = load_weights()
    found = fit_amounts(weights, [synthetic_set], workers=1, parameters=FEW)
    quantiles = np.stack([model.quantiles for model in found.models])
    assert quantiles.shape == (len(MODELS), len(RATES), len(AMOUNTS))
    assert np.isfinite(quantiles).all()
    for model, before in zip(found.models, weights.models, strict=True):
        assert model.standard.tolist() == before.standard.tolist()
    again = fit_amounts(weights, [synthetic_set], workers=1, parameters=FEW)
    assert as_json(again) == as_json(found)
