import pytest

from fpmatch.errors import ScoringError
from fpmatch.gallery.batch.plan import PrintNames, iterate_pairs

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
    assert [row[1:] for row in iterate_pairs(path)] == ROWS


def test_spaces_separate_where_nothing_else_does(tmp_path):
    (tmp_path / "list").write_text("\n  a   b  1\nc d 0\n")
    assert [tuple(row) for row in iterate_pairs(tmp_path / "list")] == [
        (2, "a", "b", True),
        (3, "c", "d", False),
    ]
    (tmp_path / "list").write_text("probe reference\na b\n")
    assert [tuple(row) for row in iterate_pairs(tmp_path / "list")] == [(2, "a", "b", None)]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("a b 1\nc d 2\n", "line 2, column genuine: must be 1 or 0, not '2'"),
        ("a,b\nc\n", "line 2: expected a probe and a reference"),
        ("a\n", "line 1: expected a probe and a reference"),
        (b"a,b\n\xffc,d\n", "line 2: not a CSV file in UTF-8"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(tmp_path, text, reason):
    path = tmp_path / "list"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ScoringError, match="list: ") as caught:
        list(iterate_pairs(path))
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)
    with pytest.raises(ScoringError, match="cannot be read: no such file"):
        list(iterate_pairs(tmp_path / "gone"))


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
