"""The fit of the score's weights, on samples drawn from distributions that are known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fpmatch.evaluation.dataset import Dataset, Impression
from fpmatch.evaluation.extraction import ExtractedSet, Extraction
from fpmatch.evaluation.score_fit import (
    OF_RIDGES,
    FitParameters,
    ScoreSample,
    _glance,
    fit_weights,
    rates_of,
    sample_of,
)
from fpmatch.matching.align import AlignmentParameters
from fpmatch.matching.matchers.unit_circle import MATCHER, lay
from fpmatch.matching.score import FEATURES, NO_GLANCE, ScoreWeights, scales
from fpmatch.minutiae import Minutiae, RidgeField, Template

N = len(FEATURES)
WAYS = AlignmentParameters().candidates
EVEN = FitParameters(impostor_weight=1.0, lost_share=0.0, ridge=1e-9)


def sample(seed: int, count: int = 4000, apart: float = 2.0, lost: int = 0) -> ScoreSample:
    """Return features of unit spread whose kinds lie `apart` in the first; the rest are noise.

    There is but one way to lay two prints on one another.
    """
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(2 * count + lost, N))
    genuine = np.arange(2 * count + lost) >= count
    x[count : 2 * count, 0] += apart
    codes = np.stack([rng.poisson(np.where(genuine, 40, 8)), rng.integers(10, 50, len(x))], axis=1)
    return ScoreSample(f"set {seed}", x[:, None], x[:, None], codes * 1.0, genuine, (0, 0))


def raw_weights(samples: list[ScoreSample], parameters: FitParameters) -> np.ndarray:
    """Return the weights of features as they are, and the bias last."""
    weights = fit_weights(samples, parameters=parameters)
    middle, spread, weight, _ = weights.standard
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


def impostors_of(samples: list[ScoreSample]) -> np.ndarray:
    return np.concatenate([one.features[~one.genuine, 0] for one in samples])


def test_strangers_are_the_means_of_impostors() -> None:
    """Every database counts as much, however many its comparisons."""
    small, large = sample(1, count=200), sample(2, count=4000)
    small.features[~small.genuine] += 3.0
    middle, _, _, stranger = fit_weights([small, large]).standard
    means = [one.features[~one.genuine, 0].mean(axis=0) for one in (small, large)]
    assert stranger == pytest.approx((means[0] + means[1]) / 2, rel=1e-5)
    genuine = [one.features[one.genuine, 0].mean(axis=0) for one in (small, large)]
    assert middle == pytest.approx((stranger + (genuine[0] + genuine[1]) / 2) / 2, rel=1e-4)


@pytest.mark.parametrize("looked_at", [0.01, 0.06, 0.2, 1.0])
def test_the_gate_lets_through_the_asked_share_of_strangers(looked_at: float) -> None:
    """By the sums that they have while their ridges count as those of strangers."""
    samples = [sample(1), sample(2)]
    for one in samples:
        one.features[one.genuine, 0, 4] += 2.0  # so that ridges have a weight
    weights = fit_weights(samples, parameters=FitParameters(looked_at=looked_at))
    middle, spread, weight, stranger = weights.standard
    assert weight[4] > 1.0
    unseen = impostors_of(samples)
    unseen[:, 4:] = stranger[4:]
    sums = weights.bias + (unseen - middle) / spread @ weight
    assert weights.gate == pytest.approx(np.quantile(sums, 1 - looked_at), rel=1e-5)
    assert (sums > weights.gate).mean() == pytest.approx(looked_at, abs=0.001)
    seen = weights.bias + (impostors_of(samples) - middle) / spread @ weight
    assert looked_at > 0.1 or (seen > weights.gate).mean() > looked_at + 0.001


def first_sums(one: ScoreSample, weights: ScoreWeights) -> np.ndarray:
    """Return the sums of a first look, where ridges count as those of strangers."""
    middle, spread, weight, stranger = weights.standard
    unseen = one.first[:, 0].copy()
    unseen[:, 4:] = stranger[4:]
    return np.asarray(weights.bias + (unseen - middle) / spread @ weight)


def test_so_few_impostors_leave_no_doubt_at_the_first_look() -> None:
    one = sample(1)
    weights = fit_weights([one], parameters=FitParameters(unsure=0.02))
    sure = first_sums(one, weights)[~one.genuine] > weights.sure
    assert sure.mean() == pytest.approx(0.02, abs=0.001)


@pytest.mark.parametrize("dismissed", [0.0, 0.01, 0.1])
def test_codes_dismiss_no_more_genuine_pairs_than_allowed(dismissed: float) -> None:
    one = sample(1, apart=8.0)
    weights = fit_weights([one], parameters=FitParameters(dismissed=dismissed))
    base, growth, most = weights.glance
    lacking = one.codes[:, 0] < np.minimum(base + growth * one.codes[:, 1], most)
    passing = one.genuine & (first_sums(one, weights) > weights.gate)
    assert (lacking & passing).sum() <= dismissed * passing.sum()
    assert lacking[~one.genuine].mean() > 0.9


def test_what_codes_must_say_grows_with_the_print_where_that_tells_more() -> None:
    one = sample(1, apart=8.0)
    scaled = one.codes * [1.0, 1.0]
    scaled[:, 0] *= one.codes[:, 1] / 20
    weights = fit_weights([replace(one, codes=scaled)])
    assert fit_weights([one]).glance[1] == 0.0 < weights.glance[1]


def test_without_impostors_nothing_is_dismissed() -> None:
    parameters = FitParameters()
    nothing = np.empty((0, 2))
    assert _glance(nothing, sample(1).codes, parameters) == NO_GLANCE
    assert _glance(sample(1).codes, nothing, parameters) == NO_GLANCE


def test_weights_tell_from_what_they_were_learned() -> None:
    samples = [sample(1, count=300), sample(2, count=200, lost=50)]
    found = fit_weights(samples, command="make weights").provenance
    assert found["sets"] == ["set 1", "set 2"]
    assert (found["genuine"], found["impostors"]) == (550, 500)
    assert found["command"] == "make weights"
    assert ScoreWeights.from_json(fit_weights(samples).as_json()).standard.shape == (4, N)


def two_fingers(folder: Path, impressions: int = 2, lost: bool = True) -> ExtractedSet:
    """Return impressions of two fingers that show their ridges, the last perhaps without any."""
    rng = np.random.default_rng(5)
    pictures = rng.integers(0, 2**63, (12, 12), np.uint64)
    shape = pictures.shape
    field = RidgeField(16.0, np.zeros(shape, np.float32), np.ones(shape, bool), pictures)
    taken, extractions = [], []
    for finger in (1, 2):
        x, y, angle = rng.uniform(20, 180, (3, 9))
        for number in range(1, impressions + 1):
            taken.append(Impression(finger, number, folder / f"{finger}_{number}.tif"))
            template = Template(Minutiae(x + number, y, angle), 192, 192, field=field)
            extractions.append(Extraction(template, "", 0.0))
    if lost:
        extractions[-1] = Extraction(None, "no ridges", 0.0)
    dataset = Dataset("two", 500.0, "", tuple(taken))
    return ExtractedSet(dataset, tuple(extractions))


def test_a_sample_is_all_comparisons_of_a_database(tmp_path: Path) -> None:
    every = FitParameters(every_impostor=1)
    found = sample_of(two_fingers(tmp_path), every)
    assert found.name == "two"
    assert found.features.shape == (len(found.genuine), WAYS, N)
    assert found.genuine.sum() + found.nothing[0] == 2
    assert (~found.genuine).sum() + found.nothing[1] == 4
    assert found.nothing[0] >= 1
    assert found.genuine.any()


@pytest.mark.parametrize(("every", "taken"), [(1, 9), (2, 4), (4, 2), (9, 1), (10, 0)])
def test_of_so_many_impostors_one_is_taken(tmp_path: Path, every: int, taken: int) -> None:
    """And of the genuine comparisons all."""
    parameters = FitParameters(every_impostor=every)
    found = sample_of(two_fingers(tmp_path, 3, lost=False), parameters)
    assert found.genuine.sum() + found.nothing[0] == 6
    assert (~found.genuine).sum() + found.nothing[1] == taken
    assert found.features.shape == (len(found.genuine), WAYS, N)


def test_a_sample_of_nothing_has_no_features(tmp_path: Path) -> None:
    nothing = ExtractedSet(two_fingers(tmp_path).dataset, (Extraction(None, "no ridges", 0.0),) * 4)
    found = sample_of(nothing, FitParameters(every_impostor=1))
    assert found.features.shape == (0, WAYS, N)
    assert found.nothing == (2, 4)


def test_prints_of_too_few_minutiae_are_like_nothing(tmp_path: Path) -> None:
    bare = Extraction(Template(Minutiae([9.0, 30.0], [9.0, 40.0], [0.0, 1.0]), 99, 99), "", 0.0)
    few = ExtractedSet(two_fingers(tmp_path).dataset, (bare,) * 4)
    assert sample_of(few, FitParameters(every_impostor=1)).nothing == (2, 4)


def test_ridges_are_looked_at_whatever_the_minutiae_say(tmp_path: Path) -> None:
    """Else nothing could be learned of them."""
    extracted = two_fingers(tmp_path, 3, lost=False)
    found = sample_of(extracted)
    ridges, area = (FEATURES.index(name) for name in ("ridges", "area of the ridges"))
    first = found.features[:, 0]
    assert (first[:, ridges] > -1.0).all()
    assert (first[:, area] > np.log(10)).all()


def test_features_are_those_that_the_matcher_weighs(tmp_path: Path) -> None:
    """Under weights whose gate is open."""
    extracted = two_fingers(tmp_path, 3, lost=False)
    found = sample_of(extracted, FitParameters(every_impostor=1))
    standard = np.stack([np.zeros(N), np.ones(N), np.arange(N) + 1.0, np.zeros(N)])
    weights = ScoreWeights(standard, 2.0, NO_GLANCE, -np.inf, np.inf, {})
    prints = [MATCHER.prepare(one.template) for one in extracted.extractions if one.template]
    totals = []
    for i, probe in enumerate(prints):
        for other in prints[i + 1 :]:
            a, b = sorted((probe, other), key=lambda side: side.key)
            laid = lay(a, b, scales(len(b), weights))
            totals += [laid[1].total] if laid else []
    assert len(totals) > 6
    sums = 2.0 + found.features @ (np.arange(N) + 1.0)
    of_minutiae = np.where(np.isnan(sums), -np.inf, found.features[..., :4] @ np.arange(1.0, 5.0))
    chosen = sums[np.arange(len(sums)), of_minutiae.argmax(axis=1)]
    assert sorted(chosen) == pytest.approx(sorted(totals))


def test_of_several_ways_that_counts_for_which_the_minutiae_speak_the_most() -> None:
    """Of a second way that is a stranger's in all but its ridges nothing is learned."""
    plain = sample(1, count=500)
    strangers = plain.features - 50.0 * np.eye(N)[0]
    strangers[..., OF_RIDGES] += 100.0
    either = replace(plain, features=np.concatenate([strangers, plain.features], axis=1))
    missing = replace(plain, features=np.concatenate([plain.features, np.nan * strangers], axis=1))
    expected = fit_weights([plain])
    assert fit_weights([missing]).as_json() == expected.as_json()
    found = fit_weights([either], parameters=FitParameters(turns=8))
    assert found.standard[2, 0] > 0
    assert rates_of([either], [expected]) == rates_of([plain], [expected])


def test_below_the_gate_ridges_do_not_count() -> None:
    samples = [sample(1, count=500)]
    weights = fit_weights(samples)
    shut = replace(weights, gate=np.inf)
    told = replace(samples[0], features=samples[0].features.copy())
    told.features[told.genuine, 0, 4] += 1e5 * np.sign(weights.standard[2, 4])
    assert rates_of([told], [shut]) == rates_of(samples, [shut])
    assert rates_of([told], [replace(weights, gate=-np.inf)])["mean"]["eer"] == 0.0
