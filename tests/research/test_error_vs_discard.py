import json
from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import DatasetError
from fpmatch.lab.evaluation.rates.error_vs_discard import QualitySample, discard_curve, pool
from research.experiments.error_vs_discard import curves_as_json, discard_tables


def made(seed, prints=20, *, predictive):
    """Return prints whose worst ones match nothing, and qualities that predict this, or do not."""
    rng = np.random.default_rng(seed)
    quality = rng.permutation(np.arange(prints) * 5)
    pairs = np.column_stack(np.triu_indices(prints, 1))
    worst = quality < 10
    genuine = np.where(worst[pairs].any(axis=1), 0.0, 9.0)
    given = quality if predictive else rng.permutation(quality)
    impostor = rng.uniform(0, 5, 2000)
    return QualitySample("made", given, pairs, genuine, impostor, Counter(partial=2))


def test_discarding_the_worst_ends_all_errors_if_quality_predicts_them():
    curve = discard_curve(made(1, predictive=True), shares=(0, 0.05, 0.1))
    assert curve.lost[0] > curve.lost[1] > curve.lost[2] == 0
    assert curve.below == (0, 5, 10)
    assert curve.genuine == (190, 171, 153)
    assert discard_curve(made(1, predictive=False)).fnmr[2] > 0


@given(st.integers(0, 1000), st.integers(2, 12))
def test_less_is_left_the_more_is_discarded(seed, prints):
    curve = discard_curve(made(seed, prints, predictive=False), shares=(0, 0.2, 0.5, 0.9, 1))
    assert list(curve.genuine) == sorted(curve.genuine, reverse=True)
    assert list(curve.lost) == sorted(curve.lost, reverse=True)
    assert curve.genuine[-1] == 0
    assert curve.fnmr[-1] == 0


def test_pooling_keeps_pairs_with_their_prints():
    both = pool([made(1, predictive=True), made(2, 10, predictive=True)])
    assert both.reasons == {"partial": 4}
    assert both.pairs[:190].max() == 19
    assert (both.pairs[190:].min(), both.pairs[190:].max()) == (20, 29)


def test_too_few_impostors_are_refused():
    with pytest.raises(DatasetError, match="made: too few impostor pairs for an FMR of 1e-06"):
        discard_curve(made(1, predictive=True), fmr=1e-6)


def test_one_database_needs_no_pooled_row():
    document = curves_as_json([made(1, predictive=True)])
    assert [row["name"] for row in document["sets"]] == ["made"]
    assert "made" in discard_tables(json.loads(json.dumps(document)))
