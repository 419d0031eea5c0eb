"""The experiment on random point sets: what counts as right, cells, tables, runs continued."""

import json
from dataclasses import replace

import pytest

from fpmatch.pointset.geometry.point_match import PointMatch
from fpmatch.pointset.geometry.similarity import Similarity
from research.points import command as points
from research.points.conditions import Condition, make_pair
from research.points.matchers import MATCHERS
from research.points.trials import TrialPlan, is_recognised, run_cell

CONDITION = Condition("patch", 0, 2)
PAIR = make_pair(CONDITION, 0, 0, genuine=True)
QUICK = ("measure", "points", "--quick", "--model", "patch", "--trials", "1")


def found(transform, pairs):
    return PointMatch(transform, pairs, 1.0, 0.0, 1)


def test_the_truth_is_recognised_but_no_match_and_no_other_transform():
    assert is_recognised(found(PAIR.transform, PAIR.pairs), PAIR)
    for match in (PointMatch.none(), found(Similarity(), PAIR.pairs)):
        assert not is_recognised(match, PAIR)


@pytest.mark.parametrize(("share", "recognised"), [(0.99, True), (1.01, False)])
def test_every_point_has_to_come_within_t_of_its_place(share, recognised):
    moved = replace(PAIR.transform, tx=PAIR.transform.tx + share * PAIR.tolerance)
    assert is_recognised(found(moved, PAIR.pairs), PAIR) is recognised


@pytest.mark.parametrize(("missing", "recognised"), [(9, True), (10, False)])
def test_four_fifths_of_the_true_pairs_have_to_be_found(missing, recognised):
    assert len(PAIR.pairs) == 48
    pairs = PAIR.pairs.copy()
    pairs[:missing, 1] = (pairs[:missing, 1] + 1) % 100
    assert is_recognised(found(PAIR.transform, pairs), PAIR) is recognised


@pytest.mark.parametrize("matcher", ["triangles", "van-wamelen"])
def test_a_cell_counts_what_a_matcher_finds(matcher):
    cell = run_cell(CONDITION, matcher, TrialPlan(trials=3, independent_trials=2, budget_s=60))
    assert (cell["trials"], cell["true_positives"]) == (3, 3)
    assert (cell["independent_trials"], cell["false_positives"]) == (2, 0)
    assert cell["mean_ms"] > 0


def test_a_cell_ends_when_its_budget_is_spent():
    plan = TrialPlan(trials=9, independent_trials=9, budget_s=1e-9, fewest_trials=2)
    assert run_cell(CONDITION, "paper", plan)["trials"] <= 2


def test_a_run_is_continued_and_larger_sets_are_left_out(tmp_path, run_research, monkeypatch):
    ran = []

    def cell(condition, matcher, plan):
        ran.append(matcher)
        slow = 1e6 if matcher == "van-wamelen" else 1.0
        counts = {"trials": 1, "true_positives": 1, "independent_trials": 1, "false_positives": 0}
        where = {**condition._asdict(), "matcher": matcher}
        return {**where, **counts, "mean_ms": 1.5, "first_ms": slow}

    monkeypatch.setattr(points, "run_cell", cell)
    file = tmp_path / "points.json"
    done = run_research(*QUICK, "--json", file)
    assert done.exit_code == 0, done.output
    # of each of three settings, the smallest sets alone
    assert [ran.count(name) for name in MATCHERS] == [18, 18, 3]
    titles = [line for line in done.stdout.splitlines() if line.startswith("### ")]
    assert [title.split(",")[0] for title in titles] == [f"### {name}" for name in MATCHERS]
    assert "| 50 | 0.95 | 1.50 | 0.62 | 1/1 | 0/1 |" in done.stdout
    document = json.loads(file.read_text())
    del document["cells"][-1]
    file.write_text(json.dumps(document))
    ran.clear()
    assert run_research(*QUICK, "--json", file).exit_code == 0
    assert len(ran) == 1
    assert run_research(*QUICK, "--seed", "1", "--json", file).exit_code == 2
