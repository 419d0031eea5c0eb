from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from fpmatch.errors import DatasetError, MatcherError
from fpmatch.evaluation.dataset import Dataset, Impression
from fpmatch.evaluation.extraction import ExtractedSet, Extraction
from fpmatch.evaluation.impostors import (
    gather_impostors,
    impostors_among,
    impostors_of_report,
)
from fpmatch.evaluation.run import evaluate
from fpmatch.evaluation.score_file import write_scores
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.minutiae import Minutiae, Template


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


def a_set(name, seed, folder):
    """Return impressions of two fingers, the last without a template."""
    rng = np.random.default_rng(seed)
    taken, extractions = [], []
    for finger in (1, 2):
        x, y, angle = rng.uniform(20, 180, (3, 12))
        for number in (1, 2, 3):
            taken.append(Impression(finger, number, folder / f"{finger}_{number}.tif"))
            template = Template(Minutiae(x + number, y, angle), 200, 200)
            extractions.append(Extraction(template, "", 0.0))
    extractions[-1] = Extraction(None, "no ridges", 0.0)
    return ExtractedSet(Dataset(name, 500.0, "", tuple(taken)), tuple(extractions))


@pytest.mark.parametrize("workers", [1, 2])
def test_among_all_impressions_are_those_of_other_fingers(tmp_path, workers):
    sets = [a_set("one", 1, tmp_path), a_set("two", 2, tmp_path)]
    shown = [
        (number, impression.finger, found.template)
        for number, one in enumerate(sets)
        for impression, found in zip(one.dataset.impressions, one.extractions, strict=True)
        if found.template is not None
    ]
    similarities = [
        MATCHER.compare(MATCHER.prepare(a), MATCHER.prepare(b)).similarity
        for (*finger, a), (*other, b) in itertools.combinations(shown, 2)
        if finger != other
    ]
    found = impostors_among(sets, "both", workers)
    assert (found.name, found.trials.fingers) == ("both", 4)
    assert found.trials.similarity.tolist() == similarities
    assert not found.trials.genuine.any()


def test_among_no_impressions_there_are_no_impostors(tmp_path):
    none = a_set("none", 3, tmp_path)
    failed = replace(none, extractions=(Extraction(None, "no ridges", 0.0),) * 6)
    assert impostors_among([failed], "none").trials.similarity.size == 0
    assert impostors_among([], "none").trials.fingers == 0
