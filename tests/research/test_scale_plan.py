import json
import math
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import FpmatchError
from fpmatch.gallery.index.loss import DEFAULT_LOSS
from research.commands import research
from research.scale.command import search_calls
from research.scale.constants import STAGES, Assumptions, Constants
from research.scale.plan import limits, make_plan
from research.scale.simulate import loss_row, simulate

CONSTANTS = Constants(
    delaunay_us=78.0,
    enrol_us=150.0,
    index_us=dict.fromkeys(STAGES, 80.0),
    index_bytes={"lists": 450.0, "descriptors": 900.0, "templates": 750.0},
    database_bytes=3000.0,
    search=[(10_000, 0.01), (1_000_000, 0.1), (10_000_000, 0.4)],
)
EVEN = replace(Assumptions(), spread=0.0, jitter=0.0, front_ms=0.0, network_ms=0.0)


def document():
    return {name: getattr(CONSTANTS, name) for name in Constants.__dataclass_fields__}


def test_the_time_of_a_search_is_that_measured_and_grows_as_it_did():
    for prints, taken in CONSTANTS.search:
        assert CONSTANTS.search_s(prints) == pytest.approx(taken)
    assert CONSTANTS.search_s(100_000_000) == pytest.approx(4.0)  # ten times that of a tenth
    assert CONSTANTS.search_s(100_000) == pytest.approx(math.sqrt(0.01 * 0.1))


@given(
    st.integers(1, 10**10),
    st.floats(0.01, 1000),
    st.floats(1, 2000),
    st.integers(1, 5),
    st.floats(0.05, 0.95),
)
def test_a_plan_fits_into_memory_and_is_not_overloaded(prints, rate, memory, replicas, utilisation):
    a = replace(Assumptions(), memory_gb=memory, replicas=replicas, utilisation=utilisation)
    plan = make_plan(prints, rate, CONSTANTS, a)
    bytes_each = prints / plan.shards * CONSTANTS.print_bytes
    assert bytes_each <= memory * 1e9 * a.memory_share * (1 + 1e-9)
    assert plan.replicas >= replicas
    assert plan.utilisation <= utilisation * (1 + 1e-9)
    assert plan.fan_out >= 1 - 1e-9
    fewer = make_plan(prints, rate / 2, CONSTANTS, a)
    assert fewer.machines <= plan.machines


def test_a_queue_waits_as_long_as_pollaczek_and_khinchine_say():
    plan = replace(make_plan(10_000_000, 10.0, CONSTANTS, EVEN), shards=1, replicas=1)
    for used in (0.3, 0.7):
        run = simulate(plan, EVEN, rate=used / plan.service_s, probes=40_000)
        wait = used * plan.service_s / (2 * (1 - used))
        assert run.latency.mean() == pytest.approx(plan.service_s + wait, rel=0.05)
        assert run.whole.all()


def test_the_answer_waits_for_the_last_shard():
    a = replace(EVEN, jitter=0.3)
    one = make_plan(10_000_000, 1e-3, CONSTANTS, a)
    medians = []
    for shards in (1, 10, 100):
        run = simulate(replace(one, shards=shards), a, rate=1e-3, probes=2_000)
        medians.append(np.median(run.latency))
    assert medians == sorted(medians)
    assert medians[2] > 1.5 * medians[0]


def test_without_another_replica_answers_lack_the_lost_shard():
    plan = make_plan(100_000_000, 50.0, CONSTANTS, Assumptions())
    alone = loss_row(plan, Assumptions(), replicas=1, down_s=30.0)
    both = loss_row(plan, Assumptions(), replicas=plan.replicas, down_s=30.0)
    assert (alone["partial"], both["partial"]) == (1.0, 0.0)
    assert both["meanwhile_s"][2] >= both["before_s"][2]


def test_limits_are_in_the_order_in_which_they_are_reached():
    rows = limits(CONSTANTS, Assumptions())
    reached = [prints for prints, _, _ in rows]
    assert reached == sorted(reached)
    assert rows[0][:2] == (pytest.approx(0.7 * 64e9 / 2100), "memory of one machine")


@pytest.mark.slow
def test_the_command_plans_and_says_what_it_assumed(tmp_path):
    given_file, made = tmp_path / "constants.json", tmp_path / "plan.json"
    given_file.write_text(json.dumps(document()))
    words = ["scale", "plan", str(given_file), "--cores", "64", "--json", str(made)]
    result = CliRunner().invoke(research, words)
    assert result.exit_code == 0, result.output
    found = json.loads(made.read_text())
    assert found["assumptions"]["cores"] == 64
    assert [plan["prints"] for plan in found["plans"]] == [10**7, 10**8, 10**9]
    assert "| prints | 10,000,000 | 100,000,000 | 1,000,000,000 |" in result.output


BAD = [
    ({"enrol_us": 0.0}, "a number is impossible"),
    ({"enrol_us": "x"}, "constants of a plan"),
    ({"search": [[10, 1.0]]}, "a number is impossible"),
    ({"search": [[10, 1.0], [5, 2.0]]}, "a number is impossible"),
    ({"search": [[10, 1.0], [50, float("inf")]]}, "a number is impossible"),
    ({"index_bytes": {"lists": -1.0}}, "a number is impossible"),
    ({"index_us": None}, "constants of a plan"),
]


@pytest.mark.parametrize(("change", "message"), BAD)
def test_impossible_constants_are_refused(change, message):
    with pytest.raises(FpmatchError, match=message):
        Constants.from_dict({**document(), **change})


def test_searches_without_a_mate_count_by_their_calls_of_delaunay():
    by_default = {"plan": {"loss": DEFAULT_LOSS}, "threshold": 0.0}
    rows = [
        {"prints": 100, "calls": 5, **by_default},
        {"prints": 10, "calls": 1.5, **by_default},
        {"prints": 10, "calls": 7, **by_default, "threshold": 70.0},
        {"prints": 10, "calls": 9, **by_default, "plan": {"loss": DEFAULT_LOSS / 2}},
    ]
    assert search_calls({"speed": rows}) == [(10, 1.5), (100, 5.0)]


@pytest.mark.parametrize(
    "wrong", [None, [], {}, {"speed": [{}]}, {"speed": 3}, {"speed": [{"prints": 1, "calls": []}]}]
)
def test_documents_of_another_kind_are_refused(wrong, tmp_path):
    with pytest.raises(FpmatchError):
        Constants.from_dict(wrong)
    with pytest.raises(FpmatchError):
        search_calls(wrong)
    path = tmp_path / "wrong.json"
    path.write_text(json.dumps(wrong))
    result = CliRunner().invoke(research, ["scale", "plan", str(path)])
    assert result.exit_code == 2
    assert len(result.stderr.splitlines()) == 1


def test_an_assumption_that_is_not_positive_is_refused(tmp_path):
    path = tmp_path / "constants.json"
    path.write_text(json.dumps(document()))
    result = CliRunner().invoke(research, ["scale", "plan", str(path), "--cores", "0"])
    assert result.exit_code == 2
    assert "cores: 0 is not positive" in result.stderr
