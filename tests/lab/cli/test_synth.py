import json
import tomllib

from tests.conftest import assert_refused

PRINTS = ("--preset", "easy", "--sensor", "capacitive-300x300", "--seed", 2)
SMALL = ("--fingers", 1, "--impressions", 1, "--workers", 1, *PRINTS)


def test_a_small_database_is_made_and_then_left_alone(run, tmp_path):
    out = tmp_path / "new" / "prints"
    first, again = run("synth", out, *SMALL), run("synth", out, *SMALL)
    assert (first.exit_code, again.exit_code, first.stderr) == (0, 0, "")
    assert sorted(p.name for p in out.iterdir()) == ["101_1.tif", "dataset.toml", "truth"]
    made = tomllib.loads((out / "dataset.toml").read_text())["synthesis"]
    assert (made["preset"], made["sensors"], made["seed"]) == ("easy", ["capacitive-300x300"], 2)
    assert ": 1 picture in " in first.stdout
    assert again.stdout.endswith(": nothing to do\n")
    document = json.loads(run("synth", out, *SMALL, "--json").stdout)
    assert (document["folder"], document["made"]) == (str(out), 0)
    assert_refused(run("synth", out, *SMALL, "--seed", 3), f"{out / 'dataset.toml'}: ")
