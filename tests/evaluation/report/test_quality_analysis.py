"""`fpmatch.evaluation.report.quality` and `curves`: errors by quality and overlap, as files."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from fpmatch.errors import OutputError
from fpmatch.evaluation.rates.error_rates import error_curves
from fpmatch.evaluation.report.analysis import analyse
from fpmatch.evaluation.report.curves import HEADS, prepare_curves, write_curves
from fpmatch.evaluation.report.quality import analyse_quality
from fpmatch.evaluation.report.score_reports import summarise_scores


@pytest.fixture(scope="module")
def graded(report):
    """Return the scores of the report with qualities that predict its errors."""
    rng, sets = np.random.default_rng(2), []
    for row in report.sets:
        scores = row.scores
        pairs = scores.trials.genuine & scores.compared
        sums = np.zeros(len(scores.prints))
        np.add.at(sums, scores.probe[pairs], scores.trials.similarity[pairs])
        np.add.at(sums, scores.reference[pairs], scores.trials.similarity[pairs])
        quality = np.argsort(np.argsort(sums)) * 100 / len(sums) + rng.random(len(sums))
        quality[np.isin(scores.prints, scores.never_compared)] = np.nan
        sets.append(replace(scores, quality=quality))
    return summarise_scores(sets)


def test_discarding_bad_prints_lowers_the_fnmr(graded):
    found = analyse_quality(graded, [0.01])
    assert [c.name for c in found.curves] == ["set, one", "b", "pooled"]
    for curve in found.curves:
        assert curve.fnmr[0] > curve.fnmr[-1]
        assert curve.genuine[0] > curve.genuine[-1]
    assert sum(one.genuine for one in found.by_quality) == graded.genuine
    assert found.by_quality[0].fnmr > found.by_quality[-1].fnmr
    compared = sum(int((r.scores.trials.genuine & r.scores.compared).sum()) for r in graded.sets)
    assert sum(one.genuine for one in found.by_overlap) == compared
    document = json.loads(json.dumps(found.as_json()))
    assert document["error_vs_discard"][0]["fnmr"] == list(found.curves[0].fnmr)
    assert "of the worst prints discarded" in analyse(graded, bootstrap=0, fmrs=[0.01]).as_text()


def test_nothing_is_told_without_quality_overlap_or_impostors(report, graded):
    bare = summarise_scores([replace(row.scores, overlap=None) for row in report.sets])
    assert analyse_quality(bare) is None
    assert analyse_quality(report).curves == ()
    assert analyse_quality(graded, [1e-6]) is None
    some = [
        replace(row.scores, quality=np.r_[np.nan, row.scores.quality[1:]]) for row in graded.sets
    ]
    assert analyse_quality(summarise_scores(some)).curves == ()


def test_curves_are_three_tables(graded, tmp_path):
    analysis = analyse(graded, bootstrap=0, fmrs=[0.01])
    files = write_curves(tmp_path / "new" / "folder", [analysis, analysis])
    assert [file.name for file in files] == list(HEADS)
    tables = [list(csv.DictReader(file.read_text().splitlines())) for file in files]
    for file, rows in zip(files, tables, strict=True):
        assert tuple(rows[0]) == HEADS[file.name]
        assert [row["set"] for row in rows].count("pooled") > 2
    det, histogram, discard = tables
    row, first = graded.sets[0], [one for one in det if one["set"] == "set, one"]
    first = first[: len(first) // 2]  # of the first matcher
    whole = error_curves(*row.scores.split())
    fmr, fnmr = (np.array([float(one[name]) for one in first]) for name in ("fmr", "fnmr"))
    assert (fmr[0], fnmr[0], fmr[-1], fnmr[-1]) == (1, 0, 0, 1)
    assert {*zip(fmr, fnmr, strict=True)} <= {*zip(whole.fmr, whole.fnmr, strict=True)}
    area, same = np.trapezoid(fnmr, fmr), np.trapezoid(whole.fnmr, whole.fmr)
    assert area == pytest.approx(same)  # the line is the same
    counted = [int(one["genuine"]) for one in histogram if one["set"] == "set, one"]
    assert sum(counted) == 2 * row.genuine
    assert [one["discarded"] for one in discard[:2]] == ["0.0", "0.05"]


def test_a_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="cannot be made a folder"):
        prepare_curves(tmp_path / "file" / "below")
