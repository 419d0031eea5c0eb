import pytest

from fpmatch.errors import DatasetError
from fpmatch.image.dataset_folder import DatasetInfo, FolderReader, read_dataset_info


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", DatasetInfo()),
        ('dpi = 569\nname = "A"\nsensor = "optical"', DatasetInfo("A", 569.0, "optical")),
        ('polarity = "white"', DatasetInfo(polarity="white")),
        ("dpi = 50", "50 dpi"),
        ("dpi = true", "dpi must be a number"),
        ("dpi = ", "not a readable TOML file"),
        ("#" * 2**20 + "#", "not a readable TOML file: more than 1048576 bytes"),
        ('name = "a\\nb"', "name must be text of one line"),
        ('name = " "', "name is empty"),
        ('polarity = "grey"', "no polarity 'grey'"),
    ],
    ids=lambda value: str(value)[:20],
)
def test_a_description_is_read_or_refused_in_one_line(tmp_path, text, expected):
    assert read_dataset_info(tmp_path) == DatasetInfo()
    (tmp_path / "dataset.toml").write_text(text)
    if isinstance(expected, DatasetInfo):
        assert read_dataset_info(tmp_path) == expected
        return
    with pytest.raises(DatasetError, match=rf"dataset\.toml: .*{expected}") as caught:
        read_dataset_info(tmp_path)
    assert "\n" not in str(caught.value)


def test_the_polarity_is_that_given_else_of_the_folder_else_of_the_place(tmp_path):
    one, manifest = tmp_path / "one" / "1_1.png", tmp_path / "prints.csv"
    one.parent.mkdir()
    alone = FolderReader(lambda path, **how: (path, how), dpi=260.0)
    places = [
        alone,
        *(FolderReader(alone.reader, places={one.parent: p}) for p in (tmp_path, manifest)),
    ]
    assert alone(one) == (one, {"polarity": "auto", "dpi": 260.0})
    (tmp_path / "dataset.toml").write_text('polarity = "white"\n')
    assert [read(one)[1]["polarity"] for read in places] == ["auto", "white", "white"]
    (one.parent / "dataset.toml").write_text('polarity = "dark"\n')
    assert [read(one)[1]["polarity"] for read in places] == ["dark"] * 3
    assert FolderReader(alone.reader, "white")(one)[1] == {"polarity": "white", "dpi": None}
