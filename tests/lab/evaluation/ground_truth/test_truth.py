from pathlib import Path

import numpy as np
import pytest
from truth_files import truth_document, write_truth

from fpmatch.errors import DatasetError
from fpmatch.lab.evaluation.databases.dataset import Dataset, load_dataset
from fpmatch.lab.evaluation.databases.protocol import Impression
from fpmatch.lab.evaluation.ground_truth.truth import load_truth
from fpmatch.lab.synthesis.database import make_database
from fpmatch.lab.synthesis.impression import make_impression
from fpmatch.lab.synthesis.master import MasterParameters, make_master
from fpmatch.lab.synthesis.plan import plain_sensor
from fpmatch.lab.synthesis.presets import PRESETS

SAMPLES = Path(__file__).resolve().parents[4] / "sample_data"
FIELD = {"step": 8, "dx": [[2.0] * 4] * 5, "dy": [[-1.0] * 4] * 5}


def database(folder, *names):
    impressions = [Impression(*map(int, n.split("_")), folder / f"{n}.tif") for n in names]
    return Dataset("set", 500.0, "", tuple(impressions))


def read(folder, document):
    write_truth(folder, document)
    (truth,) = load_truth(database(folder, "101_1"))
    return truth


def moved_document(**members):
    """Return a document whose transform doubles and shifts."""
    document = truth_document("101_1")
    document["impressions"]["101_1"] |= members
    document["impressions"]["101_1"]["transform"] |= {"scale": 2.0, "tx": 5.0}
    return document


def test_columns_become_minutiae(tmp_path):
    truth = read(tmp_path, truth_document("101_1"))
    assert truth.minutiae.xy.tolist() == truth.visible_xy.tolist() == [[10, 20], [50, 60]]
    assert truth.minutiae.angle == pytest.approx([0, np.pi / 2])
    assert truth.minutiae.kind.tolist() == [1, 2]
    assert truth.master.tolist() == [0, 2]
    assert truth.visible.tolist() == [True, True]


def test_what_is_not_listed_or_invisible_is_hidden(tmp_path):
    truth = read(tmp_path, moved_document())
    assert truth.hidden_xy.tolist() == [[65, 80]]  # where the transform takes it
    assert (truth.transform.scale, truth.transform.tx) == (2.0, 5.0)
    truth = read(tmp_path, truth_document("101_1", visible=[False, True]))
    assert truth.visible_xy.tolist() == [[50, 60]]
    assert truth.hidden_xy.tolist() == [[10, 20], [30, 40]]
    empty = {key: [] for key in ("x", "y", "angle_deg", "kind", "master")}
    truth = read(tmp_path, truth_document("101_1", **empty))
    assert (len(truth.minutiae), truth.hidden_xy.shape) == (0, (3, 2))


def test_truths_come_in_the_order_of_the_prints(tmp_path):
    document = truth_document("101_2", "101_1")
    columns = ("x", "y", "angle_deg", "kind", "master")
    document["impressions"]["101_2"]["minutiae"] = {key: [1] for key in columns}
    write_truth(tmp_path, document)
    first, second = load_truth(database(tmp_path, "101_1", "101_2"))
    assert (len(first.minutiae), len(second.minutiae)) == (2, 1)
    samples = load_truth(load_dataset(SAMPLES))
    assert len(samples) == 16
    assert all(len(truth.visible_xy) > 10 and truth.displacement for truth in samples)


def assert_refused(folder, document, *reasons):
    path = write_truth(folder, document)
    with pytest.raises(DatasetError) as caught:
        load_truth(database(folder, "101_1"))
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    for reason in reasons:
        assert reason in message


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"x": [1.0]}, "y has 2 values where x has 1"),
        ({"x": [1.0, float("inf")]}, "x has values that are not finite"),
        ({"x": ["a", "b"]}, "x must be numbers"),
        ({"angle_deg": "north"}, "could not convert"),
        ({"kind": [1, 3]}, "minutia kind must be"),
        ({"master": [0, 0]}, "master must be different indices"),
        ({"master": [0, 3]}, "master must be different indices"),
        ({"master": [0]}, "master has 1 values where x has 2"),
        ({"master": [0.0, 1.0]}, "master must be a list of int"),
        ({"visible": [True]}, "visible has 1 values where x has 2"),
        ({"visible": [1, 0]}, "visible must be a list of bool"),
        ({"visible": None}, "visible must be a list of bool"),
    ],
)
def test_malformed_minutiae_are_refused(tmp_path, changes, reason):
    assert_refused(tmp_path, truth_document("101_1", **changes), "impression 101_1", reason)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"step": 0}, "a displacement field needs"),
        ({"step": 5e-324}, "a displacement field needs a step of 0.001 pixels at least"),
        ({"dx": [[1.0] * 4] * 4}, "same shape"),
        ({"dx": [[1.0]], "dy": [[1.0]]}, "at least 4 x 4 nodes"),
        ({"dy": "up"}, "could not convert"),
        ({"dx": [[float("inf")] * 4] * 5}, "finite"),
    ],
)
def test_malformed_displacements_are_refused(tmp_path, changes, reason):
    document = moved_document(displacement=FIELD | changes)
    assert_refused(tmp_path, document, "impression 101_1 is malformed", reason)


