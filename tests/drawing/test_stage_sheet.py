import cv2
import numpy as np
import pytest

from fpmatch.drawing.stages.pictures import stage_picture
from fpmatch.drawing.stages.sheet import write_stages
from fpmatch.errors import ImageError, OutputError


@pytest.fixture
def stages(whorl):
    return {
        "input": whorl,
        "mask": whorl < 250,
        "orientation": np.where(whorl < 250, 0.8, np.nan),
        "skeleton": whorl < 40,
        "minutiae": np.array([[60.0, 80.0, 0.0, 1, 90]]),
    }


def contact_sheet(stages, folder):
    """Return the sheet, RGB, that is written with the stages."""
    *_, file = write_stages(stages, folder)
    return cv2.imread(str(file))[:, :, ::-1]


def test_the_sheet_shows_every_stage_at_its_size(tmp_path, stages, whorl):
    sheet = np.ascontiguousarray(contact_sheet(stages, tmp_path))
    height, width = whorl.shape
    assert sheet.shape[0] * sheet.shape[1] > len(stages) * height * width
    for name in ("input", "mask", "orientation", "skeleton"):
        picture = stage_picture(name, stages[name], whorl)
        difference = cv2.matchTemplate(sheet, picture, cv2.TM_SQDIFF)
        row, column = np.unravel_index(difference.argmin(), difference.shape)
        found = sheet[row : row + height, column : column + width]
        np.testing.assert_array_equal(found, picture, name)


def test_large_and_tiny_stages_share_a_sheet(tmp_path):
    stages = {"big": np.eye(3000, 2000), "small": np.eye(3), "thin": np.ones((1, 900))}
    assert max(contact_sheet(stages, tmp_path).shape) < 2000


def test_files_are_numbered_in_the_order_of_the_stages(tmp_path, stages):
    folder = tmp_path / "a" / "b"
    written = write_stages(stages, folder)
    names = [
        "01_input.png", "02_mask.png", "03_orientation.png", "04_skeleton.png", "05_minutiae.png",
        "contact_sheet.png",
    ]  # fmt: skip
    assert [p.name for p in written] == names
    assert sorted(p.name for p in folder.iterdir()) == names


def test_names_of_stages_cannot_leave_the_folder(tmp_path):
    written = write_stages({"../../etc: x": np.eye(4)}, tmp_path / "out")
    assert written[0] == tmp_path / "out" / "01__etc_x.png"
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


def test_an_error_leaves_what_was_there(tmp_path, whorl):
    with pytest.raises(ImageError, match="stage odd: "):
        write_stages({"input": whorl, "odd": np.zeros(3)}, tmp_path / "out")
    with pytest.raises(OutputError, match="no stage"):
        write_stages({}, tmp_path / "out")
    assert not (tmp_path / "out").exists()
    (tmp_path / "out").write_bytes(b"")
    with pytest.raises(OutputError, match="out: "):
        write_stages({"a": np.eye(4)}, tmp_path / "out")
    assert (tmp_path / "out").read_bytes() == b""
