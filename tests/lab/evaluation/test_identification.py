"""Error rates of searches from candidate lists, against the definitions; files of any system."""

import json
import math
import shutil

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import DatasetError
from fpmatch.lab.evaluation.identification import (
    Search,
    evaluate_candidates,
    identification_rates,
    read_candidates,
)
from tests.conftest import assert_refused, copied

HEAD = "probe,subject,score\n"
names = st.sampled_from("abcde")
lists = st.dictionaries(st.sampled_from("abc"), st.integers(0, 4).map(float), max_size=3)


@given(st.lists(st.builds(Search, names, lists), min_size=1, max_size=12), st.floats(0.05, 0.9))
def test_the_rates_are_those_of_the_definitions(searches, fpir):
    subjects = set("abc")
    mated = [one for one in searches if one.subject in subjects]
    others = [one for one in searches if one.subject not in subjects]
    if not mated:
        with pytest.raises(DatasetError, match="no probe's subject is enrolled"):
            identification_rates(searches, subjects)
        return
    found = identification_rates(searches, subjects, fpirs=[fpir], bootstrap=0)
    assert (found["mated"], found["nonmated"]) == (len(mated), len(others))
    first = [
        one.subject in one.candidates
        and all(
            s < one.candidates[one.subject] for c, s in one.candidates.items() if c != one.subject
        )
        for one in mated
    ]
    assert found["fnir_at_rank"][0]["fnir"] == pytest.approx(1 - np.mean(first))
    (point,) = found["fnir_at_fpir"]
    if math.floor(fpir * len(others) + 1e-9) < 1:
        assert point["fnir"] is None
        return
    threshold = math.inf if point["threshold"] is None else point["threshold"]
    hits = [max(one.candidates.values(), default=-1.0) >= threshold for one in others]
    assert np.mean(hits) <= fpir + 1e-9
    missed = [one.candidates.get(one.subject, -1.0) < threshold for one in mated]
    assert point["fnir"] == pytest.approx(np.mean(missed))


def test_intervals_are_of_the_subjects_and_hold_the_rates():
    rng = np.random.default_rng(1)
    searches = []
    for subject in range(40):
        for _ in range(4):
            own = {str(subject): float(rng.normal(2, 1))} if subject < 30 else {}
            listed = own | {str(40 + k): float(rng.normal(0, 1)) for k in range(3)}
            searches.append(Search(str(subject), listed))
    subjects = {str(k) for k in (*range(30), *range(40, 43))}
    found = identification_rates(searches, subjects, fpirs=[0.1], bootstrap=200)
    again = identification_rates(searches, subjects, fpirs=[0.1], bootstrap=200)
    assert found == again
    for point in (found["fnir_at_rank"][0], found["fnir_at_fpir"][0]):
        low, high = point["interval"]
        assert 0 < low < point["fnir"] < high
    never = found["fnir_at_rank"][1]
    assert (never["rank"], never["fnir"]) == (5, 0.0)
    assert (never["bound"]["units"], never["bound"]["unit"]) == (30, "subject")
    fnir = [point["fnir"] for point in found["det"]]
    assert fnir == sorted(fnir, reverse=True)


def test_a_subject_counts_once_with_its_highest_score(tmp_path):
    table = tmp_path / "a.csv"
    table.write_text(
        "rank,score,subject,probe,probe_subject\n"
        "1,7,2,x.png,ann\n2,5,3,x.png,ann\n3,4,2,x.png,ann\n,,,1_7.tif,\n"
    )
    searches = [Search("ann", {"2": 7.0, "3": 5.0}), Search("1", {})]
    assert read_candidates(table, {"1", "2", "3"}) == searches


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("", "line 1: the first line names no column 'probe'; needed: probe, subject, score"),
        ("1_1,2,0.5\n", "line 1: the first line names no column 'probe'"),
        (HEAD, "holds no search"),
        (HEAD + "1_1,9,0.5\n", "line 2: candidate '9' is not enrolled"),
        (HEAD + "ann,1,0.5\n", "line 2: the subject of probe 'ann' is not known"),
        (HEAD + "1_1,1,nan\n", "line 2: score 'nan' is no finite number"),
        (HEAD + "1_1,1,\n", "line 2: score '' is no finite number"),
        (HEAD + "9_1,1,5\n", "scores: no probe's subject is enrolled"),
        (b"\xff\xfe", "not a CSV file in UTF-8"),
        (None, "cannot be read"),
    ],
)
def test_lists_that_cannot_be_used_are_refused_in_one_line(run, tmp_path, content, reason):
    path = tmp_path / "scores.csv"
    enrolled = tmp_path / "enrolled.csv"
    enrolled.write_text("subject\n1\n2\n")
    if content is not None:
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    assert_refused(run("rates", path, "--enrolled", enrolled), reason)


def test_from_identify_to_the_det(run, prints, tmp_path):
    database, lists = tmp_path / "half.db", tmp_path / "candidates.csv"
    names = ("1_1.png", "1_2.png", "2_1.png")
    prints = copied(prints, tmp_path / "db", *names)
    shutil.copy(prints / "2_1.png", prints / "2_2.png")
    assert run("enrol", database, prints / "1_1.png", "--workers", 1).exit_code == 0
    words = ("identify", database, "--probes", prints, "-o", lists, "--workers", 1)
    assert run(*words).exit_code == 0
    given = ("rates", lists, "--enrolled", database, "--fpir", 0.5)
    document = json.loads(run(*given, "--json").stdout)
    (system,) = document["systems"]
    assert (system["name"], system["enrolled"]) == ("candidates", 1)
    assert (system["mated"], system["nonmated"]) == (2, 2)
    assert [one["fpir"] for one in system["fnir_at_fpir"]] == [0.5]
    (by_folder,) = evaluate_candidates([lists], prints)["systems"]
    assert (by_folder["enrolled"], by_folder["nonmated"]) == (2, 0)
    pytest.importorskip("matplotlib")
    drawn = run(*given, "--det", tmp_path / "det.svg")
    assert "FPIR 50 %" in drawn.stdout
    assert (tmp_path / "det.svg").read_bytes().startswith(b"<?xml")
    words = ("rates", lists, "--enrolled", prints, "--det")
    none = run(*words, tmp_path / "x.svg")
    assert (none.exit_code, "needs mated and non-mated searches" in none.stderr) == (2, True)
    assert_refused(run(*words, tmp_path / "x.doc"), "a plot's name ends with")
    for wrong in (("--fpir", 0.1), ("--enrolled", database, "--report", tmp_path / "r")):
        assert run("rates", lists, *wrong).exit_code == 2
