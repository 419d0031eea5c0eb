from __future__ import annotations

import os
from pathlib import Path

import pytest

from fpmatch.errors import GalleryError
from fpmatch.gallery.entry import Label
from fpmatch.gallery.names import NamePattern, as_text


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("101_3.tif", Label("101", "", "3")),
        ("/a/b/007_01.png", Label("007", "", "01")),
        ("1_2_3.tif", None),
        ("x101_3.tif", None),
        ("101_3.5.tif", None),
        ("101_3", Label("101", "", "3")),
        ("101_3/x.tif", None),
    ],
)
def test_default_reads_fvc_names(name, label):
    assert NamePattern().label(Path(name)) == label


def test_a_pattern_may_read_folders_and_needs_no_finger():
    pattern = NamePattern(r"(?P<subject>\w+)/((?P<finger>\w+)-)?(?P<impression>\d+)")
    assert pattern.label(Path("/x/ada/index-2.png")) == Label("ada", "index", "2")
    assert pattern.label(Path("/x/ada/2.png")) == Label("ada", "", "2")
    assert pattern.label(Path("/x/ada/y/index.png")) is None


def test_alternatives_and_flags_stay_within_the_pattern():
    pattern = NamePattern("(?i)p(?P<subject>[0-9]+)|q[0-9]+")
    assert pattern.label(Path("/x/P7.png")) == Label("7")
    assert pattern.label(Path("/x/q7.png")) is None  # no subject
    assert pattern.label(Path("/x/xP7.png")) is None


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
    assert as_text(path) == r"/prints/\xff_1.tif"
    label = NamePattern(r"(?P<subject>.+)_(?P<impression>\d)").label(path)
    assert label == Label(r"\xff", "", "1")
