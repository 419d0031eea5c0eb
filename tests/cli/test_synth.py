"""`fpmatch synth`: what it makes, says and refuses."""

from __future__ import annotations

import importlib
import json
from typing import Any

import pytest

from fpmatch.errors import OutputError
from fpmatch.synthesis import database
from fpmatch.synthesis.database import DatabaseMade
from fpmatch.synthesis.presets import PRESETS
from fpmatch.synthesis.sensor import SENSORS

from .conftest import assert_refused

SMALL = ("--fingers", 1, "--impressions", 1, "--size", "96x112", "--workers", 1)


@pytest.fixture
def asked(monkeypatch):
    """Let the command make nothing, and return what it would have made."""
    words: dict[str, Any] = {}

    def make(out, **arguments):
        words.update(arguments, out=out)
        return DatabaseMade(out, arguments["fingers"], arguments["impressions"], 3, 4_560_000)

    monkeypatch.setattr(database, "make_database", make)
    return words


def test_a_small_database_is_made_and_then_left_alone(run, tmp_path):
    out = tmp_path / "new" / "prints"
    first = run("synth", out, *SMALL)
    assert first.exit_code == 0
    assert first.stderr == ""
    assert first.stdout.startswith(f"1 finger x 1 impression in {out}, 0.0 MB: 1 picture in ")
    assert sorted(p.name for p in out.iterdir()) == ["101_1.tif", "dataset.toml", "truth"]
    again = run("synth", out, *SMALL)
    assert again.exit_code == 0
    assert again.stdout.startswith(f"nothing to do: 1 finger x 1 impression, all there in {out}, ")
    document = json.loads(run("synth", out, *SMALL, "--json").stdout)
    assert (document["folder"], document["made"]) == (str(out), 0)
    size = sum(path.stat().st_size for path in out.rglob("*") if path.is_file())
    assert document["bytes"] == size
    other = run("synth", out, *SMALL, "--seed", 3)
    assert_refused(other, f"{out / 'dataset.toml'}: the prints there were made with seed 0, not 3")


def test_options_reach_the_database(run, tmp_path, asked):
    options = "--fingers 20 --impressions 4 --preset hard --seed 7 --workers 2"
    sensors = ("plain-288x384", "optical-388x374")
    words = (word for sensor in sensors for word in ("--sensor", sensor))
    result = run("synth", tmp_path, *options.split(), *words)
    del asked["progress"]
    assert asked == {
        **{"out": tmp_path, "fingers": 20, "impressions": 4, "preset": "hard", "seed": 7},
        **{"sensors": sensors, "workers": 2},
    }
    assert result.stdout.startswith(f"20 fingers x 4 impressions in {tmp_path}, 4.6 MB: 12 pictu")
    run("synth", tmp_path, "--size", "600x700", "--dpi", "1000")
    (sensor,) = asked["sensors"]
    assert (sensor.name, sensor.shape, sensor.dpi) == ("600x700@1000dpi", (700, 600), 1000)


def test_help_tells_of_every_preset_and_sensor_in_words(run):
    text = run("synth", "--help").output
    module = importlib.import_module("fpmatch.cli.synth")
    assert set(module._PRESETS) == set(PRESETS)
    assert set(module._SENSORS) == set(SENSORS)
    for name, words in (module._PRESETS | module._SENSORS).items():
        assert f"  {name}  " in text
        assert words in text


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("--fingers 0", "0 fingers from number 101: there must be at least 1"),
        ("--fingers 100000000", "numbered within 1 to"),
        ("--impressions 0", "0 impressions of a finger: there may be 1 to"),
        ("--seed -1", "seed -1: must lie between 0 and"),
        ("--size 10x400", "each side must lie between"),
        ("--size 400x99999", "each side must lie between"),
        ("--size 400x400 --dpi 50", "resolution of 50 dpi is outside"),
        ("--size 400x400 --dpi nan", "resolution of nan dpi is outside"),
    ],
)
def test_what_is_impossible_is_one_line_and_status_2(run, tmp_path, words, reason):
    result = run("synth", tmp_path / "new", *words.split())
    assert_refused(result, reason)
    assert not (tmp_path / "new").exists()


def test_folders_it_may_not_use_are_one_line_and_status_2(run, tmp_path):
    (tmp_path / "letter.txt").write_text("dear")
    for out, reason in ((tmp_path, "holds files but no"), (tmp_path / "letter.txt", "cannot be")):
        assert_refused(run("synth", out, *SMALL), f"{out}: {reason}")
    assert [path.name for path in tmp_path.iterdir()] == ["letter.txt"]


def test_a_full_disk_is_one_line(run, tmp_path, monkeypatch):
    def full(path, _):
        raise OutputError(f"{path}: cannot be written: no space left on device")

    monkeypatch.setattr(database, "atomic_write_bytes", full)
    assert_refused(run("synth", tmp_path, *SMALL), "no space left on device")
