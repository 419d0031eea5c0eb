import pytest

from fpmatch.errors import DatasetError
from fpmatch.image.dataset_folder import DatasetInfo, read_dataset_info


def test_a_description_says_what_it_says(tmp_path):
    assert read_dataset_info(tmp_path) == DatasetInfo(None, None, "")
    (tmp_path / "dataset.toml").write_text("dpi = 569\n")
    assert read_dataset_info(tmp_path) == DatasetInfo(None, 569.0, "")
    (tmp_path / "dataset.toml").write_text('polarity = "white"\n')
    assert read_dataset_info(tmp_path) == DatasetInfo(None, None, "", "white")
    (tmp_path / "dataset.toml").write_text("dpi = 50\n")
    with pytest.raises(DatasetError, match=r"dataset\.toml: .*50 dpi"):
        read_dataset_info(tmp_path)
