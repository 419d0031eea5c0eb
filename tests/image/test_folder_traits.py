import numpy as np
import pytest
from PIL import Image

from fpmatch.errors import DatasetError
from fpmatch.image import folder_traits
from fpmatch.image.dataset_folder import DatasetInfo, read_dataset_info
from fpmatch.image.folder_traits import FolderReader, find_traits
from fpmatch.image.io.read import read_image
from fpmatch.image.quality.polarity import INVERTED


def folder_of(root, name, images):
    folder = root / name
    folder.mkdir()
    paths = [folder / f"{number}_1.png" for number in range(len(images))]
    for path, image in zip(paths, images, strict=True):
        Image.fromarray(image).save(path, dpi=(500, 500))
    return paths


def test_folders_decide_each_for_itself(tmp_path, pressed):
    dark = folder_of(tmp_path, "dark", pressed)
    white = folder_of(tmp_path, "white", [255 - image for image in pressed])
    found = find_traits([*dark, *white, dark[0].parent / "gone.png"])
    assert found == {tmp_path / "dark": "dark", tmp_path / "white": "white"}
    reader = FolderReader(read_image, found)
    assert reader(white[0]).notes == (INVERTED,)
    assert np.array_equal(reader(white[0]).pixels, pressed[0])
    assert reader(dark[0]).notes == ()


def test_a_doubtful_image_follows_its_folder(tmp_path, pressed, stripes):
    paths = folder_of(tmp_path, "white", [255 - image for image in (*pressed, stripes)])
    assert read_image(paths[-1]).notes == ()
    reader = FolderReader(read_image, find_traits(paths))
    assert np.array_equal(reader(paths[-1]).pixels, stripes)


def test_small_folders_decide_together(tmp_path, pressed, monkeypatch):
    monkeypatch.setattr(folder_traits, "polarity_evidence", lambda *_: -3.0)
    alone = folder_of(tmp_path, "alone", pressed[:1])
    assert find_traits(alone) == {tmp_path / "alone": "auto"}
    other = folder_of(tmp_path, "other", pressed[:1])
    both = {tmp_path / "alone": "white", tmp_path / "other": "white"}
    assert find_traits([*alone, *other]) == both


def test_folders_with_few_images_of_one_place_decide_together(tmp_path, pressed, stripes):
    misleading = folder_of(tmp_path, "one", [255 - stripes])
    others = folder_of(tmp_path, "other", [255 - image for image in pressed])
    places = dict.fromkeys([tmp_path / "one", tmp_path / "other"], tmp_path)
    found = find_traits([*misleading, *others], places=places)
    assert found == {tmp_path / "one": "white", tmp_path / "other": "white"}
    (tmp_path / "dataset.toml").write_text('polarity = "dark"\n')
    assert set(find_traits(others, places=places).values()) == {"dark"}
    assert set(find_traits(others).values()) == {"white"}
    manifest = dict.fromkeys(places, tmp_path / "manifest.csv")
    assert set(find_traits(others, places=manifest).values()) == {"dark"}


def test_what_is_known_is_not_looked_for(tmp_path, pressed, monkeypatch):
    monkeypatch.setattr(folder_traits, "polarity_evidence", None)
    paths = folder_of(tmp_path, "dark", pressed[:2])
    assert find_traits(paths, polarity="white") == {tmp_path / "dark": "white"}
    description = tmp_path / "dark" / "dataset.toml"
    description.write_text('polarity = "dark"\n')
    assert find_traits(paths) == {tmp_path / "dark": "dark"}
    description.write_text('polarity = "grey"\n')
    with pytest.raises(DatasetError, match=r"dataset\.toml: no polarity 'grey'"):
        find_traits(paths)


def test_of_large_folders_a_few_images_are_looked_at(tmp_path, monkeypatch, pressed):
    looked = []

    def reader(path, **how):
        looked.append(path)
        assert how == {"polarity": "dark"}
        return read_image(tmp_path / "small" / "0_1.png")

    folder_of(tmp_path, "small", pressed[:1])
    monkeypatch.setattr(folder_traits, "polarity_evidence", lambda *_: 1.0)
    paths = [tmp_path / f"{number}.png" for number in range(1000)]
    assert find_traits(paths, reader=reader) == {tmp_path: "dark"}
    assert len(looked) == len(set(looked)) == folder_traits.MOST_IMAGES
    assert {paths[0], paths[-1]} <= set(looked)


def test_a_description_says_what_it_says(tmp_path):
    assert read_dataset_info(tmp_path) == DatasetInfo(None, None, "")
    (tmp_path / "dataset.toml").write_text("dpi = 569\n")
    assert read_dataset_info(tmp_path) == DatasetInfo(None, 569.0, "")
    (tmp_path / "dataset.toml").write_text('polarity = "white"\n')
    assert read_dataset_info(tmp_path) == DatasetInfo(None, None, "", "white")
    (tmp_path / "dataset.toml").write_text("dpi = 50\n")
    with pytest.raises(DatasetError, match=r"dataset\.toml: .*50 dpi"):
        read_dataset_info(tmp_path)
