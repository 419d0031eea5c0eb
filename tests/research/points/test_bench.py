from dataclasses import replace

import pytest

from fpmatch.errors import FpmatchError
from fpmatch.pointset.geometry.point_match import PointMatch
from research.points import bench as point_bench
from research.points.bench import check_same_settings, describe_settings, run_bench
from research.points.conditions import Condition, conditions
from research.points.matchers import BenchMatcher, StoppedError
from research.points.results import BenchResults, PointCell, SkippedCell
from research.points.trials import TrialPlan

PLAN = TrialPlan(trials=1, budget_s=20.0)
WHERE = conditions(["patch"], largest_m=100)
DEFAULT = BenchMatcher("triangles", lambda _: PointMatch.none(), complete=True)
OTHER = BenchMatcher("van-wamelen", lambda _: PointMatch.none())


class Cells:
    """Cells that take no time: those that ran, and what becomes of the one at a slow condition."""

    def __init__(self):
        self.ran, self.slow, self.first = [], None, None

    def run(self, condition, matcher, plan):
        self.ran.append((matcher.name, condition))
        cell = PointCell(condition, matcher.name, "1", 0, 1, 1.0, 2.0, 1.0, 1.0)
        return self.first(cell) if condition == self.slow else cell


@pytest.fixture
def cells(monkeypatch):
    made = Cells()
    monkeypatch.setattr(point_bench, "run_cell", made.run)
    return made


def test_all_matchers_run_at_one_place_before_the_next(cells):
    results, counts = BenchResults({}), []
    count = lambda _: counts.append(len(results.cells))  # noqa: E731
    run_bench(results, WHERE, [DEFAULT, OTHER], PLAN, finished=count)
    names = ("triangles", "van-wamelen")
    assert cells.ran == [(name, condition) for condition in WHERE for name in names]
    assert [(cell.matcher, cell.condition) for cell in results.cells] == cells.ran
    assert counts == list(range(1, len(counts) + 1))  # finished once it is among the results


def test_cells_that_are_there_do_not_run_again(cells):
    results = BenchResults({})
    run_bench(results, WHERE[:2], [DEFAULT], PLAN)
    results.skipped.append(SkippedCell(WHERE[2], "triangles", "too long"))
    before, names, finished = list(results.cells), [], []
    cells.ran.clear()
    run_bench(results, WHERE[:4], [DEFAULT], PLAN, started=names.append, finished=finished.append)
    assert cells.ran == [("triangles", WHERE[3])]
    assert results.cells[:2] == before
    assert finished == [*before, results.skipped[0], results.cells[2]]
    assert names == [f"triangles, {condition}" for condition in WHERE[:4]]


def stopped(_):
    raise StoppedError


def over_budget(cell):
    return replace(cell, first_ms=20_001.0)


@pytest.mark.parametrize("first", [stopped, over_budget])
def test_larger_sets_are_left_out_where_a_first_match_took_too_long(cells, first):
    slow = Condition("patch", 0, 4)  # of rows 0 and 1, alike but for m
    cells.slow, cells.first = slow, first
    results = BenchResults({})
    run_bench(results, WHERE, [OTHER], PLAN)
    larger = {Condition("patch", *at) for at in ((0, 8), (1, 2), (1, 4), (1, 8))}
    assert {condition for _, condition in cells.ran} == set(WHERE) - larger
    expected = {*larger, slow} if first is stopped else larger
    assert {cell.condition for cell in results.skipped} == expected
    assert {cell.condition for cell in results.cells} == set(WHERE) - expected
    assert results.skipped[-1].reason == f"a match took over 20 s at {slow}"


def test_the_default_is_left_out_nowhere(cells):
    cells.slow, cells.first = WHERE[0], over_budget
    results = BenchResults({})
    run_bench(results, WHERE, [DEFAULT], PLAN)
    assert (len(results.cells), results.skipped) == (len(WHERE), [])


def test_what_was_too_long_before_is_still_too_long(cells):
    slow = PointCell(WHERE[0], "van-wamelen", "1", 0, 1, 1.0, 2.0, 1.0, 20_001.0)
    results = BenchResults({}, [slow])
    run_bench(results, [WHERE[0], WHERE[1]], [OTHER], PLAN)
    assert cells.ran == []
    assert [cell.condition for cell in results.skipped] == [WHERE[1]]


def test_an_interruption_leaves_what_was_found(cells):
    def interrupted(_):
        raise KeyboardInterrupt

    cells.slow, cells.first = WHERE[2], interrupted
    results = BenchResults({})
    with pytest.raises(KeyboardInterrupt):
        run_bench(results, WHERE, [DEFAULT], PLAN)
    assert [cell.condition for cell in results.cells] == WHERE[:2]


def test_settings_name_what_results_depend_on():
    settings = describe_settings(PLAN)
    assert (settings["trials"], settings["seed"], settings["budget_s"]) == (1, 0, 20.0)
    assert {"fpmatch", "python", "numpy", "scipy", "astroalign"} == set(settings["versions"])
    assert settings["machine"]["cpus"] >= 1
    assert settings["kernels"] in {"compiled", "interpreted"}
    check_same_settings("bench.json", settings, describe_settings(PLAN))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"trials": 2, "seed": 5}, "trials was 2, is 1; seed was 5, is 0$"),
        ({"versions": {"scipy": "0.1"}}, "scipy was 0.1, is "),
        ({"moon": "full"}, "moon was full, is None$"),
    ],
)
def test_other_settings_are_refused(changes, message):
    now = describe_settings(PLAN)
    with pytest.raises(FpmatchError, match=f"^bench.json: cannot resume.*: .*{message}"):
        check_same_settings("bench.json", {**now, **changes}, now)
