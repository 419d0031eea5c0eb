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
    with_unique_names,
)


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


def found_in(dataset):
    return [(i.finger, i.number, i.name) for i in dataset.impressions]


def test_fingers_by_a_pattern_have_any_names(tmp_path):
    touch(tmp_path, "ada_left_10.png", "ada_left_9.png", "bob_right_1.png", "readme.png")
    pattern = r"(?P<subject>[a-z]+)_(?P<finger>[a-z]+)_(?P<impression>\d+)"
    dataset = load_dataset(tmp_path, pattern=pattern)
    assert found_in(dataset) == [
        ("ada/left", 1, "ada_left_9.png"),
        ("ada/left", 2, "ada_left_10.png"),
        ("bob/right", 1, "bob_right_1.png"),
    ]
    assert dataset.notes == ("1 of 4 prints do not fit the pattern; they are left out",)
    with pytest.raises(DatasetError, match="no print fits the pattern"):
        load_dataset(tmp_path, pattern=r"x(?P<subject>\d)")
    touch(tmp_path, "eve_left_9.png")
    with pytest.raises(DatasetError, match="are the same impression, left_9"):
        load_dataset(tmp_path, pattern=r"[a-z]+_(?P<subject>[a-z]+)_(?P<impression>\d+)")
    with pytest.raises(DatasetError, match="--pattern finds fingers in other names"):
        load_dataset(tmp_path)


def test_a_manifest_is_a_database_of_its_own_name(tmp_path):
    touch(tmp_path, "x.png", "y.png", "z.png")
    manifest = tmp_path / "spring.csv"
    manifest.write_text("path,subject,dpi\nz.png,10,1000\nx.png,9,\ny.png,9,\n")
    (tmp_path / "dataset.toml").write_text('dpi = 569\nsensor = "optical"\npolarity = "white"\n')
    dataset = load_dataset(manifest)
    assert found_in(dataset) == [("9", 1, "x.png"), ("9", 2, "y.png"), ("10", 1, "z.png")]
    assert [i.dpi for i in dataset.impressions] == [569, 569, 1000]
    assert (dataset.name, dataset.sensor) == ("spring", "optical")
    (tmp_path / "dataset.toml").write_text('name = "all"\n')
    (tmp_path / "autumn.csv").write_text("path,subject\nx.png,1\ny.png,1\n")
    both = [load_dataset(manifest), load_dataset(tmp_path / "autumn.csv")]
    assert [d.name for d in with_unique_names(both)] == ["spring", "autumn"]
    manifest.write_text("path,subject,finger\nx.png,a,b\ny.png,a/b,\n")
    with pytest.raises(DatasetError, match="'a/b' is the name of a subject and of a subject's"):
        load_dataset(manifest)
    manifest.write_text("file,subject\nx.png,a\n")
    with pytest.raises(DatasetError, match=r"spring\.csv: line 1: no column path"):
        load_dataset(manifest)


def test_folders_are_fingers_where_the_database_has_no_prints_itself(tmp_path):
    for folder in ("ada/left", "ada/right", "bob/left"):
        (tmp_path / folder).mkdir(parents=True)
        touch(tmp_path / folder, "2.png", "10.png")
    dataset = load_dataset(tmp_path)
    assert found_in(dataset)[:3] == [
        ("ada/left", 1, "ada/left/2.png"),
        ("ada/left", 2, "ada/left/10.png"),
        ("ada/right", 1, "ada/right/2.png"),
    ]
    assert dataset.notes == ()
    note = "each folder in it is taken for one finger (--pattern for other layouts)"
    assert load_dataset(tmp_path / "ada").notes == (note,)


def test_templates_of_any_format_are_a_database(tmp_path):
    touch(tmp_path, "1_2.iso", "1_1.xyt", "2_1.json", "notes.xyt")
    (tmp_path / "2_1.json").write_text('{"format": "fpmatch-template"}')
    assert [i.name for i in load_dataset(tmp_path).impressions] == [
        "1_1.xyt",
        "1_2.iso",
        "2_1.json",
    ]


def impressions(*fingers_and_numbers):
    return [Impression(f, n, Path(f"{f}_{n}.tif")) for f, n in fingers_and_numbers]


def slow_pairs(prints, protocol):
    """The definition, pair by pair."""
    first = {f: min(i.number for i in prints if i.finger == f) for f in {i.finger for i in prints}}
    for (a, p), (b, q) in combinations(enumerate(prints), 2):
        genuine = p.finger == q.finger
        both_first = p.number == first[p.finger] and q.number == first[q.finger]
        if genuine or protocol == "extended" or both_first:
            yield a, b, genuine


@given(
    st.lists(st.tuples(st.integers(1, 4), st.integers(1, 5)), unique=True, max_size=12),
    st.sampled_from(PROTOCOLS),
)
def test_agrees_with_the_definition(prints, protocol):
    prints = impressions(*prints)
    pairs = choose_pairs(prints, protocol)
    columns = (pairs.probe.tolist(), pairs.reference.tolist(), pairs.genuine.tolist())
    assert list(zip(*columns, strict=True)) == list(slow_pairs(prints, protocol))
