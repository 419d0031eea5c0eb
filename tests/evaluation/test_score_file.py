from __future__ import annotations

import csv

import pytest

from fpmatch.errors import OutputError
from fpmatch.evaluation import score_file
from fpmatch.evaluation.run import evaluate
from fpmatch.evaluation.score_file import COLUMNS, DETAILS, write_scores
from fpmatch.matching.calibration import Calibration


@pytest.fixture
def report(bench, make_database):
    folder = make_database(toml='name = "set, one"', contents={"1_2": "broken"})
    return evaluate([folder], matcher=bench.MATCHER, extractor=bench.extractor, workers=1)


def read(path):
    with path.open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def test_a_row_a_comparison(report, tmp_path):
    path = tmp_path / "scores.csv"
    write_scores(path, report)
    rows, outcomes = read(path), report.sets[0].outcomes
    assert len(rows) == 190
    assert set(rows[0]) == {*COLUMNS, *DETAILS}
    assert {row["set"] for row in rows} == {"set, one"}
    similarities = [float(row["similarity"] or 0) for row in rows]
    assert similarities == outcomes["similarity"].tolist()
    assert sum(row["genuine"] == "1" for row in rows) == 30
    assert all(
        (row["probe"].split("_")[0] == row["reference"].split("_")[0]) == (row["genuine"] == "1")
        for row in rows
    )


def test_what_does_not_exist_is_left_empty(report, tmp_path):
    path = tmp_path / "scores.csv"
    write_scores(path, report)
    rows = {(row["probe"], row["reference"]): row for row in read(path)}
    near, far = rows["1_1.tif", "1_3.tif"], rows["1_1.tif", "5_1.tif"]
    lost = rows["1_1.tif", "1_2.tif"]
    assert float(near["rotation_deg"]) == pytest.approx(5.72958)
    assert (near["reason"], near["pairs"]) == ("", "1")
    assert (far["scale"], far["tx"], far["rms_px"], far["reason"]) == ("", "", "", "too far")
    assert (lost["similarity"], lost["tx"], lost["reason"]) == ("", "", "reference: broken")
    assert {row["score"] for row in rows.values()} == {""}


def test_a_reason_stands_beside_what_does_not_match_alone(report, tmp_path, monkeypatch):
    write_scores(tmp_path / "before.csv", report)
    monkeypatch.setattr(score_file, "decide", lambda matcher, similarity: similarity > 0.01)
    write_scores(tmp_path / "after.csv", report)
    files = [read(tmp_path / f"{name}.csv") for name in ("before", "after")]
    for before, after in zip(*files, strict=True):
        matches = float(before["similarity"] or 0) > 0.01
        assert after["reason"] == ("" if matches else before["reason"])
    assert any(row["reason"] for row in files[0])


def test_scores_come_from_the_calibration(report, tmp_path, monkeypatch):
    calibration = Calibration(((0.0, 0.0), (1.0, 50.0)), tail_scale=1.0)
    monkeypatch.setattr(score_file, "calibration_of", lambda name: calibration)
    write_scores(tmp_path / "scores.csv", report)
    for row in read(tmp_path / "scores.csv"):
        assert float(row["score"] or 0) == pytest.approx(
            50 * float(row["similarity"] or 0), rel=1e-5
        )


def test_failed_write_leaves_the_old_file_and_nothing_else(report, tmp_path, monkeypatch):
    folder = tmp_path / "out"
    folder.mkdir()
    path = folder / "scores.csv"
    path.write_text("old")

    def fill_the_disk(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(score_file, "_rows", fill_the_disk)
    with pytest.raises(OutputError, match=r"scores\.csv: cannot be written: no space left"):
        write_scores(path, report)
    assert [p.name for p in folder.iterdir()] == ["scores.csv"]
    assert path.read_text() == "old"


def test_interrupted_write_leaves_nothing(report, tmp_path, monkeypatch):
    folder = tmp_path / "out"
    folder.mkdir()

    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(score_file, "_rows", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_scores(folder / "scores.csv", report)
    assert list(folder.iterdir()) == []
