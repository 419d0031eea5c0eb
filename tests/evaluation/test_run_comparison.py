import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binomtest

from fpmatch.errors import DatasetError
from fpmatch.evaluation.bootstrap import Trials
from fpmatch.evaluation.rates import error_rates
from fpmatch.evaluation.run_comparison import compare_runs
from fpmatch.evaluation.scores import ScoresSet
from fpmatch.evaluation.tables import format_comparison


def scored(similarity, fingers=12, impressions=4, name="db", matcher="fake", order=None):
    """All pairs of some prints; `order` permutes the prints, as another run might."""
    finger = np.repeat(np.arange(fingers), impressions)
    prints = [f"{f + 1}_{k % impressions + 1}.tif" for k, f in enumerate(finger)]
    i, j = np.triu_indices(finger.size, k=1)
    order = np.arange(finger.size) if order is None else order
    place = np.argsort(order)  # where each print stands now
    return ScoresSet(
        matcher=matcher,
        name=name,
        prints=tuple(prints[k] for k in order),
        probe=place[i],
        reference=place[j],
        trials=Trials(similarity, finger[i], finger[j], fingers),
        compared=np.ones(i.size, bool),
    )


def similarities(seed, gap, fingers=12, impressions=4, noise=0.0):
    rng = np.random.default_rng(seed)
    finger = np.repeat(np.arange(fingers), impressions)
    i, j = np.triu_indices(finger.size, k=1)
    found = rng.standard_normal(i.size) + gap * (finger[i] == finger[j])
    return found + noise * np.random.default_rng(9).standard_normal(i.size)


def change(one, rate="eer"):
    return next(c for c in one.differences if c.rate == rate)


def test_the_same_run_is_no_change():
    run = [scored(similarities(0, 3.0))]
    found = compare_runs(run, run, bootstrap=50)
    same = change(found.pooled)
    assert (same.before, same.interval, same.verdict) == (same.now, (0, 0), "no change")
    assert found.identical == found.pooled.pairs == 1128
    assert (found.only_before, found.only_now) == (0, 0)
    assert (found.decisions.gained, found.decisions.lost) == ((), ())
    assert found.decisions.mcnemar_p == 1.0


def test_a_better_run_is_outside_chance_and_a_little_noise_is_not():
    before = [scored(similarities(0, 2.0))]
    better = [scored(similarities(0, 4.0))]
    noisy = [scored(similarities(0, 2.0, noise=0.05))]
    found = compare_runs(before, better, bootstrap=200)
    assert change(found.pooled).verdict == "better"
    assert change(found.pooled).interval.high < 0
    assert change(compare_runs(better, before, bootstrap=200).pooled).verdict == "worse"
    assert change(compare_runs(before, noisy, bootstrap=200).pooled).verdict == "within chance"


def test_pairs_meet_by_name_whatever_their_order():
    was, now = similarities(0, 2.0), similarities(1, 3.0)
    order = np.random.default_rng(3).permutation(48)
    plain = compare_runs([scored(was)], [scored(now)], bootstrap=20)
    mixed = compare_runs([scored(was, order=order)], [scored(now)], bootstrap=20)
    assert mixed.pooled == plain.pooled
    assert mixed.decisions == plain.decisions


def test_what_one_run_alone_compared_is_left_out():
    before = scored(similarities(0, 2.0))
    fewer = scored(similarities(0, 2.0, fingers=8), fingers=8)
    found = compare_runs([before, scored(similarities(0, 2.0), name="old")], [fewer], bootstrap=20)
    assert found.pooled.pairs == fewer.probe.size
    assert found.only_before == 2 * before.probe.size - fewer.probe.size
    assert found.only_now == 0
    kept = np.maximum(before.trials.probe, before.trials.reference) < 8
    genuine, similarity = before.trials.genuine[kept], before.trials.similarity[kept]
    expected = error_rates(similarity[genuine], similarity[~genuine])
    assert change(found.pooled).before == expected.eer


def test_mean_and_pooled_of_two_databases():
    before = [scored(similarities(k, 2.0), name=f"db{k}") for k in range(2)]
    now = [scored(similarities(k, 3.0), name=f"db{k}") for k in range(2)]
    found = compare_runs(before, now, bootstrap=50)
    assert change(found.mean).now == pytest.approx(np.mean([change(s).now for s in found.sets]))
    assert {c.rate for c in found.pooled.differences} == {"eer", "fmr100", "fmr1000"}
    low, high = change(found.mean).interval.low, change(found.mean).interval.high
    assert low <= change(found.mean).now - change(found.mean).before <= high


def test_decisions_that_changed_are_named_and_tested():
    was, now = similarities(0, 3.0), similarities(1, 3.0)
    before, after = scored(was), scored(now)
    found = compare_runs([before], [after], bootstrap=20).decisions
    impostor = ~before.trials.genuine
    bars = [np.sort(s[impostor])[-2] for s in (was, now)]
    accepted = [(s > bar) & ~impostor for s, bar in zip((was, now), bars, strict=True)]
    assert found.fmr == 0.001
    assert len(found.gained) == (accepted[1] & ~accepted[0]).sum()
    assert len(found.lost) == (accepted[0] & ~accepted[1]).sum()
    changed = len(found.gained) + len(found.lost)
    assert found.mcnemar_p == pytest.approx(binomtest(len(found.lost), changed).pvalue)
    k = int(np.flatnonzero(accepted[1] & ~accepted[0])[0])
    assert (found.gained[0].probe, found.gained[0].reference) == (
        after.prints[after.probe[k]],
        after.prints[after.reference[k]],
    )


def test_few_fingers_tell_nothing():
    run = [scored(similarities(0, 2.0, fingers=4), fingers=4)]
    found = compare_runs(run, run, bootstrap=20)
    assert change(found.pooled).interval is None
    assert change(found.pooled).verdict == "too few fingers to tell"


def test_runs_over_other_databases_or_prints():
    one = scored(similarities(0, 2.0))
    with pytest.raises(DatasetError, match="no database in common: db; other"):
        compare_runs([one], [replace(one, name="other")])
    renamed = replace(one, prints=tuple(f"9{name}" for name in one.prints))
    with pytest.raises(DatasetError, match="no genuine and impostor pairs in common"):
        compare_runs([one], [renamed])


def test_text_and_json():
    before = [scored(similarities(0, 2.0), matcher="paper")]
    found = compare_runs(before, [scored(similarities(1, 4.0))], bootstrap=100)
    text = format_comparison(found, "old.csv")
    head, columns, row, *_ = text.splitlines()
    assert head.startswith("fake compared with old.csv, by matcher paper: 1,128 pairs in both, 0 ")
    assert columns.split()[:4] == ["pairs", "paper", "fake", "points"]
    assert row.startswith("db EER ")
    assert row.endswith(" better")
    assert "genuine pairs" in text
    assert "now matching: db " in text
    assert "(McNemar's exact test: p < 0.0001)" in text
    document = json.loads(json.dumps(found.as_json()))
    assert document["pooled"]["eer"]["verdict"] == "better"
    assert document["decisions"]["genuine"] == 72
