"""The benchmarks: results become ratios and numbers, and an ablation counts what is lost."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest
from ablation import Pairs, rows_of

from research.tables import FORMS

ROOT = Path(__file__).resolve().parents[2]
SPEED = ROOT / "research" / "benchmarks" / "speed"
sys.path.append(str(SPEED))

from measures import MEASURES, measured  # noqa: E402


def timed(group, side, *seconds, calls=1, **extra):
    result = {"group": group, "params": {"side": side}, "stats": {"data": list(seconds)}}
    return {**result, "extra_info": {"calls": calls, **extra}}


def test_how_many_times_as_fast_is_a_ratio_of_medians():
    ours = [timed("extraction", "ours", 0.02, 9.0, 0.02), timed("extraction", "ours", 0.02)]
    (measure,) = measured([*ours, timed("extraction", "yardstick", 0.2, 0.2, 0.1)])
    assert measure["value"] == pytest.approx(10)
    assert (measure["ok"], measure["target"]) == (False, ">= 12")
    assert (measure["ours"], measure["yardstick"].rpartition(": ")[2]) == ("20 ms", "200 ms")


@pytest.mark.parametrize(
    ("name", "ours", "yardstick", "calls", "value"),
    [
        ("preparation", 0.01, 0.005, 50, 2),
        ("extraction of four times the foreground", 0.5, 0.1, 1, 1.25),  # the work of several
    ],
)
def test_the_time_of_a_call_is_a_share_of_the_yardsticks(name, ours, yardstick, calls, value):
    sides = (("ours", ours), ("yardstick", yardstick))
    (measure,) = measured([timed(name, side, time, calls=calls) for side, time in sides])
    assert measure["value"] == pytest.approx(value)
    assert measure["ok"] is True


def test_a_number_stands_as_it_is():
    extra = {"value": 88.0, "yardstick": 44.0}
    (measure,) = measured([{"group": "extraction, peak memory", "extra_info": extra}])
    assert (measure["value"], measure["ours"], measure["ok"]) == (88.0, "88 MB", True)


def test_every_figure_has_its_benchmark_and_every_benchmark_its_figure():
    sources = "\n".join(path.read_text(encoding="utf-8") for path in SPEED.glob("bench_*.py"))
    marks = r'^@(?:cpu|cpu_of_processes|wall)\("([^"]+)"\)'
    groups = re.findall(marks, sources, flags=re.MULTILINE)
    assert sorted(groups) == sorted(measure.name for measure in MEASURES)


def test_the_losses_are_those_against_the_first_scores():
    genuine = np.arange(2000) < 10
    right = np.where(genuine, 5.0, 0.0) + 1e-6 * np.arange(2000)
    lost = np.where(np.arange(2000) < 3, -1.0, right)
    pairs = [dict.fromkeys(FORMS, Pairs(genuine, *(genuine,) * 5))]
    every = [[dict.fromkeys(FORMS, scores)] for scores in (right, lost)]
    first, second = rows_of(["all", "without"], every, pairs)
    for form in FORMS:
        assert first[form]["lost"] == {"eer": 0.0, "fmr1000": 0.0}
        assert second[form]["lost"]["fmr1000"] == pytest.approx(0.3)
        assert (first[form]["fmr1000"], second[form]["fmr1000"]) == (0.0, 0.3)
