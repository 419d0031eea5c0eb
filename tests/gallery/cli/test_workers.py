"""The commands that work on several cores, as programs that are interrupted."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fpmatch.errors import GalleryError
from fpmatch.gallery.gallery import open_gallery
from fpmatch.image.skeleton._trace_kernel import COMPILED

SAMPLE = Path(__file__).parents[3] / "sample_data"
COPIES = 8 if COMPILED else 1  # uncompiled, each print takes seconds
PROGRAM = """
import signal
import fpmatch.gallery.tasks.enrol
from fpmatch.cli import main
fpmatch.gallery.tasks.enrol.SECONDS_PER_COMMIT = 0.0  # what is done is kept at once
signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored in a background job
main(prog_name="fpmatch")
"""


@pytest.fixture
def many(tmp_path):
    """Return a folder of the sample prints, several times over, no two alike to the byte."""
    folder = tmp_path / "many"
    folder.mkdir()
    for source in sorted(SAMPLE.glob("*.tif")):
        finger, impression = source.stem.split("_")
        for copy in range(COPIES):
            target = folder / f"{int(finger) + 100 * copy}_{impression}.tif"
            target.write_bytes(source.read_bytes() + bytes(copy))
    return folder


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="sends POSIX signals")
def test_interrupted_it_says_nothing_keeps_what_is_done_and_goes_on(tmp_path, many, kernels_line):
    gallery, pictures = tmp_path / "prints.db", len(list(many.iterdir()))
    words = [sys.executable, "-c", PROGRAM, "enrol", gallery, many, "--workers", "2"]
    process = subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True
    )
    while not _enrolled(gallery):
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGINT)
    # Returns once nobody holds the pipes any more: neither the command nor a worker.
    assert process.communicate(timeout=60) == (b"", kernels_line.encode())
    assert process.returncode == 130
    done = _enrolled(gallery)
    assert 0 < done < pictures
    again = subprocess.run(words, capture_output=True, text=True, check=True)
    assert f"enrolled {pictures - done} of {pictures} pictures, {done} were" in again.stdout


def _enrolled(gallery):
    """Return how many are enrolled; 0 where the gallery is not made yet."""
    try:
        with open_gallery(gallery) as opened:
            return len(opened)
    except GalleryError:
        return 0
