"""Numbers and texts at the end of what can be written: one line, status 2, nothing written."""

import json
import re
import sqlite3

import pytest

from tests.conftest import assert_refused, copied

DIGITS = "9" * 5_000
NUMBERS = ("nan", "inf", "-inf", "-1", "0", "1e308", "1e999", "5e-324", DIGITS)
RESOLUTIONS = (*NUMBERS, "99", "4001")
CONTROLS = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u2028-\u202e\ud800-\udfff]")


def assert_one_line(result, reason=""):
    """Check for status 2 and one error, by fpmatch or by click, that no terminal obeys."""
    assert result.exit_code == 2, result.output
    assert isinstance(result.exception, SystemExit)
    assert result.stdout == ""
    assert len([line for line in result.stderr.splitlines() if "rror: " in line]) == 1
    assert not CONTROLS.search(result.stderr)
    assert max(map(len, result.stderr.splitlines())) < 2_500
    assert reason in result.stderr


@pytest.mark.parametrize("value", RESOLUTIONS)
def test_resolutions_out_of_range_are_refused_before_work(run, prints, tmp_path, value):
    one, new = prints / "1_1.png", tmp_path / "new"
    for words in (
        ("verify", one, one),
        ("extract", one, "-o", new),
        ("convert", one, f"{new}.iso"),
        ("inspect", one),
        ("identify", f"{new}.db", one),
        ("enrol", f"{new}.db", one),
        ("score", "--references", prints, "--probes", prints, "-o", f"{new}.csv"),
    ):
        assert_one_line(run(*words, "--dpi", value), "dpi")
    for option in ("--probe-dpi", "--reference-dpi"):
        assert_one_line(run("verify", one, one, option, value), "dpi")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("value", NUMBERS)
def test_options_that_are_no_such_number_are_refused(run, prints, gallery, value):
    one, other = prints / "1_1.png", prints / "1_2.png"
    for words, usable in (
        (("verify", one, other, "--fmr", value), ()),
        (("gallery", "remove", gallery, "--", value), ("0",)),
        (("verify", one, other, "--threshold", value), ("0", "5e-324")),
        (("identify", gallery, one, "--threshold", value), ("0", "5e-324")),
    ):
        if value not in usable:
            assert_one_line(run(*words))


def test_numbers_beyond_those_of_a_database(run, prints, gallery):
    assert_refused(run("gallery", "remove", gallery, 10**20), "large")
    assert_one_line(run("gallery", "list", f"postgresql://{'a' * 5_000}/prints"))
    words = ("identify", gallery, prints / "1_1.png")
    assert run(*words, "-k", 10**20, "--workers", 1).exit_code == 0


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("a = " + "[" * 20_000, "nested"),
        ("dpi = " + DIGITS, "digits"),
        ("dpi = nan", "resolution of nan dpi"),
        ("dpi = 1e999", "resolution of inf dpi"),
        ("dpi = 5e-324", "resolution of 4.94066e-324 dpi"),
        ("dpi = true", "dpi must be a number"),
        ('name = "\\u001b[2J"', "name"),
        ('name = "  "', "name is empty"),
        (b"\xff", "not text in UTF-8"),
        (".".join("a" * 20_000) + " = 1", "1000"),
        ("# " + "x" * 2**20, "1048576"),
    ],
    ids=range(11),
)
def test_a_description_of_a_folder_that_is_none(run, prints, tmp_path, content, reason):
    folder = copied(prints, tmp_path / "set", "1_1.png", "1_2.png")
    path = folder / "dataset.toml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    out = tmp_path / "out"
    for words in (
        ("evaluate", folder, "--workers", 1, "--scores", out),
        ("score", "--references", folder, "--probes", folder, "-o", f"{out}.csv"),
        ("enrol", f"{out}.db", folder, "--workers", 1),
        ("extract", folder / "1_1.png", "-o", out),
    ):
        result = run(*words)
        assert_one_line(result, reason)
        assert str(path) in result.stderr
    assert not list(tmp_path.glob("out*.*"))


@pytest.mark.parametrize("column", ["subject", "finger", "impression"])
@pytest.mark.parametrize(
    "text", ["a\0b", "\x1b[2J", '"a\nb"', "\x9b31m", "\u202eb", "a\u2028b", DIGITS]
)
def test_labels_in_a_manifest_are_short_text_of_one_line(run, prints, tmp_path, column, text):
    manifest = tmp_path / "manifest.csv"
    cells = {"path": prints / "1_1.png", "subject": "ada", "finger": "1", "impression": "1"}
    cells[column] = text
    manifest.write_text(",".join(cells) + "\n" + ",".join(map(str, cells.values())) + "\n")
    result = run("enrol", tmp_path / "new.db", manifest, "--workers", 1)
    assert_one_line(result, f"column {column}: ")
    assert f"{manifest}: line " in result.stderr
    assert not (tmp_path / "new.db").exists()


@pytest.mark.parametrize(
    ("name", "pattern"),
    [(" _1.png", r"(?P<subject>\s)_(?P<impression>.)"), ("\t_1.png", "(?P<subject>.*)_.")],
    ids=["blank", "tab"],
)
def test_a_blank_subject_is_a_failure_of_its_file(run, prints, tmp_path, name, pattern):
    folder, gallery = copied(prints, tmp_path / "set", "1_1.png"), tmp_path / "new.db"
    (folder / "1_1.png").rename(folder / name)
    result = run("enrol", gallery, folder, "--pattern", pattern, "--workers", 1)
    if name[0] == " ":
        assert (result.exit_code, result.stderr.count("subject: is blank")) == (1, 1)
    else:  # printed as \t, which is a name like any other
        assert result.exit_code == 0
        assert r"\t" in run("gallery", "list", gallery).stdout


def test_a_label_of_an_older_gallery_reaches_no_terminal(run, gallery, tmp_path):
    """Galleries of other versions may hold any text: it is shown escaped, JSON reads it back."""
    path = tmp_path / "old.db"
    path.write_bytes(gallery.read_bytes())
    with sqlite3.connect(path) as database:
        database.execute(
            "UPDATE fpmatch_entry SET subject = 'a\x1b[2J\nb', finger = id, source = 'c\u202e\x9b'"
        )
    database.close()
    shown = run("gallery", "list", path)
    assert shown.exit_code == 0
    assert not CONTROLS.search(shown.stdout)
    assert len(shown.stdout.splitlines()) == 4  # the header, too
    listed = json.loads(run("gallery", "list", path, "--json").stdout)
    assert {(one["subject"], one["source"]) for one in listed} == {("a\x1b[2J\nb", "c\u202e\x9b")}


@pytest.mark.parametrize(
    "words",
    [
        ("verify", "--\x1b[2J"),
        ("\x1b[2J",),
        ("gallery", "\x9b"),
        ("verify", "a", "b", "--dpi", "\x1b"),
    ],
)
def test_what_a_command_line_repeats_is_escaped(run, words):
    assert_one_line(run(*words))
