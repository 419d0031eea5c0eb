"""Enrolling: each picture once, whatever fails, whoever is killed."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fpmatch.engine.engine import processes, serial
from fpmatch.errors import GalleryError
from fpmatch.gallery.enrol import enrol
from fpmatch.gallery.entry import Failure
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.names import NamePattern
from fpmatch.gallery.prints import find_prints
from fpmatch.reading import ASSUMED_DPI

HERE = Path(__file__).parent


@pytest.fixture
def extractor(monkeypatch):
    monkeypatch.syspath_prepend(str(HERE))
    import fake_prints

    return fake_prints.extractor


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


@pytest.fixture
def gallery(tmp_path):
    with open_gallery(tmp_path / "gallery.db", create=True) as gallery:
        yield gallery


def labels(gallery):
    return [str(entry.label) for entry in gallery.entries()]


def test_new_prints_are_enrolled_and_failures_kept(gallery, folder, extractor):
    result = enrol(gallery, find_prints([folder]), engine=serial(), extractor=extractor)
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


def test_again_nothing_is_extracted_but_what_failed(gallery, folder, extractor):
    prints = find_prints([folder])
    enrol(gallery, prints, engine=serial(), extractor=extractor)
    seen = []

    def noting(file):
        seen.append(file.path.name)
        return extractor(file)

    before = gallery.content_hash()
    result = enrol(gallery, prints, engine=serial(), extractor=noting)
    assert (result.enrolled, result.known, len(result.failures)) == (0, 24, 3)
    assert seen == ["7_1.tif"]
    assert gallery.content_hash() == before
    (folder / "7_1.tif").write_text("mended")
    (folder / "9_1.tif").write_text("new")
    result = enrol(gallery, find_prints([folder]), engine=serial(), extractor=noting)
    assert (result.enrolled, result.known, len(result.failures)) == (2, 24, 2)
    assert len(gallery.failures()) == 2


def test_any_number_of_workers_gives_the_same_gallery(folder, tmp_path, extractor):
    contents = []
    for workers in (1, 2):
        with open_gallery(tmp_path / f"{workers}.db", create=True) as gallery:
            enrol(gallery, find_prints([folder]), engine=processes(workers), extractor=extractor)
            contents.append((list(gallery.entries()), list(gallery.packed_templates())))
    assert contents[0] == contents[1]


def test_progress_counts_every_picture_once(gallery, folder, extractor):
    told = []
    enrol(
        gallery,
        find_prints([folder]),
        engine=serial(),
        extractor=extractor,
        progress=lambda *row: told.append(row),
    )
    assert told[0] == ("enrol", 0, 27)
    assert told[-1] == ("enrol", 27, 27)
    assert [done for _, done, _ in told] == sorted(done for _, done, _ in told)


def test_a_pattern_of_ones_own(gallery, tmp_path, extractor):
    for name in ("ada/left-1.png", "ada/right-1.png", "bob/left-1.png"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(name)
    pattern = NamePattern(r"(?P<subject>\w+)/(?P<finger>\w+)-(?P<impression>\d)")
    prints = find_prints([tmp_path / "ada", tmp_path / "bob"])
    result = enrol(gallery, prints, pattern=pattern, engine=serial(), extractor=extractor)
    assert result.enrolled == 3
    assert labels(gallery) == ["ada_left_1", "ada_right_1", "bob_left_1"]


def test_equal_names_in_two_folders_are_not_mixed_up(gallery, tmp_path, folder, extractor):
    other = tmp_path / "other"
    other.mkdir()
    (other / "1_1.tif").write_text("another finger")
    prints = find_prints([folder / "1_1.tif", other])
    result = enrol(gallery, prints, engine=serial(), extractor=extractor)
    (failure,) = result.failures
    assert failure.source == str(other / "1_1.tif")
    assert failure.reason == f"another picture is enrolled as 1_1 already ({folder}/1_1.tif)"


def test_resolutions_may_differ_and_are_told_apart(gallery, folder, extractor):
    (folder / "1_1.tif").write_text("untagged print")
    one, two = folder / "1_1.tif", folder / "1_2.tif"
    found = enrol(gallery, find_prints([one]), engine=serial(), extractor=extractor)
    assert found.noted == {ASSUMED_DPI: (one,)}
    enrol(gallery, find_prints([two], 569), engine=serial(), extractor=extractor)
    assert [entry.dpi for entry in gallery.entries()] == [500.0, 569.0]
    again = enrol(gallery, find_prints([one], 569), engine=serial(), extractor=extractor)
    assert [f.reason for f in again.failures] == ["enrolled already, at 500 dpi, not 569"]


def test_a_file_that_goes_away_is_a_failure(gallery, folder, extractor):
    prints = find_prints([folder / "1_1.tif", folder / "1_2.tif"])
    (folder / "1_1.tif").unlink()
    result = enrol(gallery, prints, engine=serial(), extractor=extractor)
    assert [f.reason for f in result.failures] == ["no such file or directory"]
    assert labels(gallery) == ["1_2"]


def test_a_gallery_that_cannot_be_written_ends_the_run(gallery, folder, extractor, monkeypatch):
    def full(*_: object) -> None:
        raise GalleryError("gallery.db: the disk is full")

    monkeypatch.setattr(gallery, "add", full)
    with pytest.raises(GalleryError, match="full"):
        enrol(gallery, find_prints([folder]), engine=serial(), extractor=extractor)


RUN = """
import sys
import fake_prints
from fpmatch.engine.engine import processes
from fpmatch.gallery.enrol import enrol
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.prints import find_prints
if __name__ == "__main__":
    with open_gallery(sys.argv[1], create=True) as gallery:
        tell = lambda stage, done, total: print(done, flush=True)
        enrol(gallery, find_prints(sys.argv[2:3]), engine=processes(int(sys.argv[3])),
              extractor=fake_prints.extractor, progress=tell)
"""


@pytest.fixture
def start(tmp_path):
    """Return a function that starts a process that enrols a folder of slow prints."""
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


@pytest.mark.skipif(sys.platform == "win32", reason="sends POSIX signals")
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
    last = start(where)
    last.communicate(timeout=60)
    assert last.returncode == 0
    with open_gallery(where) as gallery:
        assert sorted(labels(gallery)) == sorted(f"{k}_1" for k in range(60))
        assert gallery.failures() == []


@pytest.mark.skipif(sys.platform == "win32", reason="sends POSIX signals")
def test_two_runs_share_the_work_of_one_gallery(where, start):
    runs = [start(where), start(where)]
    for run in runs:
        run.communicate(timeout=60)
        assert run.returncode == 0
    with open_gallery(where) as gallery:
        assert sorted(labels(gallery)) == sorted(f"{k}_1" for k in range(60))
        assert gallery.failures() == []


def test_what_is_done_is_committed_a_few_pictures_at_a_time(
    gallery, folder, extractor, monkeypatch
):
    sizes = []
    add = gallery.add

    def noting(new, failures=()):
        sizes.append(len(new))
        return add(new, failures)

    monkeypatch.setattr(gallery, "add", noting)
    prints = [file for file in find_prints([folder]) if file.path.stem[0] in "12"]
    enrol(gallery, prints[:7], engine=serial(), extractor=extractor)
    assert sizes == [4, 3]
