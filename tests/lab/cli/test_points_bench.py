"""`fpmatch points bench` with fake matchers: what it prints, writes and refuses."""

import importlib
import json
from dataclasses import replace
from functools import partial

import pytest

from fpmatch.lab.points.bench import bench as point_bench
from fpmatch.lab.points.bench import matchers as point_matchers
from fpmatch.lab.points.bench import trials as point_trials
from fpmatch.lab.points.bench.conditions import conditions
from fpmatch.lab.points.bench.matchers import MATCHER_NAMES, BenchMatcher
from fpmatch.lab.points.random_sets import POINT_MODELS
from fpmatch.pointset.geometry.point_match import PointMatch
from tests.conftest import assert_refused

# The module: the package's attribute of this name is the command that is found in it.
command = importlib.import_module("fpmatch.lab.cli.points_bench")


@pytest.fixture
def calls():
    """Return the names of the matchers called, in order."""
    return []


@pytest.fixture(autouse=True)
def fakes(monkeypatch, calls):
    """Put matchers that find nothing, at no cost, into the places of all four."""

    def fake(name, _):
        calls.append(name)
        return PointMatch.none()

    matchers = {
        name: BenchMatcher(name, partial(fake, name), complete=name == "triangles")
        for name in MATCHER_NAMES
    }
    monkeypatch.setattr(point_matchers, "_MATCHERS", matchers)
    monkeypatch.setattr(point_matchers, "find_spec", lambda _: True)
    monkeypatch.setattr(point_trials, "QUICK_LARGEST_M", 50)
    monkeypatch.setattr(point_trials, "_triangulate_both", lambda _: None)


@pytest.fixture
def bench(run):
    """Return a function that runs the command, quickly."""
    return lambda *words: run("points", "bench", "--quick", "--trials", 1, *words)


def test_the_table_is_on_stdout_and_stderr_is_silent(bench):
    result = bench("--model", "patch", "--matcher", "triangles", "--matcher", "paper")
    assert (result.exit_code, result.stderr) == (0, "")
    titles = [line for line in result.stdout.splitlines() if " model:" in line]
    assert [title.split(",")[0] for title in titles] == ["triangles", "triangles", "paper", "paper"]
    result = bench("--model", "clutter", "--matcher", "triangles", "--markdown")
    assert result.stdout.startswith("### triangles, clutter model: ")


def test_all_matchers_and_both_models_by_default(bench, tmp_path):
    pytest.importorskip("matplotlib")
    path, plot = tmp_path / "bench.json", tmp_path / "bench.svg"
    assert bench("--json", path, "--plot", plot).exit_code == 0
    assert "patch model" in plot.read_text()
    cells = json.loads(path.read_text())["cells"]
    assert len(cells) == 3 * 3 * 2 * 4
    assert {cell["matcher"] for cell in cells} == set(MATCHER_NAMES)
    assert {cell["model"] for cell in cells} == set(POINT_MODELS)


def test_all_conditions_without_quick(run, tmp_path, monkeypatch):
    plans = []

    def run_bench(results, where, chosen, plan, **_):
        plans.append((where, plan))

    monkeypatch.setattr(point_bench, "run_bench", run_bench)
    assert run("points", "bench").exit_code == 0
    words = ["--trials", 7, "--independent-trials", 2, "--seed", 3, "--budget", 2.5]
    assert run("points", "bench", *words).exit_code == 0
    assert run("points", "bench", "--quick", "--budget", 2.5).exit_code == 0
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
    assert_refused(bench("--matcher", "astroalign"), "astroalign")


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
        assert bench(*words).exit_code == 130
    first = cells()
    assert (len(first), list(tmp_path.iterdir())) == (4, [path])
    calls.clear()
    assert bench(*words).exit_code == 0
    assert (len(cells()), cells()[:4]) == (9, first)
    assert len(calls) == 5 * 3  # the five that were missing: warming up, genuine, independent
    assert_refused(bench(*words, "--seed", 4), f"{path}: ")
    bench(*words[:-1])
    assert cells() != first
