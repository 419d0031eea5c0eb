from itertools import combinations
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import DatasetError
from fpmatch.lab.evaluation.databases.dataset import (
    PROTOCOLS,
    Impression,
    choose_pairs,
    load_dataset,
)
from fpmatch.lab.evaluation.run import load_datasets


def touch(folder, *names):
    for name in names:
        (folder / name).write_bytes(b"")


def test_prints_are_sorted_by_number_and_other_files_passed_over(tmp_path):
    touch(tmp_path, "10_1.tif", "9_10.png", "9_2.JPG", "009_001.bmp")
    touch(tmp_path, "README.md", "101_2.txt", "101_2.json", "x_1.tif", "1_2_3.tif")
    touch(tmp_path, "١٠١_١.tif", ".101_3.tif", "101_4")
    (tmp_path / "101_5.tif").mkdir()
    nine = [("9", "009_001.bmp"), ("9", "9_2.JPG"), ("9", "9_10.png")]
    assert found_in(load_dataset(tmp_path)) == [*nine, ("10", "10_1.tif")]


def test_description_is_optional_and_read(tmp_path):
    touch(tmp_path, "1_1.tif")
    dataset = load_dataset(tmp_path)
    assert (dataset.name, dataset.impressions[0].dpi) == (tmp_path.name, None)
    (tmp_path / "dataset.toml").write_text('name = "A"\ndpi = 569\nyear = 2002')
    dataset = load_dataset(tmp_path)
    assert (dataset.name, dataset.impressions[0].dpi) == ("A", 569.0)
    assert load_dataset(tmp_path, dpi=1000).impressions[0].dpi == 1000


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
    assert [d.name for d in load_datasets(folders)] == ["a", "b", "c"]
    assert [d.name for d in load_datasets(folders[1:])] == ["synthetic", "c"]


def found_in(dataset):
    return [(i.finger, i.name) for i in dataset.impressions]


def test_fingers_by_a_pattern_have_any_names(tmp_path):
    touch(tmp_path, "ada_left_10.png", "ada_left_9.png", "bob_right_1.png", "readme.png")
    pattern = r"(?P<subject>[a-z]+)_(?P<finger>[a-z]+)_(?P<impression>\d+)"
    dataset = load_dataset(tmp_path, pattern=pattern)
    assert found_in(dataset) == [
        ("ada/left", "ada_left_9.png"),
        ("ada/left", "ada_left_10.png"),
        ("bob/right", "bob_right_1.png"),
    ]
    assert dataset.notes == ("1 of 4 prints do not fit the pattern; they are left out",)
    with pytest.raises(DatasetError, match="no print fits the pattern"):
        load_dataset(tmp_path, pattern=r"x(?P<subject>\d)")
    touch(tmp_path, "eve_left_9.png")
    with pytest.raises(DatasetError, match="are the same impression, left_9"):
        load_dataset(tmp_path, pattern=r"[a-z]+_(?P<subject>[a-z]+)_(?P<impression>\d+)")
    with pytest.raises(DatasetError, match="--pattern finds other names"):
        load_dataset(tmp_path)


def test_a_manifest_is_a_database_of_its_own_name(tmp_path):
    touch(tmp_path, "x.png", "y.png", "z.png")
    manifest = tmp_path / "spring.csv"
    manifest.write_text("path,subject,dpi\nz.png,10,1000\nx.png,9,\ny.png,9,\n")
    (tmp_path / "dataset.toml").write_text('dpi = 569\npolarity = "white"\n')
    dataset = load_dataset(manifest)
    assert found_in(dataset) == [("9", "x.png"), ("9", "y.png"), ("10", "z.png")]
    assert [i.dpi for i in dataset.impressions] == [569, 569, 1000]
    assert dataset.name == "spring"
    (tmp_path / "dataset.toml").write_text('name = "all"\n')
    (tmp_path / "autumn.csv").write_text("path,subject\nx.png,1\ny.png,1\n")
    both = load_datasets([manifest, tmp_path / "autumn.csv"])
    assert [d.name for d in both] == ["spring", "autumn"]
    manifest.write_text("path,subject,finger\nx.png,a,b\ny.png,a/b,\n")
    with pytest.raises(DatasetError, match="'a/b' is the name of a subject and of a subject's"):
        load_dataset(manifest)
    manifest.write_text("file,subject\nx.png,a\n")
    with pytest.raises(DatasetError, match=r"spring\.csv: not a folder of prints, nor a manifest"):
        load_dataset(manifest)


def test_folders_are_fingers_where_the_database_has_no_prints_itself(tmp_path):
    for folder in ("ada/left", "ada/right", "bob/left"):
        (tmp_path / folder).mkdir(parents=True)
        touch(tmp_path / folder, "2.png", "10.png")
    dataset = load_dataset(tmp_path)
    assert found_in(dataset)[:3] == [
        ("ada/left", "ada/left/2.png"),
        ("ada/left", "ada/left/10.png"),
        ("ada/right", "ada/right/2.png"),
    ]
    assert dataset.notes == ()
    note = "each folder in it is taken for one finger (--pattern for other layouts)"
    assert load_dataset(tmp_path / "ada").notes == (note,)


def slow_pairs(fingers, protocol):
    """The definition, pair by pair."""
    for (a, p), (b, q) in combinations(enumerate(fingers), 2):
        both_first = p not in fingers[:a] and q not in fingers[:b]
        if p == q or protocol == "extended" or both_first:
            yield a, b, p == q


@given(st.lists(st.sampled_from("abcd"), max_size=12), st.sampled_from(PROTOCOLS))
def test_agrees_with_the_definition(prints, protocol):
    impressions = [Impression(f, Path(f"{f}_{k}.tif"), f"{f}_{k}") for k, f in enumerate(prints)]
    pairs = choose_pairs(impressions, protocol)
    columns = (pairs.probe.tolist(), pairs.reference.tolist(), pairs.genuine.tolist())
    assert list(zip(*columns, strict=True)) == list(slow_pairs(prints, protocol))
