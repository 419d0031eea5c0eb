from __future__ import annotations

import numpy as np
import pytest

from fpmatch.errors import DatasetError, MatcherError
from fpmatch.evaluation.impostors import gather_impostors, impostors_of_report
from fpmatch.evaluation.run import evaluate
from fpmatch.evaluation.score_file import write_scores


@pytest.fixture
def options(bench):
    return {"matcher": bench.MATCHER, "extractor": bench.extractor, "workers": 1}


def test_scores_and_folders_give_the_same(options, make_database, tmp_path):
    folders = [make_database("a", contents={"2_2": "broken"}), make_database("b", fingers=3)]
    report = evaluate(folders, **options)
    write_scores(tmp_path / "scores.csv", report)
    expected = impostors_of_report(report)
    assert sum(one.trials.similarity.size for one in expected) == 160 - 16 + 48
    for sources in (folders, [tmp_path / "scores.csv"]):
        found = gather_impostors(sources, **options)
        assert [one.name for one in found] == ["a", "b"]
        for one, other in zip(found, expected, strict=True):
            assert not one.trials.genuine.any()
            assert one.trials.fingers == other.trials.fingers
            np.testing.assert_array_equal(one.trials.similarity, other.trials.similarity)


def test_a_database_counts_once(options, make_database, tmp_path):
    folder = make_database("a")
    scores = tmp_path / "scores.csv"
    write_scores(scores, evaluate([folder], **options))
    with pytest.raises(DatasetError, match="a: scores of this database are given twice"):
        gather_impostors([scores, scores], **options)
    with pytest.raises(DatasetError, match="a: given both as a folder and as scores"):
        gather_impostors([scores, folder], **options)


def test_unusable_sources(options, tmp_path):
    with pytest.raises(DatasetError, match="no such folder"):
        gather_impostors([tmp_path / "nowhere"], **options)
    with pytest.raises(MatcherError, match="unknown matcher 'nobody'"):
        gather_impostors([tmp_path], matcher="nobody")
