import csv
import json

import numpy as np
import pytest

from fpmatch.errors import OutputError
from fpmatch.lab.evaluation.rates.bootstrap import bootstrap_rates
from fpmatch.lab.evaluation.rates.error_rates import error_curves
from fpmatch.lab.evaluation.rates.intervals import ExactBound
from fpmatch.lab.evaluation.rates.scores_set import unnamed_set
from fpmatch.lab.evaluation.report.analysis import analyse
from fpmatch.lab.evaluation.report.curves import HEADS, prepare_curves, write_curves
from fpmatch.lab.evaluation.report.operating_points import operating_points
from fpmatch.lab.evaluation.report.score_reports import summarise_scores


def test_points_have_the_definition_and_lie_in_their_intervals(report):
    found = operating_points(report, [0.01, 0.05], bootstrap=200)
    assert [(p.name, p.fmr) for p in found[:2]] == [("set, one", 0.01), ("set, one", 0.05)]
    assert [p.name for p in found[4:]] == ["pooled", "pooled"]
    every = [*(row.scores.split() for row in report.sets)]
    for point, (genuine, impostor) in zip(found[::2], every, strict=False):
        assert np.mean(impostor >= point.threshold) <= point.fmr
        assert point.fnmr == np.mean(genuine < point.threshold)
        assert point.interval.low <= point.fnmr <= point.interval.high
    assert report.sets[0].rates.fmr100 == found[0].fnmr
    analysis = analyse(report, bootstrap=50, fmrs=[0.05])
    document = json.loads(json.dumps(analysis.as_json()))
    assert [point["fmr"] for point in document["fnmr_at_fmr"]] == [0.05] * 3
    assert "FNMR at FMR" in analysis.as_text()
    assert "threshold" in analysis.as_text()


def test_an_fmr_below_one_impostor_has_no_point(report):
    for point in operating_points(report, [1e-6], bootstrap=10):
        assert (point.fnmr, point.threshold, point.interval) == (None, None, None)


def test_thresholds_of_distances_are_distances():
    scores = unnamed_set(np.array([-1.0, -2.0, -9.0]), -np.arange(3.0, 13.0), distances=True)
    found = operating_points(summarise_scores([scores]), [0.1], bootstrap=0)
    assert [(p.fnmr, p.threshold) for p in found] == [(pytest.approx(1 / 3), 3.0)] * 2


def test_a_threshold_that_no_pair_reaches_is_none():
    scores = unnamed_set(np.zeros(12), np.zeros(12))
    (point, _) = operating_points(summarise_scores([scores]), [0.5], bootstrap=20)
    assert (point.fnmr, point.threshold) == (1.0, None)
    assert point.interval == (pytest.approx(0.05 ** (1 / 12)), 1.0)
    assert point.bound == ExactBound("comparison", 12)


def test_single_comparisons_are_drawn_where_fingers_are_unknown():
    # The share of rejected genuine scores scatters as a binomial share does.
    rng = np.random.default_rng(3)
    genuine, impostor = rng.normal(2, 1, 400), rng.normal(0, 1, 20_000)
    scores = unnamed_set(genuine, impostor)
    drawn = bootstrap_rates([scores.trials], 400, 0, [0.01])
    rate = summarise_scores([scores]).pooled.fmr100
    expected = np.sqrt(rate * (1 - rate) / genuine.size)
    assert drawn.pooled[:, 1].mean() == pytest.approx(rate, abs=0.02)
    assert drawn.pooled[:, 1].std() == pytest.approx(expected, rel=0.25)
    again = bootstrap_rates([scores.trials], 400, 0, [0.01])
    np.testing.assert_array_equal(drawn.sets, again.sets)
    two = bootstrap_rates([scores.trials, scores.trials], 20, 0)
    assert two.pooled.shape == (20, 4)


def test_curves_are_tables(report, tmp_path):
    analysis = analyse(report, bootstrap=0, fmrs=[0.01])
    files = write_curves(tmp_path / "new" / "folder", [analysis, analysis])
    assert [file.name for file in files] == list(HEADS)
    tables = [list(csv.DictReader(file.read_text().splitlines())) for file in files]
    for file, rows in zip(files, tables, strict=True):
        assert tuple(rows[0]) == HEADS[file.name]
        assert [row["set"] for row in rows].count("pooled") > 2
    det, histogram = tables
    row, first = report.sets[0], [one for one in det if one["set"] == "set, one"]
    first = first[: len(first) // 2]  # of the first matcher
    whole = error_curves(*row.scores.split())
    fmr, fnmr = (np.array([float(one[name]) for one in first]) for name in ("fmr", "fnmr"))
    assert (fmr[0], fnmr[0], fmr[-1], fnmr[-1]) == (1, 0, 0, 1)
    assert {*zip(fmr, fnmr, strict=True)} <= {*zip(whole.fmr, whole.fnmr, strict=True)}
    area, same = np.trapezoid(fnmr, fmr), np.trapezoid(whole.fnmr, whole.fmr)
    assert area == pytest.approx(same)  # the line is the same
    counted = [int(one["genuine"]) for one in histogram if one["set"] == "set, one"]
    assert sum(counted) == 2 * row.genuine


def test_a_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="cannot be made a folder"):
        prepare_curves(tmp_path / "file" / "below")
