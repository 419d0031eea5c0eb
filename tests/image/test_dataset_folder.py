import pytest

from fpmatch.errors import DatasetError
from fpmatch.image.dataset_folder import DatasetInfo, images_in, read_dataset_info


def test_images_come_in_the_order_of_their_numbers(tmp_path):
    for name in ("10_1.tif", "9_10.png", "9_2.JPG", "a.bmp", "9_2.json", "README.md", "._9_3.tif"):
        (tmp_path / name).touch()
    (tmp_path / "9_9.tif").mkdir()
    names = [path.name for path in images_in(tmp_path)]
    assert names == ["9_2.JPG", "9_10.png", "10_1.tif", "a.bmp"]


def test_a_folder_must_be_one(tmp_path):
    with pytest.raises(DatasetError, match="nowhere: no such folder"):
        images_in(tmp_path / "nowhere")
    (tmp_path / "file").touch()
    with pytest.raises(DatasetError, match="file: "):
        images_in(tmp_path / "file")


def test_a_description_says_what_it_says(tmp_path):
    assert read_dataset_info(tmp_path) == DatasetInfo(None, None, "")
    (tmp_path / "dataset.toml").write_text("dpi = 569\n")
    assert read_dataset_info(tmp_path) == DatasetInfo(None, 569.0, "")
    (tmp_path / "dataset.toml").write_text('polarity = "white"\n')
    assert read_dataset_info(tmp_path) == DatasetInfo(None, None, "", "white")
    (tmp_path / "dataset.toml").write_text("dpi = 50\n")
    with pytest.raises(DatasetError, match=r"dataset\.toml: .*50 dpi"):
        read_dataset_info(tmp_path)
