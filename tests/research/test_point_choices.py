"""What the paper leaves open, measured on a few small sets."""

import json

from research.experiments import point_choices
from research.experiments.point_choices import measure_exit, measure_paper
from research.points.conditions import Condition, conditions

CONDITION = Condition("patch", 0, 2)


def test_fewer_ring_pairs_pass_a_smaller_area_tolerance():
    wide, narrow = (measure_paper(CONDITION, area, 3) for area in (0.1, 0.01))
    assert 0 < narrow["passing"] < wide["passing"] < 1
    assert (wide["model"], wide["rho"], wide["m"], wide["n"]) == ("patch", 0.95, 50, 100)
    assert wide["trials"] == 3
    assert wide["true_positives"] <= wide["true_positives_at_rho"] <= wide["true_positives_80"] <= 3
    assert (
        wide["false_positives"] <= wide["false_positives_at_rho"] <= wide["false_positives_80"] <= 3
    )
    assert min(wide["median_ms"], wide["independent_ms"]) > 0


def test_an_early_exit_is_faster_and_finds_less():
    hard = Condition("patch", 5, 2)  # ρ = 0.6
    late, early = (measure_exit(hard, per_point, 6, 1) for per_point in (0, 1))
    assert late["true_positives"] == 6
    assert early["true_positives"] < 6
    assert early["independent_ms"] < late["independent_ms"]
    assert late["longest_ms"] >= late["median_ms"] > 0


def test_every_condition_of_small_sets_is_measured(monkeypatch):
    monkeypatch.setattr(point_choices, "measure_paper", lambda *_: {"independent_ms": 7.0})
    monkeypatch.setattr(point_choices, "measure_exit", lambda *_: {"true_positives": 1})
    done = []
    found = point_choices.measure_points(8, done.append)
    small = [str(condition) for condition in conditions(largest_m=200)]
    assert done == small
    assert len(found["paper"]) == 3 * len(small)
    assert found["exits"] == [{"true_positives": 1, "paper_ms": 7.0}] * (5 * len(small))
    assert json.dumps(found)
