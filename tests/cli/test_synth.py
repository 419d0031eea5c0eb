"""`fpmatch synth`: what it makes, says and refuses."""

import importlib
import json
from typing import Any

import pytest

from fpmatch.errors import OutputError
from fpmatch.lab.synthesis import database
from fpmatch.lab.synthesis.database import DatabaseMade
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import SENSORS

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
    module = importlib.import_module("fpmatch.lab.cli.synth")
    assert set(module._PRESETS) == set(PRESETS)
    assert set(module._SENSORS) == set(SENSORS)
    for name, words in (module._PRESETS | module._SENSORS).items():
        assert f"  {name}  " in text
        assert words in text


def test_a_full_disk_is_one_line(run, tmp_path, monkeypatch):
    def full(path, _, *, public):
        raise OutputError(f"{path}: cannot be written: no space left on device")

    monkeypatch.setattr(database, "atomic_write_bytes", full)
    assert_refused(run("synth", tmp_path, *SMALL), "no space left on device")


def test_a_gallery_of_templates_is_made_and_then_left_alone(run, tmp_path):
    out = tmp_path / "made.db"
    words = ("synth", out, "--templates", "--fingers", 3, "--workers", 1)
    first = run(*words, "--impressions", 2)
    assert first.exit_code == 0
    assert first.stdout.startswith(f"3 fingers x 2 impressions in {out}: 6 templates in ")
    again = run(*words, "--impressions", 2)
    assert again.stdout == f"nothing to do: 3 fingers x 2 impressions, all there in {out}\n"
    more = json.loads(run(*words, "--impressions", 3, "--json").stdout)
    assert more.pop("seconds") >= 0
    assert more == {"gallery": str(out), "fingers": 3, "impressions": 3, "made": 3}
    other = run(*words, "--seed", 1)
    assert_refused(other, "another picture is enrolled as 101_1 already")


@pytest.mark.parametrize("words", ["--fingers 0", "--impressions 0", "--seed -1", "--size 9x9"])
def test_no_gallery_is_left_of_a_refused_plan(run, tmp_path, words):
    result = run("synth", tmp_path / "made.db", "--templates", *words.split())
    assert result.exit_code == 2
    assert not list(tmp_path.iterdir())
