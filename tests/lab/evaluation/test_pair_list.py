import pytest

from fpmatch.errors import DatasetError, ScoringError
from fpmatch.gallery.batch.pair_list import PrintNames, read_pairs
from fpmatch.lab.evaluation.databases.dataset import load_dataset
from fpmatch.lab.evaluation.run import evaluate, load_datasets

ROWS = [("a 1.png", "b.png", True), ("c.png", "a 1.png", False)]


@pytest.mark.parametrize(
    "text",
    [
        "a 1.png,b.png,1\nc.png,a 1.png,0\n",
        "a 1.png\tb.png\t1\r\nc.png\ta 1.png\t0\r\n",
        "\ufeffa 1.png;b.png;genuine\n\nc.png;a 1.png;impostor\n",
        'reference,probe,note,genuine\n"b.png","a 1.png",x,1\na 1.png,c.png,,0',
    ],
)
def test_rows_in_every_form(tmp_path, text):
    path = tmp_path / "list"
    path.write_text(text, encoding="utf-8", newline="")
    found = read_pairs(path)
    assert [row[1:] for row in found.rows] == ROWS
    assert found.labelled


def test_spaces_separate_where_nothing_else_does(tmp_path):
    (tmp_path / "list").write_text("\n  a   b  1\nc d 0\n")
    assert [tuple(row) for row in read_pairs(tmp_path / "list").rows] == [
        (2, "a", "b", True),
        (3, "c", "d", False),
    ]
    (tmp_path / "list").write_text("probe reference\na b\n")
    assert not read_pairs(tmp_path / "list").labelled


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "the list holds no pairs"),
        ("a b 1\nc d 2\n", "line 2, column genuine: must be 1 or 0, not '2'"),
        ("a,b,1\nc,d,\n", "line 2, column genuine: is empty, unlike on line 1"),
        ("a,b\nc\n", "line 2: expected a probe and a reference"),
        ("a\n", "line 1: expected a probe and a reference"),
        (b"a,b\n\xffc,d\n", "line 2: not a CSV file in UTF-8"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(tmp_path, text, reason):
    path = tmp_path / "list"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ScoringError, match="list: ") as caught:
        read_pairs(path)
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)
    with pytest.raises(ScoringError, match="cannot be read: no such file"):
        read_pairs(tmp_path / "gone")


def test_prints_are_found_by_any_path_that_ends_so(tmp_path):
    names = PrintNames(["ada/1.png", "bob/1.png", "bob/2.png"], tmp_path / "db")
    found = [
        "bob/1.png",
        "db/bob/1",
        str(tmp_path / "db" / "ada" / "1.png"),
        "./2.png",
        "2",
        "ada\\1",
    ]
    assert [names.find(name) for name in found] == [1, 1, 0, 2, 2, 0]
    missing = ["1.png", "1", "eve/1.png", "other/bob/1.png", "", ".", "/", "ng"]
    assert [names.find(name) for name in missing] == [None] * 8


def write(path, *rows):
    path.write_text("".join(" ".join(map(str, row)) + "\n" for row in rows))
    return path


def test_fingers_by_name_unless_the_list_states_them(make_database, tmp_path):
    folder = make_database(fingers=3, impressions=2)
    plain = load_dataset(folder, pairs=write(tmp_path / "a", ("1_1", "1_2"), ("2_1", "1_2")))
    assert plain.pairs.genuine.tolist() == [True, False]
    assert [i.name for i in plain.impressions] == ["1_1.tif", "1_2.tif", "2_1.tif"]
    rows = ("1_1", "1_2", 0), ("2_1", "1_2", 1), ("1_2", "2_1", 1), ("2_1", "3_1", 1)
    stated = load_dataset(folder, pairs=write(tmp_path / "b", *rows))
    assert stated.pairs.genuine.tolist() == [False, True, True]
    assert {i.finger for i in stated.impressions} == {""}  # not known: the names say otherwise
    rows = ("1_1", "1_2", 1), ("2_1", "1_2", 0)
    agreeing = load_dataset(folder, pairs=write(tmp_path / "c", *rows))
    assert [i.finger for i in agreeing.impressions] == ["1", "1", "2"]


def test_any_names_in_any_folders_will_do_where_the_list_states_all(tmp_path, bench):
    for name in ("x/1_1.tif", "x/1_2.tif", "y/z/2_1.tif"):
        path = tmp_path / "db" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("print")
    listed = write(tmp_path / "list", ("x/1_1", "1_2.tif", 1), ("db/x/1_1.tif", "2_1", 0))
    dataset = load_dataset(tmp_path / "db", pairs=listed)
    report = evaluate([dataset], matcher=bench.MATCHER, extractor=bench.extractor, workers=1)
    assert (report.genuine, report.impostor, report.protocol) == (1, 1, "list")
    assert report.sets[0].prints == 3


@pytest.mark.parametrize(
    ("rows", "reason"),
    [
        ([("1_1", "1_1", 1)], "line 1: 1_1 is compared with itself"),
        ([("1_1", "9_1", 1)], "line 1: there is no reference '9_1'"),
        ([("1_1", "1_2", 1), ("1_2", "1_1", 0)], "line 2, column genuine"),
    ],
)
def test_lists_that_cannot_be(make_database, tmp_path, rows, reason):
    folder = make_database(fingers=2, impressions=2)
    with pytest.raises(ScoringError) as caught:
        load_dataset(folder, pairs=write(tmp_path / "list", *rows))
    assert reason in str(caught.value)


def test_a_list_goes_with_one_database(make_database, tmp_path):
    folders = [make_database("a"), make_database("b")]
    with pytest.raises(DatasetError, match="a list of pairs goes with one database"):
        load_datasets(folders, pairs=write(tmp_path / "list", ("1_1", "1_2")))
