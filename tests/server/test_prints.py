"""Names of uploads are one short line, whatever a client calls its file."""

from hypothesis import given
from hypothesis import strategies as st

from fpmatch.server.prints import LONGEST_NAME, shown_name


@given(st.text())
def test_a_name_is_one_short_line_without_folders(given_name):
    name = shown_name(given_name, "probe")
    assert name
    assert name.isprintable()
    assert len(name) <= LONGEST_NAME
    assert not set(name) & set("/\\")
    assert name.strip(".")


def test_a_plain_name_stays_as_it_is():
    assert shown_name("101_3.tif", "probe") == "101_3.tif"
    assert shown_name(None, "probe") == "probe"
