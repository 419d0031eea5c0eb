"""Texts of JSON and TOML: every fault is one error of one line."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.base.parsing import ParseError, parse_json, parse_toml

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda one: st.lists(one) | st.dictionaries(st.text(), one),
).filter(lambda value: "Infinity" not in json.dumps(value))


@given(VALUES)
def test_what_is_json_is_read(value):
    assert parse_json(json.dumps(value)) == value  # pairs of surrogates are characters
    assert parse_json(b"\xef\xbb\xbf" + json.dumps(value, ensure_ascii=False).encode()) == value


HOSTILE = {
    "[" * 20_000: "nested too deeply",
    '{"a":' * 20_000: "nested too deeply",
    "9" * 5_000: "a number has too many digits",
    '{"dpi": -' + "9" * 5_000 + "}": "a number has too many digits",
    "NaN": "NaN is not a number",
    "[-Infinity]": "-Infinity is not a number",
    r'"\ud800"': "half of a surrogate pair",
    r'{"\udcff": 1}': "half of a surrogate pair",
    "": "Expecting value",
    '"a\nb"': "Invalid control character",
    b"\xff\xfe": "not text in UTF-8: byte 0xff at 0",
    b'"\xed\xa0\x80"': "not text in UTF-8: byte 0xed at 1",
}


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_what_is_not_json_is_one_line(text):
    with pytest.raises(ParseError) as caught:
        parse_json(text)
    assert HOSTILE[text] in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("a = " + "[" * 20_000, "nested too deeply"),
        ("dpi = " + "9" * 5_000, "a number has too many digits"),
        (b"a = '\xff'", "not text in UTF-8"),
        ("a = 1\na = 2", "Cannot overwrite a value"),
        ('a = "\\ud800"', "Escaped character is not a Unicode scalar value"),
        ("a = \x1b", "Invalid value"),
        (".".join("a" * 20_000) + " = 1", "a key with more than 1000 parts"),
    ],
    ids=range(7),
)
def test_what_is_not_toml_is_one_line(text, reason):
    with pytest.raises(ParseError) as caught:
        parse_toml(text)
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)
    assert parse_toml('dpi = 500\nname = "é"') == {"dpi": 500, "name": "é"}
