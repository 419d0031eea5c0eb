"""Enrolling: each picture once, whatever fails, whoever is killed."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from made_prints import extractor

from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Failure
from fpmatch.gallery.listing.prints import find_prints
from fpmatch.gallery.tasks import enrol as enrol_module


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
    labels = [str(entry.label) for entry in gallery.entries()]
    assert labels == [f"{s}_{i}" for s in range(1, 7) for i in range(1, 5)]
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


RUN = """
import sys
import made_prints
from fpmatch.gallery.engine.engine import make_engine
from fpmatch.gallery.tasks import enrol
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.prints import find_prints
enrol.PRINTS_PER_COMMIT = 8
if __name__ == "__main__":
    with open_gallery(sys.argv[1], create=True) as gallery:
        tell = lambda stage, done, total: print(done, flush=True)
        enrol.enrol(gallery, find_prints(sys.argv[2:]), engine=make_engine(1),
                    extractor=made_prints.extractor, progress=tell)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="sends POSIX signals")
def test_killed_at_any_moment_it_loses_nothing_and_goes_on(where, tmp_path):
    script, folder = tmp_path / "run.py", tmp_path / "slow"
    script.write_text(RUN)
    folder.mkdir()
    for number in range(60):
        (folder / f"{number}_1.tif").write_text(f"slow print {number}")
    path = os.pathsep.join([str(Path(__file__).parents[1]), *sys.path])
    command = [sys.executable, script, where, folder]
    how = {"env": {**os.environ, "PYTHONPATH": path}, "stdout": subprocess.PIPE, "text": True}
    moments = random.Random(5)
    enrolled = kills = 0
    for kill in (True, True, True, False):
        with subprocess.Popen(command, **how) as process:
            for line in process.stdout:
                if kill and int(line) >= enrolled + 4:
                    time.sleep(moments.uniform(0, 0.15))
                    process.send_signal(signal.SIGKILL)
                    break
        kills += process.returncode == -signal.SIGKILL
        with open_gallery(where) as gallery:
            assert len(gallery) >= enrolled
            enrolled = len(gallery)
            assert sum(1 for _ in gallery.templates()) == enrolled
            assert gallery.failures() == []
    assert (kills > 0, process.returncode, enrolled) == (True, 0, 60)
