"""Prints in folders of fingers and of subjects."""

import pytest

from fpmatch.errors import DatasetError, ImageReadError
from fpmatch.gallery.listing.entry import NamePattern
from fpmatch.gallery.listing.folders import prints_in
from fpmatch.gallery.listing.prints import find_prints


@pytest.fixture
def people(tmp_path):
    """Return the function that makes empty files by their paths below a folder."""

    def make(*names):
        for name in names:
            path = tmp_path / "people" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch()
        return tmp_path / "people"

    return make


def labels_of(files):
    return {file.name: str(file.label) for file in files}


def test_a_folder_is_a_finger_or_a_subject_of_fingers(people):
    root = people("ada/10.png", "ada/9.png", "bob/left/a.png", "bob/right/a.tif", ".git/x/y.png")
    assert labels_of(find_prints([root])) == {
        "ada/9.png": "ada_9",
        "ada/10.png": "ada_10",
        "bob/left/a.png": "bob_left_a",
        "bob/right/a.tif": "bob_right_a",
    }


@pytest.mark.parametrize("extra", ["ada/left/deep/1.png", "bob/1.png"])
def test_other_depths_are_refused(people, extra):
    root = people("ada/left/1.png", "bob/left/1.png", extra)
    with pytest.raises(DatasetError, match="the prints must all be in folders"):
        find_prints([root])


def test_folders_of_databases_are_no_fingers(people):
    root = people("db1/101_1.png", "db1/102_1.png", "db2/101_1.png")
    with pytest.raises(DatasetError, match="db1: prints of several fingers by their names FFF_M"):
        find_prints([root])
    root = people("db1/102_1.png")
    (root / "db1" / "102_1.png").unlink()
    assert labels_of(find_prints([root])) == {
        "db1/101_1.png": "db1_101_1",
        "db2/101_1.png": "db2_101_1",
    }


def test_a_pattern_reaches_into_folders_that_have_no_prints_above(people):
    root = people("ada/left-1.png", "ada/x/left-2.png")
    pattern = NamePattern(r"(?P<subject>\w+)/(?P<finger>\w+)-(?P<impression>\d)")
    found = labels_of(find_prints([root], pattern=pattern))
    assert found == {"ada/left-1.png": "ada_left_1", "ada/x/left-2.png": "x_left_2"}


def test_the_description_above_has_the_resolution_of_folders_without_one(people):
    root = people("ada/1.png", "bob/1.png")
    (root / "dataset.toml").write_text("dpi = 569\n")
    (root / "bob" / "dataset.toml").write_text("dpi = 1000\n")
    assert [file.dpi for file in find_prints([root])] == [569, 1000]


def test_links_that_lead_back_are_not_followed(people):
    root = people("ada/1.png")
    try:
        (root / "ada" / "back").symlink_to(root, target_is_directory=True)
    except OSError:
        pytest.skip("no links here")
    assert [file.name for file in find_prints([root])] == ["ada/1.png"]


def test_a_folder_of_empty_folders_has_no_prints(people):
    root = people("ada/notes.txt")
    for options in ({}, {"pattern": NamePattern()}):
        with pytest.raises(ImageReadError, match="the folder contains no images and no templates"):
            find_prints([root], **options)


def test_images_come_in_the_order_of_their_numbers(people):
    names = ("10_1.tif", "9_10.png", "9_2.JPG", "a.bmp", "9_2.json", "README.md", "._9_3.tif")
    root = people(*names, "9_9.tif/x")
    assert [file.name for file in find_prints([root])] == [
        "9_2.JPG",
        "9_10.png",
        "10_1.tif",
        "a.bmp",
    ]
    with pytest.raises(DatasetError, match=r"README\.md: cannot be listed: "):
        prints_in(root / "README.md")
