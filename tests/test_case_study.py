"""`python -m research case-study`: two prints of a folder become pictures, bad input one line."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


def test_the_first_two_impressions_of_a_folder_are_drawn(tmp_path: Path, run_research) -> None:
    pytest.importorskip("matplotlib")
    folder = tmp_path / "DB1_B"
    folder.mkdir()
    for name in ("102_1", "102_3", "103_1"):
        shutil.copy(ROOT / "sample_data" / f"{name}.tif", folder)
    done = run_research("case-study", folder, "--out", tmp_path / "out", "--format", "svg")
    assert done.exit_code == 0, done.stderr
    drawn = (tmp_path / "out" / "figure_1_prints.svg").read_text(encoding="utf-8")
    assert "P, the probe: 102_1" in drawn
    assert "Q, the reference: 102_3" in drawn
    assert len(list((tmp_path / "out").iterdir())) == len(done.stdout.splitlines())


def test_bad_input_is_said_in_one_line(tmp_path: Path, run_research) -> None:
    single = tmp_path / "single"
    single.mkdir()
    shutil.copy(ROOT / "sample_data" / "101_1.tif", single)
    for words, reason in (
        ((tmp_path / "none",), "no such folder"),
        ((ROOT / "sample_data", "--pair", "101_1", "999_9"), "contains no print 999_9"),
        ((single,), "contains one impression of its first finger"),
    ):
        done = run_research("case-study", *words, "--out", tmp_path / "out")
        assert (done.exit_code, done.stdout) == (2, "")
        assert reason in done.stderr
        assert done.stderr.count("\n") == 1
