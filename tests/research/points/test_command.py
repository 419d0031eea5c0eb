import json
from dataclasses import replace
from functools import partial

import pytest

from fpmatch.pointset.geometry.point_match import PointMatch
from research.points import bench as point_bench
from research.points import command as points
from research.points import matchers as point_matchers
from research.points import trials as point_trials
from research.points.conditions import conditions
from research.points.matchers import MATCHER_NAMES, BenchMatcher
from research.points.random_sets import POINT_MODELS


@pytest.fixture
def calls():
    """Return the names of the matchers called, in order."""
    return []


@pytest.fixture(autouse=True)
def fakes(monkeypatch, calls):
    """Put matchers that find nothing, at little cost, into the places of all four."""

    def fake(name, _):
        calls.append(name)
        sum(range(1000))  # more than the clock resolves: summaries divide by times
        return PointMatch.none()

    matchers = {
        name: BenchMatcher(name, partial(fake, name), complete=name == "triangles")
        for name in MATCHER_NAMES
    }
    monkeypatch.setattr(point_matchers, "_MATCHERS", matchers)
    monkeypatch.setattr(point_matchers, "find_spec", lambda _: True)
    monkeypatch.setattr(points, "QUICK_LARGEST_M", 50)
    monkeypatch.setattr(point_trials, "_triangulate_both", lambda _: sum(range(1000)))


@pytest.fixture
def bench(run_research):
    """Return a function that runs the command, quickly."""
    return partial(run_research, "measure", "points", "--quick", "--trials", 1)


def test_the_tables_are_on_stdout_and_each_cell_on_stderr(bench):
    result = bench("--model", "patch", "--matcher", "triangles", "--matcher", "paper")
    assert (result.exit_code, result.stderr.count("\n")) == (0, 9 * 2)
    titles = [line for line in result.stdout.splitlines() if " model:" in line]
    assert [title.split(",")[0] for title in titles] == ["### triangles"] * 2 + ["### paper"] * 2


def test_all_matchers_and_both_models_by_default(bench, tmp_path):
    pytest.importorskip("matplotlib")
    path, plot = tmp_path / "bench.json", tmp_path / "bench.svg"
    assert bench("--json", path, "--plot", plot).exit_code == 0
    assert "patch model" in plot.read_text()
    cells = json.loads(path.read_text())["cells"]
    assert len(cells) == 3 * 3 * 2 * 4
    assert {cell["matcher"] for cell in cells} == set(MATCHER_NAMES)
    assert {cell["model"] for cell in cells} == set(POINT_MODELS)


def test_all_conditions_without_quick(run_research, monkeypatch):
    plans = []

    def run_bench(results, where, chosen, plan, **_):
        plans.append((where, plan))

    monkeypatch.setattr(points, "run_bench", run_bench)
    assert run_research("measure", "points").exit_code == 0
    words = ["--trials", 7, "--independent-trials", 2, "--seed", 3, "--budget", 2.5]
    assert run_research("measure", "points", *words).exit_code == 0
    assert run_research("measure", "points", "--quick", "--budget", 2.5).exit_code == 0
    plan = point_trials.TrialPlan()
    assert (plan.trials, plan.budget_s) == (100, 20.0)
    assert plans == [
        (conditions(), plan),
        (conditions(), replace(plan, trials=7, independent_trials=2, seed=3, budget_s=2.5)),
        (conditions(largest_m=50), replace(point_trials.QUICK_PLAN, budget_s=2.5)),
    ]


def test_a_matcher_that_is_not_installed_is_left_out_or_refused(bench, calls, monkeypatch):
    monkeypatch.setattr(point_matchers, "find_spec", lambda _: None)
    result = bench("--model", "patch")
    assert (result.exit_code, "'fpmatch[bench]'" in result.stderr) == (0, True)
    assert set(calls) == {"triangles", "paper", "van-wamelen"}
    refused = bench("--matcher", "astroalign")
    assert (refused.exit_code, "astroalign is not installed" in refused.stderr) == (2, True)


def test_ctrl_c_leaves_a_whole_file_that_can_be_resumed(bench, tmp_path, calls, monkeypatch):
    really, done = point_bench.run_cell, []

    def run_cell(*words):
        if len(done) == 4:
            raise KeyboardInterrupt
        done.append(words)
        return really(*words)

    def cells():
        return json.loads(path.read_text())["cells"]

    path = tmp_path / "bench.json"
    words = ("--model", "patch", "--json", path, "--matcher", "triangles", "--resume")
    with monkeypatch.context() as patch:
        patch.setattr(point_bench, "run_cell", run_cell)
        assert bench(*words).exit_code == 1
    first = cells()
    assert (len(first), list(tmp_path.iterdir())) == (4, [path])
    calls.clear()
    assert bench(*words).exit_code == 0
    assert (len(cells()), cells()[:4]) == (9, first)
    assert len(calls) == 5 * 3  # the five that were missing: warming up, genuine, independent
    assert f"{path}: cannot resume" in bench(*words, "--seed", 4).stderr
    bench(*words[:-1])
    assert cells() != first


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("--resume", "--resume needs the file of --json"),
        ("--budget 0", "--budget"),
        ("--budget nan", "no number of seconds"),
        ("--plot b.gif", ".png, .svg, .pdf"),
        ("--json /dev/null/b.json", "cannot be written"),
        ("--json {file} --resume", "not a file of results"),
    ],
)
def test_wrong_usage_is_refused(bench, tmp_path, words, reason):
    file = tmp_path / "notes.txt"
    file.write_text("no results")
    result = bench(*words.format(file=file).split())
    assert (result.exit_code, result.stdout) == (2, "")
    assert reason in result.stderr
