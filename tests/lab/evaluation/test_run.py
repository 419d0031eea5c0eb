import json

import numpy as np
import pytest

from fpmatch.errors import DatasetError, MatcherError
from fpmatch.gallery.batch.sources import unpack
from fpmatch.gallery.engine import engine
from fpmatch.gallery.engine.engine import serial
from fpmatch.lab.evaluation.databases.dataset import choose_pairs, load_dataset
from fpmatch.lab.evaluation.rates.error_rates import error_rates
from fpmatch.lab.evaluation.run import evaluate, evaluate_matchers

RATES = ["eer", "fmr100", "fmr1000", "fmr10000", "zero_fmr", "zero_fnmr"]


@pytest.fixture
def run(options):
    return lambda folders, **changes: evaluate(folders, **{**options, **changes})


def slow_similarities(bench, dataset, pairs):
    """Extract both prints anew for every pair."""
    for i, j in zip(pairs.probe, pairs.reference, strict=True):
        probe, reference = (
            bench.MATCHER.prepare(bench.extractor(dataset.impressions[k].path, None))
            for k in (i, j)
        )
        yield bench.MATCHER.compare(probe, reference).similarity


@pytest.mark.parametrize("protocol", ["extended", "fvc"])
def test_agrees_with_comparing_pair_by_pair(run, bench, make_database, protocol):
    folders = [make_database("a", toml="dpi = 569"), make_database("b", fingers=3)]
    report = run(folders, protocol=protocol)
    everything, genuine = [], []
    for row, folder in zip(report.sets, folders, strict=True):
        dataset = load_dataset(folder)
        pairs = choose_pairs(dataset.impressions, protocol)
        similarity = np.array(list(slow_similarities(bench, dataset, pairs)))
        assert row.scores.trials.similarity.tolist() == similarity.tolist()
        assert row.rates == error_rates(similarity[pairs.genuine], similarity[~pairs.genuine])
        everything.append(similarity)
        genuine.append(pairs.genuine)
    pooled, is_genuine = np.concatenate(everything), np.concatenate(genuine)
    assert report.pooled == error_rates(pooled[is_genuine], pooled[~is_genuine])
    assert report.mean.eer == pytest.approx(np.mean([row.rates.eer for row in report.sets]))
    assert {
        unpack(one.data).dpi for one in report.sets[0].source.templates(serial(), range(20))
    } == {569}


def test_results_do_not_depend_on_the_workers(run, make_database, monkeypatch):
    folders = [make_database("a", fingers=8, contents={"2_2": "broken"}), make_database("b")]
    started, start = [], engine.open_processes
    monkeypatch.setattr(engine, "open_processes", lambda n: started.append(n) or start(n))
    alone, together = (run(folders, workers=workers) for workers in (1, 3))
    assert started == [3]  # the same processes extract and compare
    assert (alone.mean, alone.pooled) == (together.mean, together.pooled)
    for one, other in zip(alone.sets, together.sets, strict=True):
        assert one.failures == other.failures
        np.testing.assert_array_equal(one.scores.trials.similarity, other.scores.trials.similarity)


def test_prints_without_template_score_lowest_in_all_their_pairs(run, make_database):
    folder = make_database(contents={"2_1": "broken", "3_4": "empty"})
    row = run([folder]).sets[0]
    reasons = dict(row.failures)
    assert list(reasons) == ["2_1.tif", "3_4.tif"]
    assert "broken" in reasons["2_1.tif"]
    assert "no minutiae" in reasons["3_4.tif"]
    scores = row.scores
    failed = [scores.prints.index(name) for name in reasons]
    lost = np.isin(scores.probe, failed) | np.isin(scores.reference, failed)
    assert lost.sum() == 19 + 18
    assert (scores.trials.similarity == 0).tolist() == lost.tolist() == (~scores.compared).tolist()


def test_json_has_the_promised_shape(report):
    document = json.loads(json.dumps(report.as_json()))
    assert list(document) == ["sets", "mean", "pooled"]
    for entry in document["sets"]:
        prints = ["prints", "failures", "failure_rate"]
        counts = ["name", "genuine", "impostor"]
        assert list(entry) == [*counts, *RATES, "d_prime", *prints, "identical"]
        assert entry["identical"] == {"count": 0, "pairs": []}
    first, second = document["sets"]
    assert (first["name"], first["prints"], first["failure_rate"]) == ("set, one", 24, 1 / 24)
    assert (first["genuine"], first["impostor"]) == (24, 252)
    assert second["name"] == "b"
    assert set(RATES) < set(document["mean"])
    assert (document["pooled"]["genuine"], document["pooled"]["impostor"]) == (60, 492)


class Interrupt(Exception):
    """Stop a run in the middle."""


def test_an_interrupted_run_is_resumed_and_writes_the_same_file(bench, make_database, tmp_path):
    folders = [make_database("a", contents={"2_1": "broken"}), make_database("b")]
    whole, resumed = tmp_path / "whole.csv", tmp_path / "resumed.csv"
    how = {"workers": 1, "extractor": bench.extractor}
    evaluate_matchers(folders, [bench.MATCHER], scores=whole, **how)

    passed = []

    def interrupted(stage, done, total):
        if stage == "compare" and passed and done:  # of the second database
            raise Interrupt
        if stage == "compare" and done == total:
            passed.append(stage)

    with pytest.raises(Interrupt):
        evaluate_matchers(folders, [bench.MATCHER], scores=resumed, progress=interrupted, **how)
    assert not resumed.exists()
    seen = []
    (report,) = evaluate_matchers(
        folders, [bench.MATCHER], scores=resumed, progress=lambda *call: seen.append(call), **how
    )
    assert resumed.read_bytes() == whole.read_bytes()
    assert [path.name for path in tmp_path.iterdir() if path.is_file()] == [
        *sorted(("resumed.csv", "whole.csv"))
    ]
    assert [name for name, _ in report.failures] == ["2_1.tif"]
    assert [call for call in seen if call[0] == "extract"][-1][1] <= 20  # of `b` at most


def test_rate_that_one_set_lacks_has_no_mean(run, make_database):
    report = run([make_database("large", fingers=15), make_database("small", fingers=2)])
    rates = (*(row.rates for row in report.sets), report.mean, report.pooled)
    assert [one.fmr100 is None for one in rates] == [False, True, True, False]


def test_bad_requests(run, make_database):
    folder, single = make_database(), make_database("single", fingers=1, impressions=1)
    for folders, changes, error, reason in (
        ([], {}, DatasetError, "no database given"),
        ([folder, folder / ".." / folder.name], {}, DatasetError, "database given twice"),
        ([single], {}, DatasetError, "single: has no two prints"),
        ([folder], {"protocol": "all"}, DatasetError, "unknown protocol 'all'"),
        ([folder], {"matcher": "none"}, MatcherError, "unknown matcher 'none'"),
        ([folder], {"workers": 0}, ValueError, "workers must be at least 1"),
    ):
        with pytest.raises(error, match=reason):
            run(folders, **changes)
