"""Enrolling: each picture once, whatever fails, whoever is killed."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from made_prints import extractor, finger_extractor

from fpmatch.errors import GalleryError
from fpmatch.gallery.engine.engine import processes, serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Failure
from fpmatch.gallery.listing.prints import find_prints
from fpmatch.gallery.tasks import enrol as enrol_module
from fpmatch.prints.reading import ASSUMED_DPI

HERE = Path(__file__).parents[1]


def enrol(gallery, *places, dpi=None, **options):
    """Enrol the prints of some places in this process."""
    options = {"engine": serial(), "extractor": extractor, **options}
    return enrol_module.enrol(gallery, find_prints(places, dpi), **options)


@pytest.fixture
def folder(tmp_path):
    """Return a folder of 24 prints of 6 fingers, and some that cannot be enrolled."""
    folder = tmp_path / "prints"
    folder.mkdir()
    for subject in range(1, 7):
        for impression in range(1, 5):
            (folder / f"{subject}_{impression}.tif").write_text(f"print {subject} {impression}")
    (folder / "7_1.tif").write_text("broken")
    (folder / "8_1.tif").write_text("print 1 1")
    (folder / "holiday.png").write_text("print of a beach")
    return folder


def labels(gallery):
    return [str(entry.label) for entry in gallery.entries()]


def test_new_prints_are_enrolled_and_failures_kept(gallery, folder):
    reported = []
    result = enrol(gallery, folder, progress=lambda *row: reported.append(row))
    assert (result.enrolled, result.known) == (24, 0)
    expected = {
        "7_1.tif": "broken",
        "8_1.tif": f"the same picture is enrolled as 1_1 already ({folder}/1_1.tif)",
        "holiday.png": r"its name does not fit the pattern (?P<subject>\d+)_(?P<impression>\d+)",
    }
    failures = [Failure(str(folder / name), reason) for name, reason in expected.items()]
    assert sorted(result.failures, key=lambda f: f.source) == failures
    assert gallery.failures() == failures
    assert labels(gallery) == [f"{s}_{i}" for s in range(1, 7) for i in range(1, 5)]
    assert (reported[0], reported[-1]) == (("enrol", 0, 27), ("enrol", 27, 27))
    assert [done for _, done, _ in reported] == sorted(done for _, done, _ in reported)


def test_again_nothing_is_extracted_but_what_failed(gallery, folder):
    enrol(gallery, folder)
    seen = []

    def noting(file):
        seen.append(file.path.name)
        return extractor(file)

    before = gallery.content_hash()
    result = enrol(gallery, folder, extractor=noting)
    assert (result.enrolled, result.known, len(result.failures)) == (0, 24, 3)
    assert seen == ["7_1.tif"]
    assert gallery.content_hash() == before
    (folder / "7_1.tif").write_text("mended")
    (folder / "9_1.tif").write_text("new")
    result = enrol(gallery, folder, extractor=noting)
    assert (result.enrolled, result.known, len(result.failures)) == (2, 24, 2)
    assert len(gallery.failures()) == 2


def test_any_number_of_workers_gives_the_same_gallery(folder, tmp_path):
    contents = []
    for workers in (1, 2):
        with open_gallery(tmp_path / f"{workers}.db", create=True) as gallery:
            enrol(gallery, folder, engine=processes(workers))
            contents.append((list(gallery.entries()), list(gallery.packed_templates())))
    assert contents[0] == contents[1]


def test_resolutions_may_differ_and_are_told_apart(gallery, folder):
    one, two = folder / "1_1.tif", folder / "1_2.tif"
    one.write_text("untagged print")
    assert enrol(gallery, one).noted == {ASSUMED_DPI: (one,)}
    enrol(gallery, two, dpi=569)
    assert [entry.dpi for entry in gallery.entries()] == [500.0, 569.0]
    (failure,) = enrol(gallery, one, dpi=569).failures
    assert failure.reason == "enrolled already, at 500 dpi, not 569"


def test_a_file_that_goes_away_is_a_failure(gallery, folder):
    prints = find_prints([folder / "1_1.tif", folder / "1_2.tif"])
    (folder / "1_1.tif").unlink()
    result = enrol_module.enrol(gallery, prints, engine=serial(), extractor=extractor)
    assert [f.reason for f in result.failures] == ["no such file or directory"]
    assert labels(gallery) == ["1_2"]


def test_a_few_pictures_are_committed_at_a_time_until_that_fails(gallery, folder, monkeypatch):
    sizes = []
    add = gallery.add_packed

    def noting(new, failures=()):
        if len(sizes) == 2:
            raise GalleryError("gallery.db: the disk is full")
        sizes.append(len(new))
        return add(new, failures)

    monkeypatch.setattr(gallery, "add_packed", noting)
    monkeypatch.setattr(enrol_module, "PRINTS_PER_COMMIT", 8)
    monkeypatch.setattr(enrol_module, "SECONDS_PER_COMMIT", 1e9)
    files = sorted(folder.iterdir())
    enrol(gallery, *files[:13])
    assert sizes == [8, 5]
    with pytest.raises(GalleryError, match="full"):
        enrol(gallery, *files)


RUN = """
import sys
import made_prints
from fpmatch.gallery.engine.engine import processes
from fpmatch.gallery.tasks.enrol import enrol
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.prints import find_prints
if __name__ == "__main__":
    with open_gallery(sys.argv[1], create=True) as gallery:
        tell = lambda stage, done, total: print(done, flush=True)
        enrol(gallery, find_prints(sys.argv[2:3]), engine=processes(int(sys.argv[3])),
              extractor=made_prints.extractor, progress=tell)
