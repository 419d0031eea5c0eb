from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fpmatch.matching.pipeline.evidence import (
    AMOUNTS,
    FEATURES,
    MODELS,
    RATES,
    STANDARD,
    WEIGHTS_FILE,
    ScoreModel,
    ScoreWeights,
    load_weights,
)
from research.training.score_fit import (
    OF_RIDGES,
    FitParameters,
    _prefilter,
    as_json,
    best_hypotheses,
    fit_model,
    fit_weights,
)
from research.training.score_samples import NO_PREFILTER, ScoreSample

N = len(FEATURES)
RIDGES = FEATURES.index("ridges")
EVEN = FitParameters(impostor_weight=1.0, lost_share=0.0, ridge=1e-9)


def sample(seed, count=4000, apart=2.0, lost=0, ridges=True):
    """Return features of unit spread whose kinds lie `apart` in the first; the rest are noise.

    Every comparison has one hypothesis. Without `ridges` the features of the ridges are 0.
    """
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(2 * count + lost, N))
    genuine = np.arange(2 * count + lost) >= count
    x[count : 2 * count, 0] += apart
    x[:, OF_RIDGES] *= ridges
    scores = np.stack([rng.poisson(np.where(genuine, 40, 8)), rng.integers(10, 50, len(x))], axis=1)
    strength = rng.exponential(np.where(genuine, 0.2, 0.01))
    features = x[:, None], x[:, None].copy()
    return ScoreSample(f"set {seed}", *features, scores * 1.0, strength, genuine, (0, 0))


def with_hypotheses(one, features, coarse, *, first=False):
    """Return a sample whose comparisons have more hypotheses, before or after their own."""
    pairs = (one.features, features), (one.coarse, coarse)
    joined = [np.concatenate(pair[::-1] if first else pair, axis=1) for pair in pairs]
    return replace(one, features=joined[0], coarse=joined[1])


def raw_weights(samples, parameters):
    """Return the weights of features as they are, and the bias last."""
    model = fit_model(samples, parameters=parameters)
    middle, spread, weight, _ = model.standard
    slope = weight / spread
    return np.append(slope, model.bias - slope @ middle)


def coarse_sums(one, model):
    """Return the sums in coarse alignment, where ridges count as those of impostors."""
    middle, spread, weight, impostor_mean = model.standard
    x = np.where(OF_RIDGES, impostor_mean, one.coarse[:, 0])
    return model.bias + (x - middle) / spread @ weight


@pytest.mark.parametrize(("impostor_weight", "tolerance"), [(1.0, 0.15), (100.0, 0.3)])
def test_the_weights_are_those_of_the_likelihood_ratio(impostor_weight, tolerance):
    """Of two normal distributions of unit spread it is d·x - d²/2, whatever impostors weigh."""
    found = raw_weights([sample(1), sample(2)], replace(EVEN, impostor_weight=impostor_weight))
    assert found == pytest.approx([2.0, *[0.0] * (N - 1), -2.0], abs=tolerance)


def test_features_left_out_have_no_weight():
    model = fit_model([sample(1)], without=(FEATURES[0], FEATURES[3]))
    assert (model.standard[2] == 0).nonzero()[0].tolist() == [0, 3]


def test_the_models_are_fitted_to_samples_of_their_own_and_always_the_same():
    samples = [sample(1, count=300), sample(2, count=200, lost=50)]
    arguments = samples, [sample(1, count=100, ridges=False)], [sample(3)]
    weights = fit_weights(*arguments, command="make weights")
    assert as_json(weights) == as_json(fit_weights(*arguments, command="make weights"))
    found = weights.provenance
    assert found["sets"] == ["set 1", "set 2"]
    assert (found["genuine"], found["impostors"]) == (550, 500)
    assert found["command"] == "make weights"
    read = ScoreWeights.from_json(as_json(weights)).models
    assert [model.standard.shape for model in read] == [(4, N)] * len(MODELS)
    first, second, small = weights.models
    assert (first.standard[2, OF_RIDGES] != 0).tolist() == [True, True, False]
    assert (small.standard[2, OF_RIDGES] != 0).all()
    assert ((second.standard[2] == 0) == OF_RIDGES).all()
    assert second.standard[1, OF_RIDGES].tolist() == [1.0, 1.0, 1.0]


@pytest.mark.parametrize("refined", [0.01, 0.06, 0.25, 1.0])
def test_the_refine_threshold_passes_the_given_share_of_impostors(refined):
    """By their sums in coarse alignment, whatever they are when refined."""
    samples = [sample(1), sample(2)]
    for one in samples:
        one.features[one.genuine, 0, RIDGES] += 2.0  # so that ridges have a weight
        one.coarse[:, 0] -= 0.5
    model = fit_model(samples, parameters=FitParameters(refined=refined))
    assert model.standard[2, RIDGES] > 1.0
    sums = np.concatenate([coarse_sums(one, model)[~one.genuine] for one in samples])
    assert model.refine_threshold == pytest.approx(np.quantile(sums, 1 - refined), rel=1e-5)
    assert (sums > model.refine_threshold).mean() == pytest.approx(refined, abs=0.001)
    confident = (sums > model.confident_threshold).mean()
    assert confident == pytest.approx(FitParameters().confident, abs=0.001)


