"""The whole experiment: which cells run, which are left out, and how it goes on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from fpmatch.errors import FpmatchError
from fpmatch.evaluation.points import bench as point_bench
from fpmatch.evaluation.points.bench import check_same_settings, describe_settings, run_bench
from fpmatch.evaluation.points.conditions import Condition, conditions
from fpmatch.evaluation.points.matchers import BenchMatcher, PointCase, StoppedError, matcher_named
from fpmatch.evaluation.points.results import BenchResults, PointCell, SkippedCell
from fpmatch.evaluation.points.trials import TrialPlan
from fpmatch.pointset.point_match import PointMatch

PLAN = TrialPlan(trials=1, budget_s=20.0)
WHERE = conditions(["patch"], largest_m=100)


def never(_: PointCase) -> PointMatch:
    return PointMatch.none()


DEFAULT = BenchMatcher("triangles", never, complete=True)
OTHER = BenchMatcher("van-wamelen", never)


@pytest.fixture
def ran(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, Condition]]:
    """Let cells take no time; return the list of those that ran."""
    cells = []

    def run_cell(condition: Condition, matcher: BenchMatcher, plan: TrialPlan) -> PointCell:
        cells.append((matcher.name, condition))
        return PointCell(condition, matcher.name, "1", 0, 1, 1.0, 2.0, 1.0, 1.0)

    monkeypatch.setattr(point_bench, "run_cell", run_cell)
    return cells


def slow_at(
    monkeypatch: pytest.MonkeyPatch,
    slow: Condition,
    ran: list[tuple[str, Condition]],
    first: Callable[[PointCell], PointCell],
) -> None:
    """Let cells at one condition take long."""
    quick = point_bench.run_cell

    def run_cell(condition: Condition, matcher: BenchMatcher, plan: TrialPlan) -> PointCell:
        cell = quick(condition, matcher, plan)
        return first(cell) if condition == slow else cell

    monkeypatch.setattr(point_bench, "run_cell", run_cell)


def test_all_matchers_run_at_one_place_before_the_next(ran: list[tuple[str, Condition]]) -> None:
    results = BenchResults({})
    counts: list[int] = []

    def finished(_: object) -> None:
        counts.append(len(results.cells))

    run_bench(results, WHERE, [DEFAULT, OTHER], PLAN, finished=finished)
    assert ran == [
        (name, condition) for condition in WHERE for name in ("triangles", "van-wamelen")
    ]
    assert [(cell.matcher, cell.condition) for cell in results.cells] == ran
    assert counts == list(range(1, len(ran) + 1))  # a cell is among the results when it is finished


def test_cells_that_are_there_do_not_run_again(ran: list[tuple[str, Condition]]) -> None:
    results = BenchResults({})
    run_bench(results, WHERE[:2], [DEFAULT], PLAN)
    results.skipped.append(SkippedCell(WHERE[2], "triangles", "too long"))
    before = list(results.cells)
    names: list[str] = []
    finished: list[object] = []
    ran.clear()
    run_bench(results, WHERE[:4], [DEFAULT], PLAN, started=names.append, finished=finished.append)
    assert ran == [("triangles", WHERE[3])]
    assert results.cells[:2] == before
    assert finished == [*before, results.skipped[0], results.cells[2]]
    assert names == [f"triangles, {condition}" for condition in WHERE[:4]]


def stopped(_: PointCell) -> PointCell:
    raise StoppedError


def over_budget(cell: PointCell) -> PointCell:
    return replace(cell, first_ms=20_001.0)


@pytest.mark.parametrize("first", [stopped, over_budget])
def test_larger_sets_are_left_out_where_a_first_match_took_too_long(
    monkeypatch: pytest.MonkeyPatch,
    ran: list[tuple[str, Condition]],
    first: Callable[[PointCell], PointCell],
) -> None:
    slow = Condition("patch", 0, 4)  # of rows 0 and 1, alike but for m
    slow_at(monkeypatch, slow, ran, first)
    results = BenchResults({})
    run_bench(results, WHERE, [OTHER], PLAN)
    larger = [Condition("patch", 0, 8), Condition("patch", 1, 2), Condition("patch", 1, 4)]
    larger.append(Condition("patch", 1, 8))
    assert not {condition for _, condition in ran} & set(larger)
    assert {condition for _, condition in ran} == set(WHERE) - set(larger)
    expected = {*larger, slow} if first is stopped else set(larger)
    assert {cell.condition for cell in results.skipped} == expected
    assert {cell.condition for cell in results.cells} == set(WHERE) - expected
    assert results.skipped[-1].reason == f"a match took over 20 s at {slow}"


def test_the_default_is_left_out_nowhere(
    monkeypatch: pytest.MonkeyPatch, ran: list[tuple[str, Condition]]
) -> None:
    slow_at(monkeypatch, WHERE[0], ran, over_budget)
    results = BenchResults({})
    run_bench(results, WHERE, [DEFAULT], PLAN)
    assert (len(results.cells), results.skipped) == (len(WHERE), [])


def test_what_was_too_long_before_is_still_too_long(ran: list[tuple[str, Condition]]) -> None:
    slow = PointCell(WHERE[0], "van-wamelen", "1", 0, 1, 1.0, 2.0, 1.0, 20_001.0)
    results = BenchResults({}, [slow])
    run_bench(results, [WHERE[0], WHERE[1]], [OTHER], PLAN)
    assert ran == []
    assert [cell.condition for cell in results.skipped] == [WHERE[1]]


def test_an_interruption_leaves_what_was_found(
    monkeypatch: pytest.MonkeyPatch, ran: list[tuple[str, Condition]]
) -> None:
    def interrupted(_: PointCell) -> PointCell:
        raise KeyboardInterrupt

    slow_at(monkeypatch, WHERE[2], ran, interrupted)
    results = BenchResults({})
    with pytest.raises(KeyboardInterrupt):
        run_bench(results, WHERE, [DEFAULT], PLAN)
    assert [cell.condition for cell in results.cells] == WHERE[:2]


def test_two_processes_find_what_one_finds() -> None:
    found = []
    for workers in (1, 2):
        results = BenchResults({})
        where = [Condition("patch", 0, 2), Condition("clutter", 0, 2)]
        run_bench(results, where, [matcher_named("paper")], PLAN, workers=workers)
        cells = sorted(results.cells, key=lambda cell: where.index(cell.condition))
        found.append([(c.condition, c.matcher, c.outcomes, c.false_positives) for c in cells])
    assert found[0] == found[1]
    assert [condition for condition, *_ in found[0]] == where


def test_settings_name_what_results_depend_on() -> None:
    settings = describe_settings(PLAN, workers=2)
    assert (settings["trials"], settings["seed"], settings["budget_s"]) == (1, 0, 20.0)
    assert settings["workers"] == 2
    assert {"fpmatch", "python", "numpy", "scipy", "astroalign"} == set(settings["versions"])
    assert settings["machine"]["cpus"] >= 1
    assert settings["kernels"] in {"compiled", "interpreted"}
    check_same_settings("bench.json", settings, describe_settings(PLAN, workers=2))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"trials": 2, "seed": 5}, "trials was 2, is 1; seed was 5, is 0$"),
        ({"versions": {"scipy": "0.1"}}, "scipy was 0.1, is "),
        ({"moon": "full"}, "moon was full, is None$"),
    ],
)
def test_other_settings_are_refused(changes: dict[str, object], message: str) -> None:
    now = describe_settings(PLAN)
    with pytest.raises(FpmatchError, match=f"^bench.json: cannot resume.*: .*{message}"):
        check_same_settings("bench.json", {**now, **changes}, now)
