import tomllib
from dataclasses import replace

import pytest

from fpmatch.errors import DatasetError, ImageError, ResolutionError
from fpmatch.lab.synthesis.database import Plan, check_same_plan
from fpmatch.lab.synthesis.master import MasterParameters
from fpmatch.lab.synthesis.sensor import SENSORS, Sensor, plain_sensor, sensors_named

PLAN = Plan(7, "normal", sensors_named(["optical-388x374", "optical-296x560"]), 4)


def test_impressions_take_the_sensors_in_turn():
    names = [PLAN.sensor_of(m).name for m in range(1, 6)]
    assert names == [*("optical-388x374", "optical-296x560") * 2, "optical-388x374"]


def test_the_description_is_toml_and_says_all():
    said = tomllib.loads(PLAN.description())
    assert said["name"] == "synthetic, normal, seed 7"
    assert said["sensor"] == "synthetic optical-388x374, synthetic optical-296x560"
    assert said["synthesis"] == PLAN.table()
    assert said["synthesis"]["sensors"] == ["optical-388x374", "optical-296x560"]


def test_the_resolution_is_said_where_all_sensors_agree():
    assert "dpi" not in tomllib.loads(PLAN.description())
    for dpi, text in ((500.0, "dpi = 500\n"), (508.5, "dpi = 508.5\n")):
        sensors = (plain_sensor(90, 90, dpi), plain_sensor(80, 90, dpi))
        assert text in replace(PLAN, sensors=sensors).description()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"seed": 8}, "seed 7, not 8"),
        ({"preset": "easy"}, "preset 'normal', not 'easy'"),
        ({"impressions": 5}, "impressions 4, not 5"),
        (
            {"sensors": PLAN.sensors[:1]},
            r"'optical-296x560'\], not \['optical-3",
        ),
        ({"master": MasterParameters(shape=(96, 96))}, "parameters '[0-9a-f]{16}', not "),
        ({"sensors": (replace(PLAN.sensors[0], ink=1.0), PLAN.sensors[1])}, "parameters '"),
    ],
)
def test_another_plan_is_told_apart(tmp_path, changes, said):
    path = tmp_path / "dataset.toml"
    path.write_text(PLAN.description())
    check_same_plan(path, PLAN)
    with pytest.raises(DatasetError, match=rf"^.*dataset\.toml: .*{said}.*$"):
        check_same_plan(path, replace(PLAN, **changes))


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"synthesis = 3\n", "seed None, not 7"),
        (b"[synthesis]\n", "seed None, not 7"),
        (b"[synth", "not a readable TOML file"),
        (b"\xff", "not a readable TOML file"),
    ],
)
def test_descriptions_of_others_are_refused(tmp_path, content, reason):
    path = tmp_path / "dataset.toml"
    path.write_bytes(content)
    with pytest.raises(DatasetError, match=reason):
        check_same_plan(path, PLAN)
    with pytest.raises(DatasetError, match="not a readable TOML file"):
        check_same_plan(tmp_path, PLAN)


@pytest.mark.parametrize(
    "changes",
    [{"seed": -1}, {"seed": 2**63}, {"impressions": 0}, {"impressions": 1001}, {"sensors": ()}],
    ids=str,
)
def test_impossible_plans_are_refused(changes):
    (name,) = changes
    with pytest.raises(DatasetError, match=name.removesuffix("s")):
        replace(PLAN, **changes)


def test_unknown_names_are_refused():
    with pytest.raises(ImageError, match=r"^unknown preset 'wet'; known: clean, easy, [^\n]*$"):
        replace(PLAN, preset="wet")
    with pytest.raises(DatasetError, match=rf"'x': .*{next(iter(SENSORS))}, "):
        sensors_named(["x"])


def test_impossible_sensors_are_refused():
    for width, height in ((0, 100), (100, -5), (31, 100), (100, 5000)):
        with pytest.raises(ImageError, match=rf"^sensor bad: {width} x {height} [^\n]*$"):
            Sensor("bad", width, height)
    for dpi in (0, 99, 4001, float("nan")):
        with pytest.raises(ResolutionError):
            Sensor("bad", 100, 100, dpi)
