"""`fpmatch score`: what it prints, and what becomes of bad input."""

from __future__ import annotations

import csv
import json
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest
from PIL import Image, ImageOps

from fpmatch.evaluation.batch import score as scoring
from fpmatch.image.quality.polarity import INVERTED

from .conftest import assert_refused


@pytest.fixture
def pair(prints: Path, tmp_path: Path) -> Path:
    """Return a folder of two prints of one finger."""
    folder = tmp_path / "pair"
    folder.mkdir()
    for name in ("1_1.png", "1_2.png"):
        shutil.copy(prints / name, folder)
    return folder


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


def test_all_pairs_of_two_folders(run: Any, pair: Path, tmp_path: Path) -> None:
    output = tmp_path / "scores.csv"
    result = run("score", "--references", pair, "--probes", pair, "-o", output, "--workers", 1)
    assert result.exit_code == 0
    assert result.stderr == ""
    counts, written = result.stdout.splitlines()
    assert counts.startswith("2 probes against 2 references: 4 pairs: ")
    assert counts.endswith(" a second)")
    assert written == f"{output}: 4 rows"
    names = [(r["probe"], r["reference"]) for r in rows(output)]
    assert names == [(p, r) for p in ("1_1.png", "1_2.png") for r in ("1_1.png", "1_2.png")]
    assert rows(output)[1]["score"] == rows(output)[2]["score"]


def test_failures_are_rows_lines_and_status_1(
    run: Any, prints: Path, pair: Path, tmp_path: Path
) -> None:
    for name in ("text.png", "truncated.png", "untagged.tif"):
        shutil.copy(prints / name, pair)
    listed, output = tmp_path / "list.csv", tmp_path / "scores.csv"
    listed.write_text("probe,reference\n1_1,untagged\ntext,1_1\n1_1,truncated\ntext,text\n")
    words = ("score", "--references", pair, "--probes", pair, "--pairs", listed, "-o", output)
    result = run(*words, "--workers", 1, "--json")
    assert result.exit_code == 1
    assert [bool(r["score"]) for r in rows(output)] == [True, False, False, False]
    assert rows(output)[1]["reason"] == "probe: not an image of a known format"
    assert rows(output)[3]["reason"].count("not an image of a known format") == 2
    assert rows(output)[2]["reason"].startswith("reference: ")
    note, *failed = result.stderr.splitlines()
    assert note.startswith("fpmatch: note: ")
    assert "untagged.tif: 500 dpi assumed" in note
    assert [line.split(": ")[3] for line in failed] == ["text.png", "truncated.png"]
    document = json.loads(result.stdout)
    assert (document["pairs"], document["failed_pairs"], document["rows"]) == (4, 3, 4)
    assert [f["name"] for f in document["failures"]] == ["text.png", "truncated.png"]


@pytest.mark.parametrize("workers", [1, 2])
def test_what_was_noticed_on_reading_is_said_once(
    run: Any, pressed: Any, tmp_path: Path, workers: int
) -> None:
    pair = tmp_path / "pair"
    pair.mkdir()
    for name, image in zip(("2_1", "2_2"), pressed[:2], strict=True):
        ImageOps.invert(Image.fromarray(image)).save(pair / f"{name}.png", dpi=(500, 500))
    output = tmp_path / "scores.csv"
    words = ("score", "--references", pair, "--probes", pair, "-o", output, "--workers", workers)
    result = run(*words, "--json")
    assert result.stderr == f"fpmatch: note: {pair}: 2_1.png and 1 other: {INVERTED}\n"
    told = [f"{pair}: 2_1.png", f"{pair}: 2_2.png"]
    assert json.loads(result.stdout)["notes"] == [{"note": INVERTED, "prints": told}]


