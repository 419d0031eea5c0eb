import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import fpmatch
from fpmatch.errors import DatasetError, MatcherError
from fpmatch.lab.cli.calibrate import calibration_text
from fpmatch.lab.evaluation import calibrate
from fpmatch.lab.evaluation.calibrate import (
    calibrate_on,
    fit_calibration,
    gather_impostors,
    report_calibration,
)
from fpmatch.lab.evaluation.rates.scores import Trials, split
from fpmatch.lab.evaluation.run import evaluate, evaluate_matchers
from fpmatch.matching.calibration import score_to_fmr


def test_fits_the_impostors_of_all_sets_without_failed_prints(options, make_database):
    folders = [make_database(name, fingers=10, contents={"3_3": "broken"}) for name in "ab"]
    report = evaluate(folders, **options)
    calibration = calibrate_on(report.impostors, report.matcher, "here")
    _, impostors = split(report.trials)
    expected = fit_calibration(impostors[impostors > 0])
    assert replace(calibration, provenance=expected.provenance) == expected
    origin = calibration.provenance
    assert (origin["sets"], origin["impostors"]) == (["a", "b"], 2 * (720 - 36))
    assert (origin["version"], origin["command"]) == (fpmatch.__version__, "here")
    assert (origin["matcher"], origin["fingers"]) == ("fake", 20)


def drawn(kind, n=20_000, seed=0):
    rng = np.random.default_rng(seed)
    return {
        "exponential": lambda: rng.exponential(0.1, n),
        "heavy": lambda: rng.pareto(4, n),
        "bounded": lambda: rng.beta(2, 8, n),
        "mostly zero": lambda: np.where(rng.random(n) < 0.7, 0.0, rng.exponential(1.0, n)),
        "counts": lambda: rng.poisson(3, n).astype(float),
        "close together": lambda: 1.0 + 1e-12 * rng.random(n) + (rng.random(n) < 0.02),
    }[kind]()


KINDS = ("exponential", "heavy", "bounded", "mostly zero", "counts")


@pytest.mark.parametrize("kind", KINDS)
def test_score_is_the_fmr_of_fitted_and_of_fresh_impostors(kind):
    s, fresh = drawn(kind), drawn(kind, 400_000, seed=1)
    calibration, ordered = fit_calibration(s), np.sort(s)
    for x in np.unique(np.quantile(s, [0.0, 0.1, 0.5, 0.9, 0.99, 0.998])):
        fmr = (s.size - np.searchsorted(ordered, x)) / s.size
        assert calibration.score(x) == pytest.approx(-10 * math.log10(fmr), abs=0.51)
    scores = calibration.scores(fresh)
    for score, most in ((10.0, 1.6), (20.0, 1.6), (30.0, 1.6), (40.0, 2.5)):
        assert np.mean(scores >= score) <= most * score_to_fmr(score)


def test_weighted_comparisons_count_by_their_weight():
    rng = np.random.default_rng(5)
    low, high = rng.exponential(0.1, 20_000), 1.0 + rng.exponential(0.1, 20_000)
    both, x = np.concatenate([low, high]), np.linspace(0, 1.5, 50)

    def fitted(*weights):
        return fit_calibration(both, np.repeat(weights, 20_000))

    assert fitted(0.99, 0.01).score(1.0) == pytest.approx(20.0, abs=0.1)
    assert fit_calibration(both).score(1.0) == pytest.approx(3.01, abs=0.51)
    twice = fit_calibration(np.concatenate([low, low, high]))
    assert fitted(2.0, 1.0).scores(x) == pytest.approx(twice.scores(x), abs=0.3)
    assert fitted(7.0, 7.0).scores(x) == pytest.approx(fit_calibration(both).scores(x), abs=1e-6)


def test_shape_of_the_tail():
    heavy = fit_calibration(np.random.default_rng(3).pareto(4, 100_000))
    assert heavy.tail_shape == pytest.approx(0.25, abs=0.15)
    assert fit_calibration(drawn("bounded")).tail_shape == calibrate.MIN_SHAPE


def test_jump_of_the_curve_stays_a_jump():
    # Half the impostors score 0, nobody else below 1: whatever reaches 1 is worth 3 dB.
    s = np.concatenate([np.zeros(5000), 1 + np.random.default_rng(0).exponential(1, 5000)])
    calibration = fit_calibration(s)
    assert calibration.knots[0] == (0.0, 0.0)
    assert calibration.knots[1] == (pytest.approx(1.0, abs=1e-3), pytest.approx(3.0103))


