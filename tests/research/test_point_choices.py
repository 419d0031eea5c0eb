import json

import numpy as np

from research.experiments import point_choices
from research.experiments.point_choices import measure_exit, measure_paper
from research.points.conditions import Condition, conditions
from research.tables.points import PARTS, RHOS, count_accepted, format_paper_choices

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


def counted(name="one"):
    similarity = np.array([0.9, 0.61, 0.6, 0.55, 0.8, 0.5, 0.1, 0.2])
    genuine = np.array([True] * 4 + [False] * 4)
    return count_accepted(name, similarity, genuine)


def results():
    place = {"model": "patch", "rho": 0.6, "m": 50, "trials": 5}
    rules = ("", "_at_rho", "_80")
    answers = {f"true_positives{rule}": 3 + k for k, rule in enumerate(rules)}
    answers |= {f"false_positives{rule}": k for k, rule in enumerate(rules)}
    paper = [
        {**place, **answers, "n": n, "area_tolerance": area, "passing": area, "median_ms": ms}
        for n in (100, 200)
        for area, ms in ((0.1, 8.0), (0.01, 2.0))
    ]
    times = {"true_positives": 5, "median_ms": 1.0, "longest_ms": 4.0, "paper_ms": 10.0}
    exits = [
        {
            **{**place, **times, "model": model, "n": 50 * factor},
            **{"proposals_per_point": each, "independent_ms": 1.0 if each else 200.0},
        }
        for model in ("patch", "clutter")
        for factor in (2, 4, 8)
        for each in (16, 0)
    ]
    sets = [counted(), counted("two")]
    prints = [{"area_tolerance": area, "ms": 1.25, "sets": sets} for area in (0.1, 0.01)]
    return {"prints": prints, "paper": paper, "exits": exits}


def test_more_than_rho_is_accepted():
    assert RHOS == (0.5, 0.6, 0.7, 0.9)
    assert counted() == {
        "name": "one",
        "genuine": 4,
        "impostor": 4,
        "accepted": [[4, 1], [2, 1], [1, 1], [0, 0]],
    }


def test_every_part_of_the_page_has_its_table():
    tables = format_paper_choices(results())
    assert tuple(tables) == PARTS
    decision = tables["decision"].splitlines()
    assert decision[0].startswith("|  | ρ = 0.5: genuine | ρ = 0.5: impostor | ρ = 0.6: genuine |")
    assert decision[2].startswith("| one | 100.0 % | 25.00 % | 50.0 % | 25.00 % |")
    assert decision[-1].startswith("| all | 100.0 % | 25.00 % |")
    assert "| 0.01 | 50.0 % | 25.00 % | 0.0 % | 0.00 % | 1.25 |" in tables["area"]
    assert "| patch | 0.6 | 0.1 | 10.0 to 10.0 % | 1.0 (1.0 to 1.0) | 6/10 |" in tables["area"]
    assert "| patch | 0.6 | 0.01 | 1.0 to 1.0 % | 4.0 (4.0 to 4.0) | 6/10 |" in tables["area"]
    assert "| patch | 0.6 | 6/10 | 0/10 | 8/10 | 2/10 | 10/10 | 4/10 |" in tables["rule"]
    assert "| all |  | 6/10 | 0/10 | 8/10 | 2/10 | 10/10 | 4/10 |" in tables["rule"]


def test_a_no_is_set_beside_a_yes_and_the_papers_no():
    lines = format_paper_choices(results())["exit"].splitlines()
    assert lines[2] == ("| 16 | 0/0 | 15/15 | 5/5 | 5/5 | 5/5 | - | 1.0 (1.0 to 1.0) | 0 of 3 |")
    assert lines[3].startswith("| the default | ")
    assert lines[3].endswith("| 200.0 (200.0 to 200.0) | 3 of 3 |")
    assert lines[-1].startswith("In the patch cells the slowest of 5 genuine pairs takes - (ρ ≥ ")
    assert lines[-1].endswith("and 4.0 (4.0 to 4.0) (ρ = 0.6) times as long as the median one.")
