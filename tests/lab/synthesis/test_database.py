"""The same folder to the last byte, whatever happened on the way."""

import hashlib
import json
import os
import signal
import subprocess
import sys
import tomllib
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from PIL import Image

from fpmatch.errors import DatasetError, OutputError
from fpmatch.image.dataset_folder import read_dataset_info
from fpmatch.lab.evaluation.databases.dataset import load_dataset
from fpmatch.lab.synthesis.database import DatabaseMade, Plan, make_database
from fpmatch.lab.synthesis.master import MasterParameters
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import SENSORS, Sensor

SMALL = MasterParameters(shape=(96, 96))
TINY = Sensor("64x72@500dpi", 64, 72)
FINE = Sensor("fine", 128, 144, 1000.0)


def make(out, **changes):
    """Make a database of two tiny fingers by two, or with other arguments."""
    arguments = {"fingers": 2, "impressions": 2, "preset": PRESETS["clean"], "seed": 7}
    arguments |= {"sensors": [TINY], "master": SMALL, "workers": 1}
    return make_database(out, **(arguments | changes))


def contents(folder):
    """Return all files of a folder, by their paths in it."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed") / "new" / "prints"
    make(folder)
    return contents(folder)


def test_files_are_named_as_in_the_fvc_and_the_truth_names_its_images(undisturbed):
    images = [f"{finger}_{m}.tif" for finger in (101, 102) for m in (1, 2)]
    truths = [f"truth{os.sep}{finger}.json" for finger in (101, 102)]
    assert sorted(undisturbed) == sorted([*images, *truths, "dataset.toml"])
    truth = json.loads(undisturbed[f"truth{os.sep}102.json"])
    assert truth["finger"] == 102
    for name, impression in truth["impressions"].items():
        assert impression["sha256"] == hashlib.sha256(undisturbed[f"{name}.tif"]).hexdigest()


def test_images_have_their_size_and_resolution(tmp_path):
    made = make(tmp_path, fingers=1, impressions=3, sensors=[TINY, FINE])
    assert made.impressions == 3
    for number, sensor in enumerate((TINY, FINE, TINY), start=1):
        with Image.open(tmp_path / f"101_{number}.tif") as image:
            assert (image.format, image.mode) == ("TIFF", "L")
            assert image.size == (sensor.width, sensor.height)
            assert tuple(map(float, image.info["dpi"])) == (sensor.dpi, sensor.dpi)
    assert {one.dpi for one in load_dataset(tmp_path).impressions} == {None}


def test_any_number_of_workers_makes_the_same_dataset(tmp_path, undisturbed):
    made = make(tmp_path, workers=2)
    assert contents(tmp_path) == undisturbed
    dataset = load_dataset(tmp_path)
    assert [one.path.stem for one in dataset.impressions] == ["101_1", "101_2", "102_1", "102_2"]
    info = (dataset.name, dataset.impressions[0].dpi, read_dataset_info(tmp_path).sensor)
    assert info == ("synthetic, clean, seed 7", 500, "synthetic 64x72@500dpi")
    assert made == DatabaseMade(tmp_path, 2, 2, 2)
    (tmp_path / "102_1.tif").unlink()  # a missing image is made again
    assert make(tmp_path).made == 1
    assert contents(tmp_path) == undisturbed


def test_fingers_and_impressions_do_not_depend_on_how_many_there_are(tmp_path, undisturbed):
    make(tmp_path / "fewer", fingers=1, impressions=1)
    assert (tmp_path / "fewer" / "101_1.tif").read_bytes() == undisturbed["101_1.tif"]
    tmp_path = tmp_path / "added"
    make(tmp_path, fingers=1)
    said = []
    made = make(tmp_path, progress=lambda *words: said.append(words))
    assert made.made == 1
    assert said == [("synth", 1, 2), ("synth", 2, 2)]
    assert contents(tmp_path) == undisturbed
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")}
    assert make(tmp_path).made == 0
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")} == before


KILLED = """
import signal
import sys
from fpmatch.lab.synthesis import database
from fpmatch.lab.synthesis.master import MasterParameters
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import Sensor
if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored in a background job
    write, left = database._write, [int(sys.argv[2])]
    def slowly(path, content):
        if not left[0]:
            unfinished = path.with_name(".0123456789abcdef.part")
            unfinished.write_bytes(content[: len(content) // 2])
            print("half", flush=True)
            sys.stdin.read()
        left[0] -= 1
        write(path, content)
    database._write = slowly
    database.make_database(
        sys.argv[1], fingers=2, impressions=2, preset=PRESETS["clean"], seed=7, workers=1,
        sensors=[Sensor("64x72@500dpi", 64, 72)], master=MasterParameters(shape=(96, 96)),
    )
"""


@contextmanager
def half_way(out, files):
    """Start to make the database in another process, which stops in the middle of a file."""
    command = [sys.executable, "-c", KILLED, str(out), str(files)]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(command, text=True, stderr=subprocess.DEVNULL, **pipes) as process:
        assert process.stdout.readline() == "half\n"
        try:
            yield process
        finally:
            process.kill()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="sends POSIX signals")
@pytest.mark.parametrize(("sent", "files"), [("SIGKILL", 5), ("SIGINT", 1)])
def test_a_killed_run_goes_on_to_the_same_bytes(tmp_path, undisturbed, sent, files):
    with half_way(tmp_path, files) as process:
        process.send_signal(getattr(signal, sent))
        process.wait()
    assert process.returncode != 0
    left = contents(tmp_path)
    assert ".0123456789abcdef.part" in {Path(name).name for name in left}
    assert len(left) == 1 + files + 1
    made = make(tmp_path)
    assert made.made == (1 if files >= 3 else 2)
    assert contents(tmp_path) == undisturbed


@pytest.mark.skipif(sys.platform == "win32", reason="there are no such locks")
def test_two_at_once_in_one_folder_are_one_too_many(tmp_path):
    with half_way(tmp_path, 1):
        before = contents(tmp_path)
        with pytest.raises(DatasetError, match="another process"):
            make(tmp_path)
        assert contents(tmp_path) == before


def assert_refused(folder, reason, error, **changes):
    before = contents(folder) if folder.is_dir() else {}
    with pytest.raises(error, match=reason) as caught:
        make(folder, **changes)
    assert "\n" not in str(caught.value)
    assert (contents(folder) if folder.is_dir() else {}) == before


PLAN = Plan(7, PRESETS["normal"], (SENSORS["optical-388x374"], SENSORS["optical-296x560"]), 4)


def test_folders_of_others_and_other_databases_are_left_alone(tmp_path):
    make(tmp_path, fingers=1)
    assert_refused(tmp_path, "made otherwise", DatasetError, seed=8)
    (tmp_path / "102_1.tif").write_bytes(b"mine")
    assert_refused(tmp_path, "is in the way", DatasetError)
    (tmp_path / "dataset.toml").unlink()
    assert_refused(tmp_path, "holds files but no dataset.toml", DatasetError)
    assert_refused(tmp_path / "102_1.tif", "102_1.tif: cannot be used: ", OutputError)


@pytest.mark.parametrize(
    "changes",
    [
        {"preset": PRESETS["easy"]},
        {"impressions": 5},
        {"sensors": PLAN.sensors[:1]},
        {"master": SMALL},
        {"sensors": (replace(PLAN.sensors[0], ink=1.0), PLAN.sensors[1])},
    ],
)
def test_another_plan_is_told_apart(changes):
    assert replace(PLAN, **changes).description() != PLAN.description()


def test_the_description_is_toml_and_states_the_resolution_where_sensors_agree():
    said = tomllib.loads(PLAN.description())
    assert said["name"] == "synthetic, normal, seed 7"
    assert said["sensor"] == "synthetic optical-388x374, synthetic optical-296x560"
    assert said["synthesis"] == PLAN.table()
    assert "dpi" not in said
    for dpi, text in ((500.0, "dpi = 500\n"), (508.5, "dpi = 508.5\n")):
        sensors = (Sensor("one", 90, 90, dpi), Sensor("two", 80, 90, dpi))
        assert text in replace(PLAN, sensors=sensors).description()


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"fingers": 0}, "0 fingers"),
        ({"sensors": []}, "0 sensors"),
        ({"seed": -1}, "seed"),
        ({"seed": 2**63}, "seed"),
        ({"impressions": 0}, "0 impressions"),
        ({"impressions": 1001}, "1001 impressions"),
    ],
)
def test_impossible_arguments_are_refused_before_a_folder_is_made(tmp_path, changes, reason):
    assert_refused(tmp_path / "new", reason, DatasetError, **changes)
    assert not (tmp_path / "new").exists()