def test_a_calibration_of_one_s_own(run: Any, pair: Path, tmp_path: Path) -> None:
    fitted = tmp_path / "calibration.json"
    fitted.write_text(
        '{"provenance": {"sets": [], "impostors": 0, "version": "", "command": ""},'
        '"tail_scale": 1, "tail_shape": 0, "knots": [[0, 0], [1e9, 17]]}'
    )
    output = tmp_path / "scores.csv"
    words = ("score", "--references", pair, "--probes", pair, "-o", output, "--workers", 1)
    assert run(*words, "--calibration", fitted, "--threshold", 18).exit_code == 0
    assert rows(output) == []
    assert run(*words, "--calibration", fitted).exit_code == 0
    assert all(0 < float(r["score"]) < 17 for r in rows(output))


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["--references", "{0}/nowhere"], "nowhere: no such file or folder"),
        (["--probes", "{0}/empty"], "empty: the folder holds no images"),
        (["--probes", "{0}/list.csv"], "list.csv: not a gallery"),
        (["--pairs", "{0}/list.csv"], "list.csv: line 1: there is no probe 'x'"),
        (["--pairs", "{0}/gone.csv"], "gone.csv: cannot be read: no such file"),
        (["-o", "{0}/scores.xlsx"], "scores.xlsx: scores are written as .csv or .parquet"),
        (["-o", "{0}/nowhere/s.csv"], "s.csv: cannot be written: no such file or directory"),
        (["--matcher", "nobody"], "unknown matcher 'nobody'"),
        (["--threshold", "200"], "threshold must lie in 0..100, not 200"),
        (["--calibration", "{0}/list.csv"], "list.csv: not a calibration file"),
        (["--dpi", "7"], "7 dpi is outside the usable range"),
    ],
)
def test_bad_input_is_one_line_and_status_2(
    run: Any, pair: Path, tmp_path: Path, words: list[str], reason: str
) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "list.csv").write_text("x,y\n")
    usual = ["--references", pair, "--probes", pair, "-o", tmp_path / "scores.csv"]
    result = run("score", *usual, "--workers", 1, *(word.format(tmp_path) for word in words))
    assert_refused(result, reason)
    assert not list(tmp_path.glob("scores*"))


def test_no_scheduler_is_one_line_and_status_2(
    run: Any, pair: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("distributed", reason="Dask (extra dask) is not installed")
    from fpmatch.engine import cluster

    monkeypatch.setattr(cluster, "CONNECT_S", 0.3)
    usual = ("--references", pair, "--probes", pair, "-o", tmp_path / "scores.csv")
    result = run("score", *usual, "--scheduler", "tcp://127.0.0.1:1")
    assert_refused(result, "tcp://127.0.0.1:1: no Dask scheduler answers")
    result = run("score", *usual, "--scheduler", "tcp://127.0.0.1:1", "--workers", 2)
    assert result.exit_code == 2
    assert "--workers and --scheduler exclude each other" in result.stderr


def test_interrupted_it_says_how_to_go_on(
    run: Any, pair: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(scoring, "score", interrupted)
    output = tmp_path / "scores.csv"
    result = run("score", "--references", pair, "--probes", pair, "-o", output)
    assert result.exit_code == 130
    assert result.stderr == "fpmatch: note: the same command resumes the run\n"


def test_help_tells_of_columns_order_and_status(run: Any) -> None:
    text = run("score", "--help").stdout
    assert "  probe, reference  the prints" in text
    assert "OUT.unfinished" in text
    assert "Exit status: 0" in text


def test_every_stage_has_a_bar(run: Any, pair: Path, tmp_path: Path) -> None:
    told: list[str] = []
    scoring.score(
        pair, str(pair), tmp_path / "scores.csv", progress=lambda stage, *_: told.append(stage)
    )
    assert set(told) < set(sys.modules["fpmatch.cli.score"]._STAGES)


def test_scores_of_fingers_are_written_beside_those_of_pairs(
    run: Any, pair: Path, tmp_path: Path
) -> None:
    output, fingers = tmp_path / "scores.csv", tmp_path / "fingers.csv"
    words = ("score", "--references", pair, "--probes", pair, "-o", output, "--workers", 1)
    result = run(*words, "--fingers", fingers)
    assert result.exit_code == 0
    assert result.stdout.splitlines()[-1] == f"{fingers}: 2 rows"
    found = rows(fingers)
    assert [(row["probe"], row["finger"], row["impressions"]) for row in found] == [
        ("1_1.png", "1", "1"),
        ("1_2.png", "1", "1"),
    ]
    other = {(row["probe"], row["reference"]): row["score"] for row in rows(output)}
    assert float(found[0]["score"]) == pytest.approx(float(other["1_1.png", "1_2.png"]))


@pytest.mark.parametrize("matcher", ["unit-circle", "paper"])
def test_scores_of_fingers_need_all_scores_and_another_file(
    run: Any, pair: Path, tmp_path: Path, matcher: str
) -> None:
    output, fingers = tmp_path / "scores.csv", tmp_path / "fingers.csv"
    words = ("score", "--references", pair, "--probes", pair, "-o", output, "--matcher", matcher)
    for extra, reason in (
        ((fingers, "--threshold", 40), "no threshold"),
        ((output,), "both the scores of pairs and those of fingers"),
    ):
        result = run(*words, "--workers", 1, "--fingers", *extra)
        assert result.exit_code == 2
        assert reason in result.stderr
    assert not output.exists()
    assert not fingers.exists()