@pytest.mark.parametrize("loss", [0.0, 0.01, 0.1])
def test_thresholds_lose_no_more_genuine_pairs_than_allowed(loss):
    """Of those that pass coarse alignment; of the impostors they reject most."""
    one = sample(1, apart=8.0)
    model = fit_model([one], parameters=FitParameters(relaxation_loss=loss, prefilter_loss=loss))
    passing = one.genuine & (coarse_sums(one, model) > model.refine_threshold)
    weak = one.strength < model.relaxation_threshold * (1 - 1e-5)
    assert (weak & passing).sum() == pytest.approx(loss * passing.sum(), abs=1)
    assert weak[~one.genuine].mean() >= (weak & passing).sum() / passing.sum()
    assert loss < 0.1 or weak[~one.genuine].mean() > 0.8
    base, growth, limit = model.prefilter
    threshold = np.minimum(base + growth * one.descriptors[:, 1], limit)
    rejected = one.descriptors[:, 0] < threshold
    assert (rejected & passing).sum() <= loss * passing.sum()
    assert rejected[~one.genuine].mean() > 0.9


def test_the_prefilter_threshold_grows_with_the_print_where_that_rejects_more():
    one = sample(1, apart=8.0)
    scaled = one.descriptors.copy()
    scaled[:, 0] *= one.descriptors[:, 1] / 20
    model = fit_model([replace(one, descriptors=scaled)])
    assert fit_model([one]).prefilter[1] == 0.0 < model.prefilter[1]
    nothing = np.empty((0, 2))
    for both in ((nothing, one.descriptors), (one.descriptors, nothing)):
        assert _prefilter(*both, FitParameters()) == NO_PREFILTER


def test_of_several_hypotheses_that_of_the_greatest_sum_counts():
    """Of one that is worse nothing is learned; in coarse alignment, whatever its ridges are."""
    plain = sample(1, count=500)
    worse = plain.features - 50.0 * np.eye(N)[0]
    either = with_hypotheses(plain, worse, worse + 100.0 * OF_RIDGES, first=True)
    missing = with_hypotheses(plain, np.nan * worse, np.nan * worse)
    expected, again = fit_model([plain]), fit_model([missing])
    assert again.standard.tolist() == expected.standard.tolist()
    assert again.limits.tolist() == expected.limits.tolist()
    assert fit_model([either], parameters=FitParameters(turns=8)).standard[2, 0] > 0
    best = [best_hypotheses(o.features, expected.standard, expected.bias) for o in (either, plain)]
    assert best[0][1] == pytest.approx(best[1][1], rel=1e-12)


SHAPES = {
    "standard": (len(MODELS), len(STANDARD), len(FEATURES)),
    "limits": (len(MODELS), 7),
    "quantiles": (len(MODELS), len(RATES), len(AMOUNTS)),
}


def of_all(weights, name):
    """Return an array of all models in one."""
    return np.stack([getattr(model, name) for model in weights.models])


@given(*(arrays(np.float64, shape, elements=st.floats(-1e6, 1e6)) for shape in SHAPES.values()))
def test_weights_read_back_are_the_same(standard, limits, quantiles):
    models = (
        ScoreModel(rows, bias, (base, growth, most), relaxation, refine, confident, reached)
        for rows, (base, growth, most, relaxation, refine, confident, bias), reached in zip(
            standard, limits.tolist(), quantiles, strict=True
        )
    )
    weights = ScoreWeights(tuple(models), {"sets": ["one", "two"], "n": 3})
    again = ScoreWeights.from_json(as_json(weights))
    for name, given_ in (("standard", standard), ("limits", limits), ("quantiles", quantiles)):
        for one in (weights, again):
            found = of_all(one, name)  # as the kernel takes them
            assert (found.shape, found.dtype) == (SHAPES[name], np.float64)
            assert found.flags.c_contiguous
            assert found.tolist() == given_.tolist()
    for model, other in zip(again.models, weights.models, strict=True):
        assert model.limits.tolist() == other.limits.tolist()
    assert again.provenance == weights.provenance
    assert as_json(again) == as_json(weights)


def test_the_weights_of_the_package_are_as_they_were_written():
    weights = load_weights()
    text = WEIGHTS_FILE.read_text(encoding="utf-8")
    assert as_json(weights) == text  # which holds names and order of the features
    standard = of_all(weights, "standard")
    assert np.isfinite(standard).all()
    assert np.isfinite(of_all(weights, "limits")).all()
    assert (standard[:, 1] > 0).all()
    assert all(model.confident_threshold > model.refine_threshold for model in weights.models)
    assert not standard[1, 2, OF_RIDGES].any()
