from __future__ import annotations

import json

import numpy as np
import pytest

from fpmatch.engine import local
from fpmatch.errors import DatasetError, FpmatchError, MatcherError
from fpmatch.evaluation.comparison import OUTCOME
from fpmatch.evaluation.dataset import load_dataset
from fpmatch.evaluation.protocol import choose_pairs
from fpmatch.evaluation.rates import error_rates
from fpmatch.evaluation.run import evaluate


@pytest.fixture
def run(bench):
    def with_fakes(folders, **options):
        given = {"matcher": bench.MATCHER, "extractor": bench.extractor, "workers": 1, **options}
        return evaluate(folders, **given)

    return with_fakes


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
    folders = [make_database("a"), make_database("b", fingers=3)]
    report = run(folders, protocol=protocol)
    everything, genuine = [], []
    for row, folder in zip(report.sets, folders, strict=True):
        dataset = load_dataset(folder)
        pairs = choose_pairs(dataset.impressions, protocol)
        similarity = np.array(list(slow_similarities(bench, dataset, pairs)))
        assert row.outcomes["similarity"].tolist() == similarity.tolist()
        assert row.rates == error_rates(similarity[pairs.genuine], similarity[~pairs.genuine])
        everything.append(similarity)
        genuine.append(pairs.genuine)
    pooled, is_genuine = np.concatenate(everything), np.concatenate(genuine)
    assert report.pooled == error_rates(pooled[is_genuine], pooled[~is_genuine])
    assert report.mean.eer == pytest.approx(np.mean([row.rates.eer for row in report.sets]))


def test_the_same_processes_extract_and_compare(run, make_database, monkeypatch):
    started, start = [], local._start

    def noting(workers):
        started.append(workers)
        return start(workers)

    monkeypatch.setattr(local, "_start", noting)
    run([make_database(fingers=8, impressions=4)], workers=2)
    assert started == [2]


def test_results_do_not_depend_on_the_workers(run, make_database):
    folders = [make_database("a", fingers=8, contents={"2_2": "broken"}), make_database("b")]
    alone, together = (run(folders, workers=workers) for workers in (1, 3))
    assert (alone.mean, alone.pooled) == (together.mean, together.pooled)
    for one, other in zip(alone.sets, together.sets, strict=True):
        assert one.failures == other.failures
        for column in set(OUTCOME.names) - {"cpu_us"}:
            np.testing.assert_array_equal(one.outcomes[column], other.outcomes[column])


def test_prints_without_template_score_0_in_all_their_pairs(run, make_database):
    folder = make_database(contents={"2_1": "broken", "3_4": "empty"})
    row = run([folder]).sets[0]
    reasons = {path.name: reason for path, reason in row.failures}
    assert list(reasons) == ["2_1.tif", "3_4.tif"]
    assert reasons["2_1.tif"].endswith("2_1.tif: broken")
    assert "no minutiae" in reasons["3_4.tif"]
    stems = [i.path.stem for i in load_dataset(folder).impressions]
    lost = np.isin(row.pairs.probe, [stems.index("2_1"), stems.index("3_4")])
    lost |= np.isin(row.pairs.reference, [stems.index("2_1"), stems.index("3_4")])
    assert lost.sum() == 19 + 18
    assert (row.outcomes["similarity"] == 0).tolist() == lost.tolist()
    assert (row.outcomes["reason"][lost] == "no template").all()


def test_database_of_failures_only(run, make_database):
    folder = make_database(
        fingers=2, impressions=2, contents=dict.fromkeys(("1_1", "1_2", "2_1", "2_2"), "broken")
    )
    report = run([folder])
    assert report.sets[0].rates.eer == 0.5
    assert report.as_json()["sets"][0]["match_us"] is None


def test_json_has_the_promised_shape(run, make_database):
    report = run([make_database(toml='name = "first"'), make_database("other")])
    document = json.loads(json.dumps(report.as_json()))
    assert list(document) == ["sets", "mean", "pooled"]
    rates = ["eer", "fmr100", "fmr1000", "fmr10000", "zero_fmr", "zero_fnmr"]
    for entry in document["sets"]:
        counts = ["name", "genuine", "impostor"]
        prints = ["rank_one", "prints", "failures", "failure_rate"]
        assert list(entry) == [*counts, *rates, *prints, "extract_ms", "match_us"]
    assert (document["sets"][0]["prints"], document["sets"][0]["failure_rate"]) == (20, 0)
    assert [entry["name"] for entry in document["sets"]] == ["first", "other"]
    assert (document["sets"][0]["genuine"], document["sets"][0]["impostor"]) == (30, 160)
    assert set(rates) < set(document["mean"])
    assert (document["pooled"]["genuine"], document["pooled"]["impostor"]) == (60, 320)


def test_rate_that_one_set_lacks_has_no_mean(run, make_database):
    report = run([make_database("large", fingers=15), make_database("small", fingers=2)])
    assert report.sets[0].rates.fmr100 is not None
    assert report.sets[1].rates.fmr100 is None
    assert report.mean.fmr100 is None
    assert report.pooled.fmr100 is not None


def test_resolution_of_the_set_reaches_the_extractor(run, make_database):
    report = run([make_database(toml="dpi = 569")])
    assert {e.template.dpi for e in report.sets[0].extracted.extractions} == {569.0}


def test_progress_reaches_the_end_of_both_stages(run, make_database):
    calls = []
    run([make_database()], progress=lambda *call: calls.append(call))
    for stage, total in (("extract", 20), ("compare", 190)):
        done = [call[1] for call in calls if call[0] == stage]
        assert done == sorted(done)
        assert (done[0], done[-1]) == (0, total)
        assert {call[2] for call in calls if call[0] == stage} == {total}


def test_opencv_gets_its_threads_back(run, make_database):
    import cv2

    before = cv2.getNumThreads()
    run([make_database(fingers=2, impressions=1)])
    assert cv2.getNumThreads() == before


def test_dead_worker_is_one_clear_error(run, bench, make_database):
    with pytest.raises(FpmatchError, match="a worker process ended before"):
        run([make_database(fingers=6, impressions=5)], matcher=bench.DYING, workers=2)


def test_bad_requests(run, make_database):
    folder, single = make_database(), make_database("single", fingers=1, impressions=1)
    with pytest.raises(DatasetError, match="no database given"):
        run([])
    with pytest.raises(DatasetError, match="database given twice"):
        run([folder, folder / ".." / folder.name])
    with pytest.raises(DatasetError, match="single: has no two prints"):
        run([single])
    with pytest.raises(DatasetError, match="unknown protocol"):
        run([folder], protocol="all")
    with pytest.raises(MatcherError, match="unknown matcher 'none'"):
        run([folder], matcher="none")
    with pytest.raises(ValueError, match="workers must be at least 1"):
        run([folder], workers=0)
