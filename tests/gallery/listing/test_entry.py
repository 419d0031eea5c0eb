"""Labels in names, and cells of tables: what a spreadsheet would compute is escaped."""

import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import GalleryError
from fpmatch.gallery.listing.csv_rows import csv_cell
from fpmatch.gallery.listing.entry import FVC_PATTERN, Label, NamePattern

FOLDERS = r"(?P<subject>\w+)/((?P<finger>\w+)-)?(?P<impression>\d+)"
SOCOFING = r"(?P<subject>\d+)__[MF]_(?P<finger>\w+)_finger"
ALTERNATIVES = "(?i)p(?P<subject>[0-9]+)|q[0-9]+"


@pytest.mark.parametrize(
    ("pattern", "name", "label"),
    [
        (FVC_PATTERN, "101_3.tif", Label("101", "", "3")),
        (FVC_PATTERN, "/a/b/007_01.png", Label("007", "", "01")),
        (FVC_PATTERN, "1_2_3.tif", None),
        (FVC_PATTERN, "x101_3.tif", None),
        (FVC_PATTERN, "101_3.5.tif", None),
        (FVC_PATTERN, "101_3", Label("101", "", "3")),
        (FVC_PATTERN, "101_3/x.tif", None),
        (FOLDERS, "/x/ada/index-2.png", Label("ada", "index", "2")),
        (FOLDERS, "/x/ada/2.png", Label("ada", "", "2")),
        (FOLDERS, "/x/ada/y/index.png", None),
        (ALTERNATIVES, "/x/P7.png", Label("7")),
        (SOCOFING, "/x/100__M_Left_index_finger.BMP", Label("100", "Left_index")),
        (ALTERNATIVES, "/x/q7.png", None),  # no subject
        (ALTERNATIVES, "/x/xP7.png", None),
    ],
)
def test_labels_in_names(pattern, name, label):
    assert NamePattern(pattern).label(Path(name)) == label


@pytest.mark.parametrize(
    "text", ["(", "no groups", r"(?P<impression>\d)", r"(?P<subject>\d)(?P<toe>\d)", "(?P<subject>"]
)
def test_what_is_no_pattern_is_refused_in_one_line(text):
    with pytest.raises(GalleryError, match="pattern ") as caught:
        NamePattern(text)
    assert "\n" not in str(caught.value)


@pytest.mark.skipif(os.name != "posix", reason="names are bytes on POSIX only")
def test_names_that_are_no_text_become_some():
    path = Path(os.fsdecode(b"/prints/\xff_1.tif"))
    label = NamePattern(r"(?P<subject>.+)_(?P<impression>\d)").label(path)
    assert label == Label(r"\xff", "", "1")


ANY_TEXT = st.text(max_size=20) | st.text(
    st.sampled_from("\x00\x1b\n\r\t\u2028\ud800=+-@＝－a\\"), max_size=9
)


@given(ANY_TEXT)
def test_no_cell_begins_as_a_formula(text):
    cell = csv_cell(text)
    assert cell == csv_cell(cell)
    assert cell[:1] not in {"=", "@", "＝", "＋", "－", "＠", "\t", "\r"}
    if cell[:1] in {"+", "-"}:
        float(cell)
