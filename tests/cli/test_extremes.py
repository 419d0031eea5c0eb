"""Numbers and texts at the end of what can be written: one line, status 2, nothing written."""

import re

import pytest

from tests.conftest import copied

DIGITS = "9" * 5_000
NUMBERS = ("nan", "-inf", "-1", "0", "1e999", "5e-324", DIGITS)
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


@pytest.mark.parametrize("value", NUMBERS)
def test_options_that_are_no_such_number_are_refused(run, prints, gallery, value):
    one, other = prints / "1_1.png", prints / "1_2.png"
    assert_one_line(run("verify", one, other, "--fmr", value))
    assert_one_line(run("inspect", one, "--dpi", value), "dpi")
    assert_one_line(run("gallery", "remove", gallery, "--", value if value != "0" else 10**20))
    if value not in {"0", "5e-324"}:
        assert_one_line(run("verify", one, other, "--threshold", value))
        assert_one_line(run("identify", gallery, one, "--threshold", value))


def test_a_blank_subject_is_a_failure_of_its_file(run, prints, tmp_path):
    folder, gallery = copied(prints, tmp_path / "set", "1_1.png"), tmp_path / "new.db"
    (folder / "1_1.png").rename(folder / " _1.png")
    result = run("enrol", gallery, folder, "--pattern", r"(?P<subject>\s)_.", "--workers", 1)
    assert (result.exit_code, result.stderr.count("subject: is blank")) == (1, 1)


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
