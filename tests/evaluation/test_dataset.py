import re

import pytest

from fpmatch.errors import DatasetError
from fpmatch.evaluation.dataset import load_dataset, with_unique_names


def touch(folder, *names):
    for name in names:
        (folder / name).write_bytes(b"")


def test_prints_are_sorted_by_number_and_other_files_passed_over(tmp_path):
    touch(tmp_path, "10_1.tif", "9_10.png", "9_2.JPG", "009_001.bmp")
    touch(tmp_path, "README.md", "101_2.txt", "101_2.json", "x_1.tif", "1_2_3.tif")
    touch(tmp_path, "١٠١_١.tif", ".101_3.tif", "101_4")
    (tmp_path / "101_5.tif").mkdir()
    found = [(i.finger, i.number, i.path.name) for i in load_dataset(tmp_path).impressions]
    assert found == [
        *((9, 1, "009_001.bmp"), (9, 2, "9_2.JPG"), (9, 10, "9_10.png")),
        (10, 1, "10_1.tif"),
    ]


def test_description_is_optional_and_read(tmp_path):
    touch(tmp_path, "1_1.tif")
    dataset = load_dataset(tmp_path)
    assert (dataset.name, dataset.dpi, dataset.sensor) == (tmp_path.name, None, "")
    (tmp_path / "dataset.toml").write_text('name = "A"\ndpi = 569\nsensor = "optical"\nyear = 2002')
    dataset = load_dataset(tmp_path)
    assert (dataset.name, dataset.dpi, dataset.sensor) == ("A", 569.0, "optical")


@pytest.mark.parametrize(
    ("toml", "reason"),
    [
        ("dpi = ", "not a readable TOML file"),
        (b"name = '\xff'", "not a readable TOML file"),
        ('dpi = "500"', "dpi must be a number"),
        ("dpi = true", "dpi must be a number"),
        ("dpi = 50", "50 dpi is outside"),
        ("dpi = nan", "nan dpi is outside"),
        ("dpi = 1" + 400 * "0", "dataset.toml: "),
        ('polarity = "black"', "no polarity 'black': there are auto, dark, white"),
        ("polarity = true", "no polarity True: there are auto, dark, white"),
        ("name = 3", "name must be text"),
        ('name = ""', "name is empty"),
        ('name = "a\\nb"', "name must be text of one line"),
        ("sensor = []", "sensor must be text"),
    ],
)
def test_bad_description_names_the_file(tmp_path, toml, reason):
    touch(tmp_path, "1_1.tif")
    (tmp_path / "dataset.toml").write_bytes(toml if isinstance(toml, bytes) else toml.encode())
    with pytest.raises(DatasetError, match=re.escape(reason)) as caught:
        load_dataset(tmp_path)
    assert str(tmp_path / "dataset.toml") in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("twin", ["101_1.png", "0101_1.tif", "101_01.tiff"])
def test_one_impression_twice_is_refused(tmp_path, twin):
    touch(tmp_path, "101_1.tif", twin)
    with pytest.raises(DatasetError, match="are the same impression") as caught:
        load_dataset(tmp_path)
    assert "101_1.tif" in str(caught.value)
    assert twin in str(caught.value)


def test_what_is_no_database(tmp_path):
    with pytest.raises(DatasetError, match="holds no prints"):
        load_dataset(tmp_path)
    touch(tmp_path, "1_1.tif")
    with pytest.raises(DatasetError, match=r"nowhere: no such folder"):
        load_dataset(tmp_path / "nowhere")
    with pytest.raises(DatasetError, match=r"1_1\.tif: not a folder"):
        load_dataset(tmp_path / "1_1.tif")


def test_databases_of_one_name_are_called_by_their_folders(make_database):
    text = 'name = "synthetic"\n'
    folders = [make_database("a", toml=text), make_database("b", toml=text), make_database("c")]
    loaded = [load_dataset(folder) for folder in folders]
    assert [d.name for d in with_unique_names(loaded)] == ["a", "b", "c"]
    assert [d.name for d in with_unique_names(loaded[1:])] == ["synthetic", "c"]
    assert [d.impressions for d in with_unique_names(loaded)] == [d.impressions for d in loaded]
