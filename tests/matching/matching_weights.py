"""Weights of the score made by hand, and prints for interpreted kernels, for tests of matching."""

import math
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from fpmatch.matching import reference
from fpmatch.matching.pipeline import evidence as score
from fpmatch.matching.pipeline.evidence import (
    AMOUNTS,
    FEATURES,
    MODELS,
    RIDGE_FEATURES,
    ScoreModel,
    ScoreWeights,
)

ALWAYS = -math.inf
NEVER = math.inf
"""Refine thresholds which every alignment passes, or none."""

NO_PREFILTER = (-1.0, 0.0, -1.0)
"""A prefilter threshold that all prints pass."""

NO_QUANTILES = ((0.0,) * len(AMOUNTS), (1.0, *(0.0,) * (len(AMOUNTS) - 1)))
"""Quantiles that do not depend on the amount of evidence."""

REJECTING = (9.0, 1.0, 33.0)
"""A prefilter threshold that many prints pass, and many do not."""

OF_RIDGES = [FEATURES.index(name) for name in RIDGE_FEATURES]

MIDDLE = (-1.7, 0.85, 0.7, 0.7, 1.2, 0.65, 0.7, 0.35, 0.4, 4.9, 2.5)
SPREAD = (2.3, 0.07, 0.1, 0.15, 0.9, 0.5, 0.2, 0.2, 0.15, 0.45, 2.0)
WEIGHT = (3.0, 0.6, 0.8, 0.1, 0.5, -4.7, 1.0, 0.9, 4.0, 0.9, 0.8)
QUANTILES = np.array([[-4.0, 60.0, -120.0, -2.5, -9.0], [-1.5, 60.0, -80.0, -2.9, -11.0]])
"""Under which little evidence must come to a greater sum."""

IMPOSTOR_MEAN = (-3.7, 0.82, 0.63, 0.6, 0.45, 1.1, 0.6, 0.15, 0.27, 4.8, 0.8)


def some_model(
    refine=ALWAYS,
    bias=0.4,
    prefilter=NO_PREFILTER,
    confident=math.inf,
    relaxation=-1.0,
    *,
    ridges=True,
):
    """Return a model under which unpaired minutiae lower the sum."""
    standard = np.array([MIDDLE, SPREAD, WEIGHT, IMPOSTOR_MEAN])
    if not ridges:
        standard[:, OF_RIDGES] = [[0.0], [1.0], [0.0], [0.0]]
        standard[2] *= 1.25
    return ScoreModel(standard, bias, prefilter, relaxation, refine, confident, QUANTILES)


def some_weights(
    refine=ALWAYS,
    bias=0.4,
    prefilter=NO_PREFILTER,
    confident=math.inf,
    relaxation=-1.0,
    *,
    apart=0.0,
):
    """Return the same thresholds for all models; the bias of each is `apart` less."""
    limits = prefilter, confident, relaxation
    models = (
        some_model(refine, bias - k * apart, *limits, ridges=k in {0, 2})
        for k in range(len(MODELS))
    )
    return ScoreWeights(tuple(models), {"by": "hand"})


def all_with(weights, **changes):
    """Return weights of which all models are changed alike."""
    return replace(weights, models=tuple(replace(model, **changes) for model in weights.models))


@contextmanager
def scored_by(weights):
    """Replace the weights of the package by these, also where the reference takes them."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (score, reference, reference.evidence):
            patch.setattr(module, "load_weights", lambda: weights)
        yield
