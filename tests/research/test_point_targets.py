"""The targets on random point sets, and the command that checks results against them."""

import json
from dataclasses import replace

import pytest

from research.experiments.point_targets import missed_targets
from research.points.conditions import Condition, conditions
from research.points.results import BenchResults, PointCell, write_results

OURS = PointCell(Condition("patch", 0, 2), "triangles", "1" * 100, 0, 100, 1.0, 1.0, 1.0, 1.0)
BASELINE = replace(OURS, matcher="van-wamelen", outcomes="1" * 17, time_ms=20.01)

PATCH = Condition("patch", 3, 8)
HALF_MISSING = Condition("patch", 5, 4)  # ρ = 0.6
EASY_CLUTTER = Condition("clutter", 12, 2)
HARD_CLUTTER = Condition("clutter", 12, 4)


def results(changes=None):
    """Return results that just reach every target, but for the changes; None leaves a cell out."""
    cells = {(one, "triangles"): replace(OURS, condition=one) for one in conditions()}
    for one in conditions(["patch"]):
        cells[one, "van-wamelen"] = replace(BASELINE, condition=one)
    for key, values in (changes or {}).items():
        cells[key] = values if values is None else replace(cells[key], **values)
    return BenchResults({}, [cell for cell in cells.values() if cell is not None])


def test_every_cell_that_has_a_target_has_to_be_there():
    assert missed_targets(results()) == []
    missed = missed_targets(BenchResults({}))
    assert sum(line.startswith("triangles, patch") for line in missed) == 39
    assert sum(line.startswith("triangles, clutter") for line in missed) == 9
    assert sum(line.startswith("van-wamelen, patch") for line in missed) == 13
    assert all(line.endswith(": not run") for line in missed)
    assert len(missed) == 61
    gone = {(PATCH, "triangles"): None, (HARD_CLUTTER, "triangles"): None}
    assert missed_targets(results(gone)) == [f"triangles, {PATCH}: not run"]
    # the baseline at n = 2m alone
    missing = Condition("patch", 4, 2)
    gone = {(missing, "van-wamelen"): None, (Condition("patch", 4, 8), "van-wamelen"): None}
    assert missed_targets(results(gone)) == [f"van-wamelen, {missing}: not run"]


@pytest.mark.parametrize(
    ("condition", "changes", "figures"),
    [
        (PATCH, {"outcomes": "1" * 98 + "00"}, "recognised 0.980, target at least 0.99"),
        (PATCH, {"false_positives": 2}, "false positives 0.020, target at most 0.01"),
        (PATCH, {"outcomes": "1" * 99}, "99 genuine and 100 independent trials"),
        (PATCH, {"independent_trials": 19}, "100 genuine and 19 independent trials"),
        (PATCH, {"time_ms": 1.01}, "time 1.010 ms, 1.01 times scipy's 1.000 ms, target at most 1 "),
        (Condition("patch", 10, 4), {"time_ms": 1.01}, "target at most 1 times"),
        (HALF_MISSING, {"time_ms": 5.05}, "5.05 times scipy's 1.000 ms, target at most 5 times"),
        (EASY_CLUTTER, {"outcomes": "1" * 94 + "0" * 6}, "recognised 0.940, target at least 0.95"),
        (EASY_CLUTTER, {"false_positives": 2}, "false positives 0.020"),
    ],
)
def test_a_cell_that_misses_is_named_with_figure_and_target(condition, changes, figures):
    (line,) = missed_targets(results({(condition, "triangles"): changes}))
    assert line.startswith(f"triangles, {condition}: ")
    assert figures in line


@pytest.mark.parametrize(
    ("condition", "changes"),
    [
        (PATCH, {"outcomes": "1" * 99 + "0", "false_positives": 1}),
        (HALF_MISSING, {"time_ms": 4.95}),
        (EASY_CLUTTER, {"outcomes": "1" * 95 + "0" * 5, "time_ms": 1000.0}),
        (HARD_CLUTTER, {"outcomes": "0" * 100, "false_positives": 100}),
        (Condition("clutter", 5, 2), {"outcomes": "0" * 100}),
    ],
)
def test_what_is_allowed_is_no_miss(condition, changes):
    speed = {(Condition("patch", 0, 2), "van-wamelen"): {"time_ms": 2000.0}}
    assert missed_targets(results({(condition, "triangles"): changes, **speed})) == []


def test_the_speed_up_is_a_geometric_mean_of_the_13_rows_at_n_2m():
    twice = {(Condition("patch", 0, 2), "van-wamelen"): {"time_ms": 40.0}}
    half = {(Condition("patch", 1, 2), "van-wamelen"): {"time_ms": 9.9}}
    other_n = {(Condition("patch", 2, 4), "van-wamelen"): {"time_ms": 0.1}}
    assert missed_targets(results({**twice, **other_n})) == []
    (line,) = missed_targets(results({**twice, **half}))
    assert line == (
        "triangles over van-wamelen, patch, n = 2m: 19.99 times as fast, target at least 20 times"
    )


def test_recognition_is_compared_on_the_pairs_that_both_tried():
    late = {(PATCH, "triangles"): {"outcomes": "1" * 50 + "0" + "1" * 49}}
    assert missed_targets(results(late)) == []
    early = {(PATCH, "triangles"): {"outcomes": "0" + "1" * 99}}
    (line,) = missed_targets(results(early))
    assert line == (
        f"triangles, {PATCH}: recognised 16 of the 17 pairs that van-wamelen tried too, "
        "target at least its 17"
    )
    both = {**early, (PATCH, "van-wamelen"): {"outcomes": "1" * 16 + "0"}}
    assert missed_targets(results(both)) == []


def test_the_exit_status_is_0_only_where_no_cell_misses(tmp_path, run_research):
    path = tmp_path / "bench.json"
    write_results(path, results())
    done = run_research("check", "points", path)
    assert (done.exit_code, done.stdout) == (0, "no cell misses a target\n")
    write_results(path, results({(PATCH, "triangles"): None}))
    done = run_research("check", "points", path)
    assert (done.exit_code, done.stdout) == (1, f"triangles, {PATCH}: not run\n")
    path.write_text(json.dumps({"rows": []}))
    done = run_research("check", "points", path)
    assert (done.exit_code, done.stdout) == (2, "")
    assert done.stderr.startswith(f"research check points: error: {path}: ")
    assert done.stderr.count("\n") == 1
