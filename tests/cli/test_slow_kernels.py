"""The note of commands that do much work, where kernels are not compiled."""

import json
from pathlib import Path

import pytest

from fpmatch.base import kernels
from fpmatch.base.kernels import SLOWER, slow_kernels_note

ROOT = Path(__file__).parents[2]
NOTE = "fpmatch: note: 2 of 3 kernels are not compiled"
BENCHMARK = "evaluate, kernels interpreted"


@pytest.fixture
def some_interpreted(monkeypatch):
    """Let two of three kernels be not compiled, and commands note it."""
    found = dict(zip("abc", (True, False, False), strict=True))
    monkeypatch.setattr(kernels, "compiled_kernels", lambda: found)
    monkeypatch.setattr(kernels, "slow_kernels_note", slow_kernels_note)


@pytest.fixture
def images(prints):
    return [prints / name for name in ("1_1.png", "1_2.png", "2_1.png")]


def assert_noted(result):
    """Check that the note is the first line of stderr, stands there once, and not in stdout."""
    assert result.exit_code == 0, result.stderr
    assert result.stderr.startswith(NOTE)
    assert result.stderr.count("kernels") == 1
    assert "kernels" not in json.loads(result.stdout)


@pytest.mark.usefixtures("some_interpreted")
def test_batches_note_it_first(run, images, gallery, tmp_path):
    folder = tmp_path / "set"
    folder.mkdir()
    for image in images:
        (folder / image.name).write_bytes(image.read_bytes())
    assert_noted(run("extract", *images, "-o", tmp_path / "templates", "--json"))
    assert_noted(run("enrol", tmp_path / "prints.db", folder, "--json"))
    assert_noted(run("identify", gallery, images[0], "--json"))
    assert_noted(run("evaluate", folder, "--bootstrap", 0, "--workers", 1, "--json"))
    sides = "--references", folder, "--probes", folder
    assert_noted(run("score", *sides, "-o", tmp_path / "s.csv", "--workers", 1, "--json"))


@pytest.mark.usefixtures("some_interpreted")
def test_two_prints_or_one_image_take_no_note(run, images, tmp_path):
    assert "kernels" not in run("verify", *images[:2]).stderr
    assert "kernels" not in run("extract", images[0], "-o", tmp_path).stderr


def test_there_is_no_note_where_all_are_compiled(monkeypatch):
    monkeypatch.setattr(kernels, "compiled_kernels", lambda: {"a": True, "b": True})
    assert slow_kernels_note() is None


@pytest.mark.docs
def test_the_note_states_the_time_as_measured():
    shown = json.loads((ROOT / "docs" / "data" / "performance.json").read_text(encoding="utf-8"))
    (measured,) = [one["value"] for one in shown["figures"] if one["name"] == BENCHMARK]
    assert pytest.approx(measured, rel=0.2) == SLOWER
