import numpy as np
import pytest

from fpmatch.errors import DatasetError, OutputError
from fpmatch.gallery.batch import decision
from fpmatch.gallery.batch.score_file import COLUMNS, DETAILS
from fpmatch.lab.evaluation.rates.scores import choose_matcher, read_scores
from fpmatch.lab.evaluation.report import score_rows
from fpmatch.lab.evaluation.report.score_rows import write_scores
from fpmatch.matching.calibration import Calibration
from tests.conftest import rows_of


@pytest.fixture(scope="module")
def scores(report, tmp_path_factory):
    path = tmp_path_factory.mktemp("scores") / "scores.csv"
    write_scores(path, report)
    return path


def test_a_row_a_comparison(report, scores):
    rows = rows_of(scores)
    assert set(rows[0]) == {*COLUMNS, *DETAILS}
    assert {row["set"] for row in rows} == {"set, one", "b"}
    expected = [value for row in report.sets for value in row.outcomes["similarity"].tolist()]
    assert [float(row["similarity"] or 0) for row in rows] == expected
    assert sum(row["genuine"] == "1" for row in rows) == report.genuine
    for row in rows:
        fingers = [row[side].split("_")[0] for side in ("probe", "reference")]
        assert (fingers[0] == fingers[1]) == (row["genuine"] == "1")


def test_what_does_not_exist_is_left_empty(scores):
    rows = {(row["probe"], row["reference"]): row for row in rows_of(scores)[: 24 * 23 // 2]}
    near, far = rows["1_1.tif", "1_3.tif"], rows["1_1.tif", "5_1.tif"]
    lost = rows["1_1.tif", "1_2.tif"]
    assert float(near["rotation_deg"]) == pytest.approx(5.72958)
    assert (near["reason"], near["pairs"]) == ("", "1")
    assert (far["scale"], far["tx"], far["rms_px"], far["reason"]) == ("", "", "", "too far")
    assert (lost["similarity"], lost["tx"], lost["reason"]) == ("", "", "reference: broken")
    assert {row["score"] for row in rows.values()} == {""}


def test_a_calibration_makes_scores_and_a_match_has_no_reason(
    report, scores, tmp_path, monkeypatch
):
    calibration = Calibration(((0.0, 0.0), (0.01, 40.0)), tail_scale=1.0)
    monkeypatch.setattr(score_rows, "calibration_of", lambda name: calibration)
    monkeypatch.setattr(decision, "calibration_of", lambda name: calibration)
    write_scores(tmp_path / "after.csv", report)
    before, after = rows_of(scores), rows_of(tmp_path / "after.csv")
    for old, new in zip(before, after, strict=True):
        similarity = float(new["similarity"] or 0)
        assert (new["decision"] == "match") == (similarity >= 0.01)
        assert new["reason"] == ("" if similarity >= 0.01 else old["reason"])
        assert float(new["score"] or 0) == pytest.approx(calibration.score(similarity), rel=1e-5)
    assert any(row["reason"] for row in before)


@pytest.mark.parametrize("old", ["old", None])
@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_a_failed_write_leaves_the_old_file_and_nothing_else(
    report, tmp_path, monkeypatch, old, error
):
    path = tmp_path / "scores.csv"
    if old:
        path.write_text(old)

    def fail(*_):
        raise error

    monkeypatch.setattr(score_rows, "_rows", fail)
    with pytest.raises((OutputError, KeyboardInterrupt)) as caught:
        write_scores(path, report)
    assert caught.type is KeyboardInterrupt or str(caught.value).endswith("no space left on device")
    assert [p.read_text() for p in tmp_path.iterdir()] == ([old] if old else [])


def test_what_was_written_is_read(report, scores):
    found = read_scores(scores)
    assert [(s.matcher, s.name) for s in found] == [("fake", "set, one"), ("fake", "b")]
    for row, again in zip(report.sets, found, strict=True):
        expected = row.scores.trials
        assert again.trials.similarity.tolist() == expected.similarity.tolist()
        assert again.trials.genuine.tolist() == row.pairs.genuine.tolist()
        assert again.trials.fingers == expected.fingers
        np.testing.assert_array_equal(again.trials.probe, expected.probe)
        names = [i.path.name for i in row.extracted.dataset.impressions]
        assert [again.prints[i] for i in again.probe] == [names[i] for i in row.pairs.probe]
        assert (again.compared == (row.outcomes["reason"] != "no template")).all()
    with pytest.raises(DatasetError, match=r"s\.csv: holds scores of fake, none of paper"):
        choose_matcher(found, "paper", "s.csv")
