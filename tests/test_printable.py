"""Text of foreign origin: what is escaped, that nothing else is, and that nothing escapes twice."""

import ast
import json
import os
import unicodedata
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import fpmatch
from fpmatch.errors import FpmatchError, without_path
from fpmatch.printable import (
    as_encodable,
    as_file_name,
    as_text,
    json_text,
    printable,
    printable_lines,
)

PACKAGE = Path(fpmatch.__file__).parent
ANY_TEXT = st.text(st.characters(), max_size=20) | st.text(
    st.sampled_from("\x00\x1b\x7f\x85\x9b\n\r\t\u2028\u202e\u2066\ud800\udcff\udfff=+-@a\\"),
    max_size=9,
)


def acts_on_a_terminal(letter):
    """Return whether a character is a control, separator, surrogate or bidirectional control."""
    return unicodedata.category(letter) in {"Cc", "Zl", "Zp", "Cs"} or (
        unicodedata.bidirectional(letter) in {"LRE", "RLE", "LRO", "RLO", "PDF"}
        or unicodedata.bidirectional(letter) in {"LRI", "RLI", "FSI", "PDI"}
    )


@given(ANY_TEXT)
def test_nothing_that_acts_on_a_terminal_is_left_and_all_else_stays(text):
    shown = printable(text)
    assert not any(map(acts_on_a_terminal, shown))
    assert shown == printable(shown)
    if not any(map(acts_on_a_terminal, text)) and not set(text) & set("\u061c\u200e\u200f"):
        assert shown == text


@given(ANY_TEXT)
def test_lines_are_kept_where_they_are_our_own(text):
    assert printable_lines(text).split("\n") == [printable(line) for line in text.split("\n")]


@given(ANY_TEXT)
def test_text_is_utf_8_and_otherwise_as_it_was(text):
    made = as_text(text)
    made.encode()
    if not any("\ud800" <= letter <= "\udfff" for letter in text):
        assert made == text


@pytest.mark.skipif(os.name != "posix", reason="names are bytes on POSIX only")
@given(st.binary(max_size=12).filter(lambda name: b"\\" not in name))
def test_the_name_of_any_file_is_found_from_its_text(name):
    file = os.fsdecode(name)
    assert as_file_name(as_text(file)) == file
    if file.isascii() or not set(file) & set("\u061c\u200e\u200f"):
        assert as_text(as_file_name(printable(file))) in {
            as_text(file),
            as_file_name(printable(file)),
        }


@given(
    st.recursive(
        ANY_TEXT | st.integers() | st.none(),
        lambda one: st.lists(one) | st.dictionaries(ANY_TEXT, one),
    )
)
@example("\U0001f9ff é")
def test_json_is_ascii_and_reads_back_but_for_lone_surrogates(document):
    text = json_text(document)
    assert text.isascii()
    assert "\x7f" not in text
    back = json.loads(text)
    json.dumps(back, ensure_ascii=False).encode()
    if json.dumps(document, ensure_ascii=False).isascii():
        assert back == document


@given(ANY_TEXT, ANY_TEXT)
def test_an_error_is_one_printable_line(message, path):
    error = FpmatchError(message, path=path)
    assert str(error) == printable(str(error))
    assert error.path == path
    if path:
        assert without_path(str(error), path) == error.detail


def test_a_stream_that_cannot_encode_gets_escapes():
    class Narrow:
        encoding = "ascii"

    assert as_encodable("é\udcff", Narrow()) == r"\xe9\udcff"


def test_commands_print_through_one_home():
    """What is not constant is printed by `fpmatch.cli.notes` alone."""
    prints = {"print", "click.echo", "click.secho", "sys.stdout.write", "sys.stderr.write"}
    for file in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and ast.unparse(node.func) in prints:
                constant = all(isinstance(one, ast.Constant) for one in node.args)
                assert constant or file.name == "notes.py", (file, node.lineno)