@given(st.lists(st.floats(0, 1e6), min_size=30, max_size=80), st.randoms())
def test_any_similarities_give_a_calibration_or_a_clear_refusal(similarities, random):
    similarities = [s if s >= 1e-290 else 0.0 for s in similarities]  # below, digits are lost
    with pytest.MonkeyPatch.context() as patch:
        for name, number in (("MIN_IMPOSTORS", 30), ("MIN_ABOVE", 3), ("MIN_TAIL", 10)):
            patch.setattr(calibrate, name, number)
        if max(similarities) == sorted(similarities)[-11]:
            with pytest.raises(MatcherError, match="all the same"):
                fit_calibration(similarities)
            return
        calibration = fit_calibration(similarities)
        random.shuffle(similarities)
        assert fit_calibration(similarities) == calibration
    ordered = calibration.scores(np.sort([*similarities, 1e9]))
    assert (np.diff(ordered) >= 0).all()
    assert ((ordered >= 0) & (ordered <= 100)).all()


@pytest.mark.parametrize(
    ("similarities", "reason"),
    [
        (np.zeros(999), "999 impostor comparisons are too few"),
        (np.zeros(5000), "all the same"),
        ([math.nan] * 2000, "must be finite"),
        ([], "0 impostor comparisons are too few"),
    ],
)
def test_unusable_impostors(similarities, reason):
    with pytest.raises(MatcherError, match=reason):
        fit_calibration(similarities)


@pytest.fixture
def gathering(bench):
    return {"matcher": bench.MATCHER, "extractor": bench.extractor, "workers": 1}


def test_scores_and_folders_give_the_same(gathering, report, tmp_path):
    scores = tmp_path / "scores.csv"
    folders = [row.source.dataset.impressions[0].path.parent for row in report.sets]
    how = {"workers": 1, "extractor": gathering["extractor"], "scores": scores}
    evaluate_matchers(folders, [gathering["matcher"]], **how)
    expected = report.impostors
    assert sum(one.similarity.size for one in expected) == 252 - 21 + 240
    for sources in (folders, [scores]):
        found = gather_impostors(sources, **gathering)
        assert [one.name for one in found] == ["set, one", "b"]
        for one, other in zip(found, expected, strict=True):
            assert not one.genuine.any()
            assert one.fingers == other.fingers
            np.testing.assert_array_equal(one.similarity, other.similarity)
    for sources, name in (([scores, scores], "set, one"), ([scores, folders[1]], "b")):
        with pytest.raises(DatasetError, match=f"{name}: this database is given twice"):
            gather_impostors(sources, **gathering)


def test_unusable_sources(gathering, tmp_path):
    with pytest.raises(DatasetError, match="no such folder"):
        gather_impostors([tmp_path / "nowhere"], **gathering)
    with pytest.raises(MatcherError, match="unknown matcher 'nobody'"):
        gather_impostors([tmp_path], matcher="nobody")
    two = tmp_path / "two.csv"
    two.write_text("matcher,probe,reference,similarity\na,1_1,2_1,1\nb,1_1,2_1,2\n")
    with pytest.raises(DatasetError, match="holds scores of a, b, none of fake"):
        gather_impostors([two], **gathering)


def impostor_set(name, seed, fingers=12, impressions=5):
    finger = np.repeat(np.arange(fingers), impressions)
    i, j = np.triu_indices(finger.size, k=1)
    apart = finger[i] != finger[j]
    similarity = np.random.default_rng(seed).exponential(1.0, i.size)[apart]
    return Trials(similarity, finger[i][apart], finger[j][apart], fingers, name)


SETS = [impostor_set("ours", 0), impostor_set("theirs", 1)]
CALIBRATION = calibrate_on(SETS, "fake")


def test_the_largest_measured_score_is_where_the_knots_end():
    found = report_calibration(CALIBRATION, SETS)
    assert json.loads(json.dumps(found)) == found
    assert (found["databases"], found["fingers"], found["impostors"]) == (2, 24, 2 * 1650)
    assert found["largest_measured_score"] == CALIBRATION.largest_measured_score
    assert found["smallest_measured_fmr"] == pytest.approx(20 / 3300)
    low, high = found["smallest_measured_fmr_interval"]
    assert low <= found["smallest_measured_fmr"] <= high
    assert found["highest_impostor_score"] > found["largest_measured_score"]
    text = calibration_text(found)
    assert "3,300 impostor comparisons\n              of 24 fingers (2 databases)" in text
    assert "Measured    up to score 22.2, a false match rate of 1 in 160" in text
    assert "so is the default threshold, 40: to measure it takes\n" in text
    assert "200,000 impostor comparisons" in text