def test_documents_that_are_no_truth_are_refused(tmp_path):
    good = truth_document("101_1")
    assert_refused(tmp_path, [], "no object 'minutiae'")
    assert_refused(tmp_path, {"minutiae": {}}, "no object 'impressions'")
    assert_refused(tmp_path, good | {"minutiae": {"x": []}}, "has no 'y'")
    assert_refused(tmp_path, good | {"impressions": {}}, "impressions has no '101_1'")
    assert_refused(tmp_path, good | {"impressions": {"101_1": 7}}, "101_1 is malformed")
    assert_refused(tmp_path, good | {"impressions": {"101_1": {}}}, "has no 'minutiae'")
    transform = good["impressions"]["101_1"]["transform"]
    transform["scale"] = 1e308
    assert_refused(tmp_path, good, "maps minutiae beyond all numbers")
    transform["scale"] = -1
    assert_refused(tmp_path, good, "positive scale")
    del transform["scale"]
    assert_refused(tmp_path, good, "has no 'scale'")


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe", b"[" * 100_000])
def test_files_that_are_no_json_are_refused(tmp_path, content):
    write_truth(tmp_path, {}).write_bytes(content)
    with pytest.raises(DatasetError, match=r"101\.json: not a readable JSON file"):
        load_truth(database(tmp_path, "101_1"))


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(DatasetError, match=r"truth.101\.json: no such file"):
        load_truth(database(tmp_path, "101_1"))
    (tmp_path / "truth").touch()
    with pytest.raises(DatasetError, match=r"truth.101\.json: no such file"):
        load_truth(database(tmp_path, "101_1"))
    (tmp_path / "truth").unlink()
    (tmp_path / "truth" / "101.json").mkdir(parents=True)
    with pytest.raises(DatasetError, match=r"101\.json: cannot be read"):
        load_truth(database(tmp_path, "101_1"))


def test_to_the_master_and_back_with_and_without_a_displacement(tmp_path):
    truth = read(tmp_path, moved_document())
    assert truth.to_master([[65, 80]]).tolist() == [[30, 40]]
    assert truth.from_master([[30, 40]]).tolist() == [[65, 80]]
    truth = read(tmp_path, moved_document(displacement=FIELD))
    assert truth.to_master([[3, 1]]).tolist() == [[0, 0]]
    assert truth.from_master([[0, 0]]).tolist() == [[3, 1]]
    assert truth.hidden_xy.tolist() == [[63, 81]]


def test_files_tell_where_the_same_skin_lies_in_another_impression(tmp_path):
    """As the warps themselves tell it, to a tenth of a pixel."""
    small = MasterParameters(shape=(200, 180))
    sensors = [plain_sensor(150, 170), plain_sensor(170, 200, 569)]
    arguments = {"fingers": 1, "impressions": 2, "preset": "hard", "seed": 4, "master": small}
    make_database(tmp_path, sensors=sensors, workers=1, **arguments)
    probe, reference = load_truth(load_dataset(tmp_path))
    finger, hard = make_master(4, 101, small), PRESETS["hard"]
    made = [make_impression(finger, m, hard, sensor) for m, sensor in enumerate(sensors, start=1)]
    points = np.mgrid[:150:3, :170:3].reshape(2, -1).T.astype(np.float64)
    true = made[1].warp.from_master(made[0].warp.to_master(points))
    inside = ((true >= 0) & (true <= (169, 199))).all(axis=1)
    assert inside.sum() > 500
    found = reference.from_master(probe.to_master(points))
    assert np.hypot(*(found - true)[inside].T).max() < 0.1
    by_similarity = reference.transform.after(probe.transform.inverse()).apply(points)
    assert np.hypot(*(by_similarity - true)[inside].T).max() > 1
