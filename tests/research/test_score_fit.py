"""The fit of the score's weights, on samples drawn from known distributions."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fpmatch.evaluation.dataset import Dataset, Impression
from fpmatch.evaluation.extraction import ExtractedSet, Extraction
from fpmatch.matching.align import AlignmentParameters
from fpmatch.matching.bit_descriptors import descriptor_similarity
from fpmatch.matching.compare import align
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.ridges import RidgeSearchParameters
from fpmatch.matching.score import evidence_scorer
from fpmatch.matching.score_model import (
    FEATURES,
    MODELS,
    NO_PREFILTER,
    NO_QUANTILES,
    ScoreModel,
    ScoreWeights,
)
from fpmatch.minutiae import Minutiae, RidgeField, Template
from research.training.score_fit import (
    OF_RIDGES,
    FitParameters,
    _prefilter,
    fit_model,
    fit_weights,
)
from research.training.score_rates import rates_of
from research.training.score_samples import (
    SampleParameters,
    ScoreSample,
    sample_of,
    samples_of,
)

N = len(FEATURES)
RIDGES = FEATURES.index("ridges")
HYPOTHESES = AlignmentParameters().hypotheses + RidgeSearchParameters().found
EVEN = FitParameters(impostor_weight=1.0, lost_share=0.0, ridge=1e-9)


def sample(
    seed: int, count: int = 4000, apart: float = 2.0, lost: int = 0, ridges: bool = True
) -> ScoreSample:
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
    return ScoreSample(
        f"set {seed}", x[:, None], x[:, None].copy(), scores * 1.0, strength, genuine, (0, 0)
    )


def raw_weights(samples: list[ScoreSample], parameters: FitParameters) -> np.ndarray:
    """Return the weights of features as they are, and the bias last."""
    model = fit_model(samples, parameters=parameters)
    middle, spread, weight, _ = model.standard
    slope = weight / spread
    return np.append(slope, model.bias - slope @ middle)


@pytest.mark.parametrize(("impostor_weight", "tolerance"), [(1.0, 0.15), (100.0, 0.3)])
def test_the_weights_are_those_of_the_likelihood_ratio(
    impostor_weight: float, tolerance: float
) -> None:
    """Of two normal distributions of unit spread it is d·x - d²/2, whatever impostors weigh."""
    found = raw_weights([sample(1), sample(2)], replace(EVEN, impostor_weight=impostor_weight))
    assert found == pytest.approx([2.0, *[0.0] * (N - 1), -2.0], abs=tolerance)


def test_lost_comparisons_do_not_pull_the_fit_where_they_are_allowed_for() -> None:
    samples = [sample(k, lost=400) for k in (1, 2)]
    pulled = raw_weights(samples, EVEN)
    kept = raw_weights(samples, replace(EVEN, lost_share=0.09))
    assert pulled[0] < 1.8 < kept[0] < 2.2


def test_features_left_out_have_no_weight() -> None:
    model = fit_model([sample(1)], without=(FEATURES[0], FEATURES[3]))
    left_out = np.isin(np.arange(N), [0, 3])
    assert not model.standard[2, left_out].any()
    assert (model.standard[2, ~left_out] != 0).all()


def test_the_same_samples_give_the_same_weights() -> None:
    samples, alone = [sample(1), sample(2)], [sample(1, ridges=False), sample(2, ridges=False)]
    first, second = (fit_weights(samples, alone, [sample(3)]) for _ in range(2))
    assert first.as_json() == second.as_json()


def test_rates_are_those_of_the_weighted_sums() -> None:
    samples = [sample(3, apart=10.0), replace(sample(4, apart=10.0), nothing=(1000, 0))]
    rates = rates_of(samples, [fit_model(samples)] * 2)
    assert rates["sets"]["set 3"] == {"eer": 0.0, "fmr1000": 0.0}
    # a fifth of the genuine comparisons found nothing
    assert rates["sets"]["set 4"]["fmr1000"] == pytest.approx(20.0)
    assert rates["pooled"]["fmr1000"] == pytest.approx(100 * 1000 / 9000, abs=0.01)


def test_rates_count_what_was_found_by_the_ridges_alone() -> None:
    """Where no local match led to an alignment, and whatever the refine threshold is."""
    plain = sample(3, count=2000, apart=10.0)
    model = replace(fit_model([plain]), refine_threshold=1e9)
    first = AlignmentParameters().hypotheses
    nothing = np.full((len(plain.features), first, N), np.nan)
    by_ridges = replace(
        plain, features=np.concatenate([nothing, plain.features], axis=1), coarse=nothing
    )
    assert rates_of([by_ridges], [model])["mean"] == {"eer": 0.0, "fmr1000": 0.0}
    lost = by_ridges.features.copy()
    lost[-200:] = np.nan  # a tenth of the genuine ones
    rates = rates_of([replace(by_ridges, features=lost)], [model])

    assert rates["mean"]["fmr1000"] == pytest.approx(10.0)


def test_impostor_means_are_the_means_of_impostors() -> None:
    """Every database counts as much, however many its comparisons."""
    small, large = sample(1, count=200), sample(2, count=4000)
    small.features[~small.genuine] += 3.0
    middle, _, _, impostor_mean = fit_model([small, large]).standard
    means = [one.features[~one.genuine, 0].mean(axis=0) for one in (small, large)]
    assert impostor_mean == pytest.approx((means[0] + means[1]) / 2, rel=1e-5)
    genuine = [one.features[one.genuine, 0].mean(axis=0) for one in (small, large)]
    assert middle == pytest.approx((impostor_mean + (genuine[0] + genuine[1]) / 2) / 2, rel=1e-4)


def coarse_sums(one: ScoreSample, model: ScoreModel) -> np.ndarray:
    """Return the sums in coarse alignment, where ridges count as those of impostors."""
    middle, spread, weight, impostor_mean = model.standard
    x = one.coarse[:, 0].copy()
    x[:, OF_RIDGES] = impostor_mean[OF_RIDGES]
    return np.asarray(model.bias + (x - middle) / spread @ weight)


@pytest.mark.parametrize("refined", [0.01, 0.06, 0.25, 1.0])
def test_the_refine_threshold_passes_the_given_share_of_impostors(refined: float) -> None:
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
def test_weak_local_matches_lose_no_more_genuine_pairs_than_allowed(loss: float) -> None:
    """Of those that pass coarse alignment; of the impostors most have weak local matches."""
    one = sample(1, apart=8.0)
    model = fit_model([one], parameters=FitParameters(relaxation_loss=loss))
    weak = one.strength < model.relaxation_threshold * (1 - 1e-5)
    passing = one.genuine & (coarse_sums(one, model) > model.refine_threshold)
    assert (weak & passing).sum() == pytest.approx(loss * passing.sum(), abs=1)
    assert weak[~one.genuine].mean() >= (weak & passing).sum() / passing.sum()
    assert loss < 0.1 or weak[~one.genuine].mean() > 0.8


@pytest.mark.parametrize("loss", [0.0, 0.01, 0.1])
def test_the_prefilter_rejects_no_more_genuine_pairs_than_allowed(loss: float) -> None:
    one = sample(1, apart=8.0)
    model = fit_model([one], parameters=FitParameters(prefilter_loss=loss))
    base, growth, limit = model.prefilter
    threshold = np.minimum(base + growth * one.descriptors[:, 1], limit)
    rejected = one.descriptors[:, 0] < threshold
    passing = one.genuine & (coarse_sums(one, model) > model.refine_threshold)
    assert (rejected & passing).sum() <= loss * passing.sum()
    assert rejected[~one.genuine].mean() > 0.9


def test_the_prefilter_threshold_grows_with_the_print_where_that_rejects_more() -> None:
    one = sample(1, apart=8.0)
    scaled = one.descriptors.copy()
    scaled[:, 0] *= one.descriptors[:, 1] / 20
    model = fit_model([replace(one, descriptors=scaled)])
    assert fit_model([one]).prefilter[1] == 0.0 < model.prefilter[1]


def test_without_impostors_nothing_is_rejected() -> None:
    parameters = FitParameters()
    nothing = np.empty((0, 2))
    assert _prefilter(nothing, sample(1).descriptors, parameters) == NO_PREFILTER
    assert _prefilter(sample(1).descriptors, nothing, parameters) == NO_PREFILTER


def test_the_provenance_is_that_of_the_samples_with_ridges() -> None:
    samples = [sample(1, count=300), sample(2, count=200, lost=50)]
    alone = [sample(1, count=100, ridges=False)]
    weights = fit_weights(samples, alone, [sample(3)], command="make weights")
    found = weights.provenance
    assert found["sets"] == ["set 1", "set 2"]
    assert (found["genuine"], found["impostors"]) == (550, 500)
    assert found["command"] == "make weights"
    assert ScoreWeights.from_json(weights.as_json()).standard.shape == (len(MODELS), 4, N)


def test_the_model_of_minutiae_alone_gives_ridges_no_weight() -> None:
    samples, alone = [sample(1)], [sample(1, ridges=False)]
    first, second, third, small = fit_weights(samples, alone, [sample(3)]).models
    assert third is second
    assert (first.standard[2, OF_RIDGES] != 0).tolist() == [True, True, False]
    assert (small.standard[2, OF_RIDGES] != 0).all()
    assert not second.standard[2, OF_RIDGES].any()
    assert second.standard[1, OF_RIDGES].tolist() == [1.0, 1.0, 1.0]
    assert (second.standard[2, ~OF_RIDGES] != 0).all()


def two_fingers(folder: Path, impressions: int = 2) -> ExtractedSet:
    """Return impressions of two fingers with ridges."""
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
    dataset = Dataset("two", 500.0, "", tuple(taken))
    return ExtractedSet(dataset, tuple(extractions))


@pytest.mark.parametrize(("every", "taken"), [(1, 9), (2, 4), (4, 2), (9, 1), (10, 0)])
def test_of_so_many_impostors_one_is_taken(tmp_path: Path, every: int, taken: int) -> None:
    """And of the genuine comparisons all."""
    parameters = SampleParameters(every_impostor=every)
    found = sample_of(two_fingers(tmp_path, 3), parameters)
    assert found.genuine.sum() + found.nothing[0] == 6
    assert (~found.genuine).sum() + found.nothing[1] == taken
    assert found.features.shape == (len(found.genuine), HYPOTHESES, N)


def test_windows_are_compared_with_whole_prints(tmp_path: Path) -> None:
    """The same windows each time; where one shows less, it is scored by what it shows."""
    extracted = two_fingers(tmp_path, 3)
    parameters = SampleParameters(every_impostor=1, every_window_impostor=3, windows_px=(96, 140))
    whole, alone, windows = samples_of([extracted], parameters, workers=1)
    assert [len(part) for part in (whole, alone, windows)] == [1, 1, 2]
    for one in windows:
        assert one.genuine.sum() + one.nothing[0] == 6
        assert (~one.genuine).sum() + one.nothing[1] == 3
        assert (one.descriptors[:, 1] < 9).any()
    again = sample_of(extracted, parameters, window_px=96)
    np.testing.assert_array_equal(again.features, windows[0].features)


def test_small_prints_are_looked_for_by_their_ridges_as_well(tmp_path: Path) -> None:
    """So that they have more hypotheses than the local matches give."""
    extracted = two_fingers(tmp_path, 3)
    parameters = SampleParameters(every_impostor=1, every_window_impostor=1)
    of_ridges = slice(AlignmentParameters().hypotheses, None)
    small = sample_of(extracted, parameters, window_px=140).features[:, of_ridges, 0]
    assert not np.isnan(small).all()
    large = sample_of(extracted, parameters).features[:, of_ridges, 0]
    assert np.isnan(large[:, 1:]).all()  # by the best of the candidates at most


@pytest.mark.parametrize("template", [None, Template(Minutiae.empty(), 99, 99)])
def test_prints_without_minutiae_have_no_features(
    tmp_path: Path, template: Template | None
) -> None:
    dataset = two_fingers(tmp_path).dataset
    found = sample_of(
        ExtractedSet(dataset, (Extraction(template, "", 0.0),) * 4),
        SampleParameters(every_impostor=1),
    )
    assert found.features.shape == (0, HYPOTHESES, N)
    assert found.nothing == (2, 4)


def test_ridges_are_compared_whatever_the_minutiae_say(tmp_path: Path) -> None:
    """Else nothing could be learned of them."""
    extracted = two_fingers(tmp_path, 3)
    found = sample_of(extracted)
    ridges, area = (FEATURES.index(name) for name in ("ridges", "area of the ridges"))
    tried = found.features[~np.isnan(found.features[..., 0])]
    assert len(tried) >= len(found.features)
    assert (tried[:, ridges] > -1.0).all()
    assert (tried[:, area] > np.log(10)).all()
    assert not found.coarse[~np.isnan(found.coarse[..., 0])][:, OF_RIDGES].any()


def test_without_ridges_none_are_compared(tmp_path: Path) -> None:
    """The print area is then the hull of the minutiae, as of a template without a field."""
    extracted = two_fingers(tmp_path, 3)
    found = sample_of(extracted, SampleParameters(every_impostor=1), ridges=False)
    bare = ExtractedSet(
        extracted.dataset,
        tuple(
            Extraction(replace(one.template, field=None), "", 0.0)
            for one in extracted.extractions
            if one.template is not None
        ),
    )
    same = sample_of(bare, SampleParameters(every_impostor=1))
    np.testing.assert_array_equal(found.features, same.features)
    tried = found.features[~np.isnan(found.features[..., 0])]
    assert not tried[:, OF_RIDGES].any()
    shown = sample_of(extracted, SampleParameters(every_impostor=1))
    assert shown.features[0, 0].tolist() != found.features[0, 0].tolist()


def some_weights(refine: float) -> ScoreWeights:
    """Return weights of two different models that reject nothing."""
    standard = np.stack([np.zeros(N), np.ones(N), np.arange(N) + 1.0, np.zeros(N)])
    alone = standard.copy()
    alone[2] = np.where(OF_RIDGES, 0.0, 2.0 - np.arange(N))
    first, second = (
        ScoreModel(one, 2.0, NO_PREFILTER, -1.0, refine, np.inf, np.array(NO_QUANTILES))
        for one in (standard, alone)
    )
    return ScoreWeights((first, second, second), {})


@pytest.mark.parametrize("ridges", [True, False])
@pytest.mark.parametrize("refine", [-np.inf, np.inf])
def test_features_are_those_that_the_matcher_weighs(
    tmp_path: Path, ridges: bool, refine: float
) -> None:
    """Refined ones where all pass the refine threshold, those in coarse alignment where none do.

    What is found by the ridges is compared in either case.
    """
    extracted = two_fingers(tmp_path, 3)
    found = sample_of(extracted, SampleParameters(every_impostor=1), ridges=ridges)
    weights = some_weights(refine)
    model = weights.models[0 if ridges else 1]
    templates = [one.template for one in extracted.extractions if one.template is not None]
    prints = [MATCHER.prepare(t if ridges else replace(t, field=None)) for t in templates]
    totals = []
    for i, probe in enumerate(prints):
        for other in prints[i + 1 :]:
            a, b = sorted((probe, other), key=lambda side: side.key)
            aligned = align(a, b, evidence_scorer(len(b), weights))
            totals += [aligned[1].total] if aligned else []
    assert len(totals) > 6
    weight = model.standard[2]
    features = np.where(OF_RIDGES, 0.0, found.coarse) if refine == np.inf else found.features
    by_ridges = found.features[:, AlignmentParameters().hypotheses :]
    sums = 2.0 + np.concatenate([features, by_ridges], axis=1) @ weight
    assert sorted(np.nanmax(sums, axis=1)) == pytest.approx(sorted(totals))


def test_descriptors_and_strength_are_those_of_the_prints(tmp_path: Path) -> None:
    extracted = two_fingers(tmp_path, 3)
    found = sample_of(extracted, SampleParameters(every_impostor=1))
    prints = [MATCHER.prepare(one.template) for one in extracted.extractions if one.template]
    expected = []
    for i, probe in enumerate(prints):
        for other in prints[i + 1 :]:
            a, b = sorted((probe, other), key=lambda side: side.key)
            expected.append(
                [descriptor_similarity(a.bit_descriptors, b.bit_descriptors), min(len(a), len(b))]
            )
    assert sum(found.nothing) == 0
    assert sorted(found.descriptors.tolist()) == sorted(expected)
    assert (found.strength >= 0).all()
    assert found.strength[found.genuine].mean() > found.strength[~found.genuine].mean()


def test_of_several_hypotheses_that_of_the_greatest_sum_counts() -> None:
    """Of one that is worse nothing is learned; in coarse alignment, whatever its ridges are."""
    plain = sample(1, count=500)
    worse = plain.features - 50.0 * np.eye(N)[0]
    coarse = worse + 100.0 * OF_RIDGES
    either, missing = (
        replace(
            plain,
            features=np.concatenate(order(plain.features, worse), axis=1),
            coarse=np.concatenate(order(plain.coarse, coarse), axis=1),
        )
        for order in (
            lambda rows, others: (others, rows),
            lambda rows, others: (rows, np.nan * others),
        )
    )
    expected = fit_model([plain])
    again = fit_model([missing])
    assert again.standard.tolist() == expected.standard.tolist()
    assert again.limits.tolist() == expected.limits.tolist()
    found = fit_model([either], parameters=FitParameters(turns=8))
    assert found.standard[2, 0] > 0
    assert rates_of([either], [expected]) == rates_of([plain], [expected])


def test_ridges_have_a_say_in_which_refined_hypothesis_counts() -> None:
    """Not so in coarse alignment, where they are not compared."""
    plain = sample(1, count=500)
    model = fit_model([plain])
    gain = 1e3 * np.sign(model.standard[2, RIDGES]) * (np.arange(N) == RIDGES)
    better = np.where(plain.genuine[:, None, None], plain.features + gain, np.nan)
    either = replace(
        plain,
        features=np.concatenate([plain.features, better], axis=1),
        coarse=np.concatenate([plain.coarse, plain.coarse + gain], axis=1),
    )
    all_pass, none_passes = (
        replace(model, refine_threshold=threshold) for threshold in (-np.inf, np.inf)
    )
    assert rates_of([plain], [all_pass])["mean"]["eer"] > 5.0
    assert rates_of([either], [all_pass])["mean"]["eer"] == 0.0
    assert rates_of([either], [none_passes]) == rates_of([plain], [none_passes])
