from __future__ import annotations

import csv

import numpy as np
import pytest

from fpmatch.errors import DatasetError
from fpmatch.evaluation.intervals import trials_of
from fpmatch.evaluation.run import evaluate
from fpmatch.evaluation.score_file import write_scores
from fpmatch.evaluation.scores import choose_matcher, read_scores


@pytest.fixture
def report(bench, make_database):
    folders = [make_database("a", toml='name = "set, one"', contents={"1_2": "broken"})]
    folders.append(make_database("b", fingers=3))
    return evaluate(folders, matcher=bench.MATCHER, extractor=bench.extractor, workers=1)


@pytest.fixture
def scores(report, tmp_path):
    path = tmp_path / "scores.csv"
    write_scores(path, report)
    return path


def test_what_was_written_is_read(report, scores):
    found = read_scores(scores)
    assert [(s.matcher, s.name) for s in found] == [("fake", "set, one"), ("fake", "b")]
    for row, again in zip(report.sets, found, strict=True):
        expected = trials_of(row)
        assert again.trials.similarity.tolist() == expected.similarity.tolist()
        assert again.trials.genuine.tolist() == row.pairs.genuine.tolist()
        assert again.trials.fingers == expected.fingers
        np.testing.assert_array_equal(again.trials.probe, expected.probe)
        names = [i.path.name for i in row.extracted.dataset.impressions]
        assert [again.prints[i] for i in again.probe] == [names[i] for i in row.pairs.probe]
        assert (again.compared == (row.outcomes["reason"] != "no template")).all()


def test_a_file_without_matchers_is_anybodys(scores, tmp_path):
    with scores.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    with (tmp_path / "old.csv").open("w", newline="") as stream:
        names = ["set", "probe", "reference", "genuine", "similarity"]
        writer = csv.DictWriter(stream, names, extrasaction="ignore")
        writer.writeheader()
        writer.writerows(rows)
    found = read_scores(tmp_path / "old.csv")
    assert {s.matcher for s in found} == {""}
    assert choose_matcher(found, "any", "old.csv") == found


def test_sets_of_another_matcher_are_not_taken(scores):
    with pytest.raises(DatasetError, match=r"s\.csv: holds scores of fake, none of paper"):
        choose_matcher(read_scores(scores), "paper", "s.csv")


HEAD = "set,probe,reference,genuine,similarity\n"
GOOD = "a,1_1.tif,1_2.tif,1,0.5\n"


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("", "no column 'probe'"),
        ("x,y\n1,2\n", "no column 'probe'"),
        (HEAD.replace("similarity", "score"), "no column 'similarity'"),
        (HEAD, "holds no comparison"),
        (HEAD + GOOD + "\na,1_1.tif,2_1.tif,yes,1\n", "line 4: genuine must be 0 or 1, not 'yes'"),
        (HEAD + "a,1_1.tif,2_1.tif,1,0.5\n", "line 2: genuine is 1, which 1_1.tif and 2_1.tif"),
        (HEAD + "a,left.tif,2_1.tif,0,0.5\n", "line 2: 'left.tif' is not named FFF_M"),
        (HEAD + "a,1_1.tif,2_1.tif,0,high\n", "line 2: could not convert string to float"),
        (HEAD + "a,1_1.tif,2_1.tif,0,nan\n", "line 2: similarity must be a finite number"),
        (HEAD + GOOD + "a,1_2.tif,1_1.tif,1,0\n", "1_2.tif and 1_1.tif are compared twice"),
        (b"\xff\xfe\x00", "not a CSV file of scores"),
        (HEAD + 'a,"' + "x" * 200_000 + '",2,0,1\n', "not a CSV file of scores"),
        (None, "cannot be read: no such file"),
    ],
    ids=str,
)
def test_a_file_that_is_none_is_named(tmp_path, content, reason):
    path = tmp_path / "scores.csv"
    if content is not None:
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(DatasetError, match=r"^.*scores\.csv: ") as caught:
        read_scores(path)
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_folder_is_no_file(tmp_path):
    with pytest.raises(DatasetError, match="cannot be read: is a directory"):
        read_scores(tmp_path)


def test_a_file_of_score_has_each_pair_once(tmp_path):
    path = tmp_path / "db.csv"
    path.write_text(
        "probe,reference,similarity,score,reason\n"
        "1_1,1_1,9,9,\n1_1,1_2,3,3,\n1_2,1_1,3,3,\n1_2,2_1,,,reference: torn\n"
    )
    (found,) = read_scores(path)
    assert (found.name, found.matcher, found.prints) == ("db", "", ("1_1", "1_2", "2_1"))
    assert found.trials.similarity.tolist() == [3, 0]
    assert found.compared.tolist() == [True, False]
