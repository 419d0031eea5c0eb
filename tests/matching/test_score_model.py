import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from matching_weights import OF_RIDGES, REJECTING, some_weights

from fpmatch.errors import MatcherError
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

SHAPES = {
    "standard": (len(MODELS), len(STANDARD), len(FEATURES)),
    "limits": (len(MODELS), 7),
    "quantiles": (len(MODELS), len(RATES), len(AMOUNTS)),
}


def some_json():
    return some_weights(-1.25, prefilter=REJECTING, confident=7.5, relaxation=0.375).as_json()


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
    again = ScoreWeights.from_json(weights.as_json())
    for name, given_ in (("standard", standard), ("limits", limits), ("quantiles", quantiles)):
        for one in (weights, again):
            found = of_all(one, name)  # as the kernel takes them
            assert (found.shape, found.dtype) == (SHAPES[name], np.float64)
            assert found.flags.c_contiguous
            assert found.tolist() == given_.tolist()
    for model, other in zip(again.models, weights.models, strict=True):
        assert model.limits.tolist() == other.limits.tolist()
    assert again.provenance == weights.provenance
    assert again.as_json() == weights.as_json()


def test_the_weights_of_the_package_are_as_they_were_written():
    weights = load_weights()
    assert weights.as_json() == WEIGHTS_FILE.read_text(encoding="utf-8")
    standard = of_all(weights, "standard")
    assert np.isfinite(standard).all()
    assert np.isfinite(of_all(weights, "limits")).all()
    assert (standard[:, 1] > 0).all()
    assert all(model.confident_threshold > model.refine_threshold for model in weights.models)
    weight = standard[:, 2]
    assert (weight[:, FEATURES.index("unpaired")] < 0).all()
    assert (weight[:, FEATURES.index("relaxed similarity")] > 0).all()
    assert weight[0, FEATURES.index("ridges")] > 0
    assert not weight[1, OF_RIDGES].any()
    assert weight[0, OF_RIDGES[-1]] == 0.0 < weight[2, OF_RIDGES[-1]]


@pytest.mark.parametrize(
    "text",
    [
        *("", "[]", "{}", "3", '{"models": {}}'),
        *(
            some_json().replace(f'"{name}"', '"other"', 1)
            for name in (*MODELS, *FEATURES, "standard", "bias", "models", "features", "provenance")
        ),
        some_json().replace(f'"{FEATURES[0]}",', ""),
        *(some_json().replace("-1.25", value) for value in ('"shut"', "{}", "[]")),
    ],
)
def test_text_that_is_no_weights_is_refused(text):
    with pytest.raises(MatcherError, match="weights of the score"):
        ScoreWeights.from_json(text)