"""


@pytest.fixture
def start(tmp_path):
    """Return a function that starts a process that enrols a folder of slow prints."""
    if sys.platform == "win32":
        pytest.skip("sends POSIX signals")
    script, folder = tmp_path / "run.py", tmp_path / "slow"
    script.write_text(RUN)
    folder.mkdir()
    for number in range(60):
        (folder / f"{number}_1.tif").write_text(f"slow print {number}")

    def begin(where, workers=1):
        return subprocess.Popen(
            [sys.executable, script, where, folder, str(workers)],
            env={**os.environ, "PYTHONPATH": os.pathsep.join([str(HERE), *sys.path])},
            stdout=subprocess.PIPE,
            text=True,
        )

    return begin


def finish(where, *runs):
    """Wait for some runs, and check that they have enrolled all slow prints."""
    for run in runs:
        run.communicate(timeout=60)
        assert run.returncode == 0
    with open_gallery(where) as gallery:
        assert sorted(labels(gallery)) == sorted(f"{k}_1" for k in range(60))
        assert gallery.failures() == []


@pytest.mark.slow
def test_killed_at_any_moment_it_loses_nothing_and_goes_on(where, start):
    moments = random.Random(5)
    enrolled = kills = 0
    for _ in range(3):
        with start(where) as process:
            for line in process.stdout:
                if int(line) >= enrolled + 4:
                    break
            time.sleep(moments.uniform(0, 0.15))
            process.send_signal(signal.SIGKILL)
        kills += process.returncode == -signal.SIGKILL
        with open_gallery(where) as gallery:
            assert len(gallery) >= enrolled
            enrolled = len(gallery)
            assert sum(1 for _ in gallery.templates()) == enrolled
    assert kills
    finish(where, start(where))


def write_prints(folder, **fingers):
    """Write files that show an impression of a finger each: a name without ``_`` and a finger."""
    folder.mkdir()
    for name, finger in fingers.items():
        (folder / f"{name[1:]}.tif").write_text(f"{finger} {name[-1]}")
    return folder


@pytest.fixture
def colliding(tmp_path):
    """Return two folders of prints; in the second, names are those of other people."""
    first = write_prints(tmp_path / "first", _1_1=1, _1_2=1, _2_1=2, _2_2=2)
    return first, write_prints(tmp_path / "second", _1_3=11, _1_4=11, _2_3=2, _2_4=12, _3_1=3)


@pytest.mark.parametrize("encrypt", [False, True])
def test_prints_that_join_other_people_are_counted_and_named(where, colliding, encrypt, source):
    first, second = colliding
    with open_gallery(where, create=True, encrypt=encrypt) as gallery:
        done = enrol(gallery, first, extractor=finger_extractor)
        assert (done.added, done.unmatched) == ({}, ())
        done = enrol(gallery, second, extractor=finger_extractor)
        assert (done.enrolled, done.failures) == (5, ())
        assert done.added == {"1": 2, "2": 2}
        assert [Path(one.source).name for one in done.unmatched] == [
            "1_3.tif",
            "1_4.tif",
            "2_4.tif",
        ]
        reason = "1_3 does not match 1_1 or 1 other impressions: another finger"
        assert done.unmatched[0].reason.startswith(reason)
        again = enrol(gallery, second, extractor=finger_extractor)
        assert (again.known, again.added, again.unmatched) == (5, {}, ())


def test_strict_refuses_them_and_leaves_nothing_of_them(where, colliding):
    first, second = colliding
    with open_gallery(where, create=True) as gallery:
        enrol(gallery, first, extractor=finger_extractor)
        done = enrol(gallery, second, extractor=finger_extractor, strict=True)
        assert (done.enrolled, done.added, done.unmatched) == (2, {"2": 1}, ())
        refused = [Path(failure.source).name for failure in done.failures]
        assert refused == ["1_3.tif", "1_4.tif", "2_4.tif"]
        assert done.failures[0].reason.startswith("refused: 1_3 does not match")
        assert gallery.failures() == list(done.failures)
        assert labels(gallery) == ["1_1", "1_2", "2_1", "2_2", "2_3", "3_1"]
