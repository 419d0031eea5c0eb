"""No file ever contains a decrypted template: while commands run, and after all are killed."""

import os
import pickle
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from made_prints import entries_of, print_of

from fpmatch.gallery.batch.sources import pack
from fpmatch.gallery.encryption.keys import make_keys
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.store.stored_template import pack_template, unpack_template
from fpmatch.matching.registry import get_matcher

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform != "linux", reason="kills process groups"),
]
SAMPLES = Path(__file__).parents[3] / "sample_data"
LABELS = [Label(str(finger), "", str(k)) for finger in range(16) for k in (1, 2, 3)]
PRINTS = [print_of(int(label.subject), int(label.impression)) for label in LABELS]
RUN = 24  # bytes: six minutiae or so
LIMIT_S = 60


def runs(template):
    """Yield bytes from the middle of each form that the package gives a template."""
    packed = pack_template(template)
    stored = unpack_template(packed)
    columns = [c for one in (template, stored) for c in (one.minutiae.x, one.minutiae.xy)]
    arrays = (column.astype(kind) for column in columns for kind in ("f8", "f4", "u2", "i4"))
    prepared = pickle.dumps(get_matcher("unit-circle").prepare(stored))
    for content in (packed, pack(stored), prepared, *(array.tobytes() for array in arrays)):
        at = len(content) // 2 // 8 * 8
        run = content[at : at + RUN]
        if len(run) == RUN and len(set(run)) > RUN // 3:  # of no other print
            yield run


WANTED = {run for k in (0, 16, 35) for run in runs(PRINTS[k])}


def readable_in(folder):
    """Return the files below a folder that contain something of a template."""
    readable = set()
    for at, _, names in os.walk(folder):
        for path in (Path(at, name) for name in names):
            with suppress(OSError):  # deleted meanwhile, or a socket
                content = path.read_bytes()
                if any(run in content for run in WANTED):
                    readable.add(path)
    return readable


@pytest.fixture
def place():
    """Return a folder for all files of commands: an encrypted gallery, probes, a new home."""
    # of a short name, as fork servers need it
    with TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        place = Path(folder)
        for name in ("tmp", "home", "cache", "probes"):
            (place / name).mkdir()
        make_keys(f"file:{place / 'keys.txt'}")
        make_gallery(place / "secret.db", encrypt=True, key=f"file:{place / 'keys.txt'}")
        for number in (1, 2, 3):
            shutil.copy(SAMPLES / f"101_{number}.tif", place / "probes")
        yield place


def make_gallery(path, **options):
    with open_gallery(path, create=True, **options) as gallery:
        gallery.add(entries_of(*PRINTS, labels=LABELS))


def started(place, words):
    """Start a command in a process group of its own."""
    changed = {"TMPDIR": "tmp", "HOME": "home", "XDG_CACHE_HOME": "cache"}
    environment = {**os.environ, **{name: str(place / text) for name, text in changed.items()}}
    environment["FPMATCH_KEY"] = f"file:{place / 'keys.txt'}"
    command = [sys.executable, "-m", "fpmatch", *words.split()]
    how = {"cwd": place, "env": environment, "start_new_session": True}
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, **how)


def kill(process):
    """Kill a command with all its workers."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)


COMMANDS = [
    "identify secret.db probes/101_1.tif --workers 2",
    "score --references secret.db --probes secret.db --workers 2 -o OUT.csv",
    "enrol secret.db probes --workers 2",
    "gallery rewrite secret.db --encrypt",
    "serve --gallery secret.db --port 0",
]


@pytest.mark.parametrize("words", COMMANDS, ids=lambda words: words.split()[0])
def test_commands_write_nothing_of_an_encrypted_gallery(place, words):
    """All files are read again and again until it ends; then it is killed in the middle."""
    ends = not words.startswith("serve")
    begin = time.monotonic()
    with started(place, words.replace("OUT", "whole")) as process:
        while process.poll() is None and time.monotonic() < begin + (LIMIT_S if ends else 2):
            assert readable_in(place) == set()
        took = time.monotonic() - begin
        kill(process)
        assert process.wait() in ({0, 1} if ends else {-signal.SIGKILL}), process.stderr.read()
    with started(place, words.replace("OUT", "killed")) as process:
        time.sleep(0.75 * took)
        kill(process)
    assert readable_in(place) == set()
    make_gallery(place / "plain.db")  # whose templates this test would see
    assert readable_in(place) == {place / "plain.db"}
