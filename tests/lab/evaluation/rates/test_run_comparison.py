from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binomtest

from fpmatch.errors import DatasetError
from fpmatch.lab.evaluation.rates.error_rates import error_rates
from fpmatch.lab.evaluation.rates.run_comparison import compare_runs
from fpmatch.lab.evaluation.rates.scores import ScoresSet, Trials


def scored(seed, gap, fingers=12, impressions=4, noise=0.0, name="db", matcher="fake", order=None):
    """All pairs of some prints, genuine ones higher; `order` permutes the prints."""
    finger = np.repeat(np.arange(fingers), impressions)
    prints = [f"{f + 1}_{k % impressions + 1}.tif" for k, f in enumerate(finger)]
    i, j = np.triu_indices(finger.size, k=1)
    similarity = np.random.default_rng(seed).standard_normal(i.size) + gap * (
        finger[i] == finger[j]
    )
    similarity += noise * np.random.default_rng(9).standard_normal(i.size)
    order = np.arange(finger.size) if order is None else order
    place = np.argsort(order)  # where each print stands now
    trials = Trials(similarity, finger[i], finger[j], fingers)
    names = tuple(prints[k] for k in order)
    return ScoresSet(matcher, name, names, place[i], place[j], trials, np.ones(i.size, bool))


def change(one):
    return one["eer"]


def test_the_same_run_is_no_change():
    run = [scored(0, 3.0)]
    found = compare_runs(run, run, bootstrap=50)
    same = change(found["pooled"])
    assert (same["before"], same["change_interval"], same["verdict"]) == (
        same["now"],
        None,
        "no change",
    )
    assert found["identical"] == found["pooled"]["pairs"] == 1128
    assert (found["only_before"], found["only_now"]) == (0, 0)
    assert (found["decisions"]["gained"], found["decisions"]["lost"]) == ([], [])
    assert found["decisions"]["mcnemar_p"] == 1.0
    stretched = replace(
        run[0], trials=replace(run[0].trials, similarity=2 * run[0].trials.similarity)
    )
    assert change(compare_runs(run, [stretched], bootstrap=20)["sets"][0]) == same
    few = [scored(0, 2.0, fingers=4)]
    found = change(compare_runs(few, few, bootstrap=20)["pooled"])
    assert (found["change_interval"], found["verdict"]) == (None, "too few fingers to tell")


def test_a_better_run_is_outside_chance_and_a_little_noise_is_not():
    before, better, noisy = [scored(0, 2.0)], [scored(0, 4.0)], [scored(0, 2.0, noise=0.05)]
    found = change(compare_runs(before, better, bootstrap=200)["pooled"])
    assert found["verdict"] == "better"
    assert found["change_interval"][1] < 0
    assert change(compare_runs(better, before, bootstrap=200)["pooled"])["verdict"] == "worse"
    assert (
        change(compare_runs(before, noisy, bootstrap=200)["pooled"])["verdict"] == "within chance"
    )


def test_pairs_meet_by_name_whatever_their_order():
    order = np.random.default_rng(3).permutation(48)
    plain = compare_runs([scored(0, 2.0)], [scored(1, 3.0)], bootstrap=20)
    mixed = compare_runs([scored(0, 2.0, order=order)], [scored(1, 3.0)], bootstrap=20)
    assert (mixed["pooled"], mixed["decisions"]) == (plain["pooled"], plain["decisions"])


def test_what_one_run_alone_compared_is_left_out():
    before, fewer = scored(0, 2.0), scored(0, 2.0, fingers=8)
    found = compare_runs([before, scored(0, 2.0, name="old")], [fewer], bootstrap=20)
    assert found["pooled"]["pairs"] == fewer.probe.size
    assert found["only_before"] == 2 * before.probe.size - fewer.probe.size
    assert found["only_now"] == 0
    kept = np.maximum(before.trials.probe, before.trials.reference) < 8
    genuine, similarity = before.trials.genuine[kept], before.trials.similarity[kept]
    expected = error_rates(similarity[genuine], similarity[~genuine])
    assert change(found["pooled"])["before"] == expected.eer


def test_mean_and_pooled_of_two_databases():
    before, now = ([scored(k, gap, name=f"db{k}") for k in range(2)] for gap in (2.0, 3.0))
    found = compare_runs(before, now, bootstrap=50)
    mean = change(found["mean"])
    assert mean["now"] == pytest.approx(np.mean([change(s)["now"] for s in found["sets"]]))
    rates = {"eer", "fmr100", "fmr1000"}
    assert set(found["pooled"]) == {"name", "pairs", *rates}
    low, high = mean["change_interval"]
    assert low <= mean["now"] - mean["before"] <= high


def test_decisions_that_changed_are_named_and_tested():
    before, after = scored(0, 3.0), scored(1, 3.0)
    found = compare_runs([before], [after], bootstrap=20)["decisions"]
    impostor, both = ~before.trials.genuine, (before.trials.similarity, after.trials.similarity)
    was, now = ((s > np.sort(s[impostor])[-2]) & ~impostor for s in both)
    assert found["fmr"] == 0.001
    assert len(found["gained"]) == (now & ~was).sum()
    assert len(found["lost"]) == (was & ~now).sum()
    changed = len(found["gained"]) + len(found["lost"])
    assert found["mcnemar_p"] == pytest.approx(binomtest(len(found["lost"]), changed).pvalue)
    k = int(np.flatnonzero(now & ~was)[0])
    names = after.prints[after.probe[k]], after.prints[after.reference[k]]
    assert (found["gained"][0]["probe"], found["gained"][0]["reference"]) == names


def test_runs_over_other_databases_or_prints():
    one = scored(0, 2.0)
    with pytest.raises(DatasetError, match="no genuine and impostor pairs in common: db; other"):
        compare_runs([one], [replace(one, name="other")])
    renamed = replace(one, prints=tuple(f"9{name}" for name in one.prints))
    with pytest.raises(DatasetError, match="no genuine and impostor pairs in common"):
        compare_runs([one], [renamed])
