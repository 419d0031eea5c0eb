import json
from typing import Any

import pytest

from fpmatch.lab.synthesis import database
from fpmatch.lab.synthesis.database import DatabaseMade
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import SENSORS
from tests.conftest import assert_refused

SMALL = ("--fingers", 1, "--impressions", 1, "--workers", 1)


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
    first, again = run("synth", out, *SMALL), run("synth", out, *SMALL)
    assert (first.exit_code, again.exit_code, first.stderr) == (0, 0, "")
    assert sorted(p.name for p in out.iterdir()) == ["101_1.tif", "dataset.toml", "truth"]
    assert ": 1 picture in " in first.stdout
    assert again.stdout.endswith(": nothing to do\n")
    document = json.loads(run("synth", out, *SMALL, "--json").stdout)
    assert (document["folder"], document["made"]) == (str(out), 0)
    size = sum(path.stat().st_size for path in out.rglob("*") if path.is_file())
    assert document["bytes"] == size
    assert_refused(run("synth", out, *SMALL, "--seed", 3), f"{out / 'dataset.toml'}: ")


def test_options_reach_the_database(run, tmp_path, asked):
    options = "--fingers 20 --impressions 4 --preset hard --seed 7 --workers 2"
    sensors = ("plain-288x384", "optical-388x374")
    words = (word for sensor in sensors for word in ("--sensor", sensor))
    result = run("synth", tmp_path, *options.split(), *words)
    del asked["progress"]
    assert asked == {
        **{"out": tmp_path, "fingers": 20, "impressions": 4, "preset": PRESETS["hard"]},
        **{"sensors": [SENSORS[name] for name in sensors], "seed": 7, "workers": 2},
    }
    assert result.stdout.startswith(f"20 fingers x 4 impressions in {tmp_path}, 4.6 MB: 12 ")
