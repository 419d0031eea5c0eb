"""Work on a gallery, in this process: what it reads, compares and lists."""

import json
import re

import pytest
import sqlalchemy as sa

from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import FVC_PATTERN, Label
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher
from fpmatch.server.gallery import describe_gallery, enrol_print, identify_print
from fpmatch.server.prints import PrintOptions, Upload
from fpmatch.server.settings import Limits

READING = PrintOptions(Limits())


@pytest.fixture
def place(gallery):
    open_gallery(gallery, create=True).close()
    return str(gallery)


def enrol(place, data, subject, finger="", impression=""):
    label = Label(subject, finger, impression)
    return enrol_print(Upload("a.png", data), READING, place, label, FVC_PATTERN)


def test_identify_lists_subjects_as_the_command_does(run, place, prints, tmp_path):
    for finger in ("left", "right"):
        enrol(place, prints["1_1.png" if finger == "left" else "2_1.png"], "ada", finger)
    probe = tmp_path / "1_2.png"
    probe.write_bytes(prints["1_2.png"])
    upload = Upload("1_2.png", probe.read_bytes())
    answer = identify_print(upload, READING, place, DEFAULT_MATCHER, 10, 0.0)
    document = json.loads(run("identify", place, probe, "--json").stdout)
    (printed,) = document["probes"]
    assert [one["subject"] for one in answer["candidates"]] == ["ada"]
    (ours,), (theirs,) = answer["candidates"], printed["candidates"]
    assert ours.pop("transform")["rotation_deg"] == pytest.approx(90, abs=1)
    assert ours.pop("pairs") > ours.pop("rms_px")
    assert {**ours, "source": ""} == {**theirs, "source": ""}


def test_a_new_print_is_compared_with_few_of_its_finger_before_it_is_stored(
    place, prints, monkeypatch
):
    compared = []
    matcher = get_matcher(DEFAULT_MATCHER)
    real = type(matcher).compare

    def compare(self, *sides):
        with open_gallery(place) as opened:
            compared.append(len(opened))
        return real(self, *sides)

    for k in range(12):  # the same minutiae in other files
        enrol(place, prints["2_1.png"] + bytes(k), "ada", impression=str(k))
    monkeypatch.setattr(type(matcher), "compare", compare)
    done = enrol(place, prints["1_1.png"], "ada", impression="new")
    assert done["unmatched"].startswith("ada_new does not match ada_4 or 7 other impressions: ")
    assert compared == [12] * 8
    assert enrol(place, prints["1_2.png"], "eve")["unmatched"] is None


def test_a_gallery_is_counted_without_reading_its_rows(place, prints):
    assert describe_gallery(place)["impressions"] == 0
    enrol(place, prints["1_1.png"], "ada")
    read = []

    def note(connection, cursor, statement, parameters, context, executemany):
        read.extend(re.findall(r"\bfpmatch_entry\.(\w+)", statement))

    sa.event.listen(sa.Engine, "before_cursor_execute", note)
    try:
        counted = describe_gallery(place)
    finally:
        sa.event.remove(sa.Engine, "before_cursor_execute", note)
    assert (counted["impressions"], counted["subjects"]) == (1, 1)
    assert set(read) == {"subject"}  # which an index has
