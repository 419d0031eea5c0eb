"""The index of a gallery follows it, whoever changes it, and whatever happens to its files."""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from made_prints import DAMAGES, changed, entry_of, scattered

from fpmatch.errors import OutputError
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import free_space, open_gallery
from fpmatch.gallery.index import follow as index_files
from fpmatch.gallery.index.follow import GalleryIndex
from fpmatch.gallery.index.segment import Segment
from fpmatch.gallery.listing.entry import Label
from fpmatch.matching.matchers.unit_circle import MATCHER


def new_entry(number, finger=None):
    label = Label(str(number if finger is None else finger), impression=str(number))
    return entry_of(number, scattered(number, 12), label)


def index_of(gallery, notes=None):
    """Return an index as another process opens it; there must be no notes unless they are taken."""

    def note(text):
        if notes is None:
            pytest.fail(text)
        notes.append(text)

    return GalleryIndex(MATCHER, engine=serial(), note=note)


def contents(index, gallery):
    """Return number and content, by number, of the prints of an index that follows a gallery."""
    index.follow(gallery)
    prints = [
        (one.number[0], [array.tobytes() for array in one.arrays().values()])
        for segment in index.segments
        for k in range(len(segment))
        for one in [Segment.joined([(segment, np.arange(len(segment)) == k)])]
    ]
    left = [prints[k] for k in index.stored.tolist()]
    assert index.numbers.tolist() == [number for number, _ in left] == sorted(index.numbers)
    return left


def afresh(gallery):
    """Return the same of an index that is built from nothing, in another folder."""
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setattr("fpmatch.gallery.index.follow.kept_folders", lambda _: [Path(folder)])
        made = contents(index_of(gallery, notes=[]), gallery)
    assert [number for number, _ in made] == gallery.digests()[0].tolist()
    return made


def files_of(gallery):
    folder = gallery.file.with_name(f"{gallery.file.name}.prepared")
    return sorted(folder.glob("*"))


@pytest.fixture
def filled(where):
    """Return an open gallery of ten prints of five fingers, on either kind of database."""
    with open_gallery(where, create=True) as opened:
        opened.add([new_entry(number, number // 2) for number in range(10)])
        yield opened


def test_an_index_is_kept_and_opened_again(filled, monkeypatch):
    first = contents(index_of(filled), filled)
    assert len(first) == 10
    monkeypatch.setattr("fpmatch.gallery.index.follow._build", None)
    assert contents(index_of(filled), filled) == first == contents(index_of(filled), filled)


def test_two_open_indexes_see_the_changes_of_each_other(filled):
    one, other = index_of(filled), index_of(filled)
    assert contents(one, filled) == contents(other, filled)
    for number in range(10, 30):
        filled.add([new_entry(number, number // 2)])
        if number % 7 == 0:
            filled.remove([number - 3])
        first, second = (one, other) if number % 2 else (other, one)
        assert contents(first, filled) == contents(second, filled)
    assert (
        contents(one, filled)
        == contents(other, filled)
        == contents(index_of(filled), filled)
        == afresh(filled)
    )


def test_only_what_is_new_is_built(filled, monkeypatch):
    index, built = index_of(filled), []
    index.follow(filled)
    build = GalleryIndex._built
    monkeypatch.setattr(
        GalleryIndex,
        "_built",
        lambda self, gallery, engine, rows, *_: (
            built.append(len(rows)) or build(self, gallery, engine, rows, *_)
        ),
    )
    filled.add([new_entry(number) for number in (20, 21, 22)])
    assert len(contents(index, filled)) == len(contents(index_of(filled), filled)) == 13
    filled.remove([1])
    assert len(contents(index, filled)) == len(contents(index_of(filled), filled)) == 12
    assert [count for count in built if count] == [3]


@given(st.lists(st.integers(0, 9), min_size=1, max_size=12))
@settings(max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_whatever_is_done_the_index_is_that_of_the_gallery(tmp_path_factory, steps):
    """Each step adds some prints, removes some, or opens the index again."""
    folder = tmp_path_factory.mktemp("steps")
    with open_gallery(folder / "g.db", create=True) as gallery, pytest.MonkeyPatch.context() as p:
        p.setattr("fpmatch.gallery.index.follow.MOST_PRINTS", 6)
        index, number = index_of(gallery), 0
        for step in steps:
            enrolled = [entry.id for entry in gallery.entries()]
            match step:
                case 0 | 1 | 2 | 3 | 4:
                    gallery.add([new_entry(number + k, (number + k) % 3) for k in range(step + 1)])
                    number += step + 1
                case 5 | 6 | 7 if enrolled:
                    gallery.remove(enrolled[:: step - 3])
                case 8:
                    index = index_of(gallery)
                case 9:
                    free_space(gallery)
            index.follow(gallery)
        assert contents(index, gallery) == contents(index_of(gallery), gallery) == afresh(gallery)


def test_damaged_entries_are_known_to_every_index(gallery):
    gallery.add([new_entry(number) for number in range(4)])
    changed(gallery.file, "UPDATE fpmatch_entry SET template = x'00' WHERE id = 2")
    assert [row[0] for row in contents(index_of(gallery), gallery)] == [1, 3, 4]
    gallery.damaged.clear()
    assert len(contents(index_of(gallery), gallery)) == 3
    assert [*gallery.damaged] == [2]
    gallery.remove([2])
    gallery.damaged.clear()
    assert len(contents(index_of(gallery), gallery)) == 3
    assert not gallery.damaged


@pytest.mark.parametrize("damage", DAMAGES)
def test_what_is_damaged_is_built_again_with_a_note(gallery, damage):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fpmatch.gallery.index.follow.MOST_PRINTS", 4)
        gallery.add([new_entry(number, number // 3) for number in range(10)])
        expected = contents(index_of(gallery), gallery)
        _, path, _ = whole = files_of(gallery)
        path.write_bytes(DAMAGES[damage](path.read_bytes()))
        notes = []
        assert contents(index_of(gallery, notes), gallery) == expected
        assert contents(index_of(gallery), gallery) == expected
    assert notes == [f"files of the index of {gallery.name} are damaged: built again"]
    assert len({*files_of(gallery)} & {*whole}) == 2


def test_files_of_a_killed_process_are_deleted(gallery):
    """It had removed a print, or merged two segments, and was killed before it deleted the old."""
    gallery.add([new_entry(number) for number in range(6)])
    contents(index_of(gallery), gallery)
    (old,) = files_of(gallery)
    content = old.read_bytes()
    gallery.remove([2])
    gallery.add([new_entry(9)])
    expected = contents(index_of(gallery), gallery)
    left = files_of(gallery)
    assert old not in left
    old.write_bytes(content)
    old.with_suffix(".index").write_bytes(b"of an older version")
    assert contents(index_of(gallery), gallery) == expected
    assert files_of(gallery) == left


@pytest.mark.parametrize("of", ["gallery", "version"])
def test_the_index_of_another_gallery_or_version_is_not_used(gallery, tmp_path, monkeypatch, of):
    gallery.add([new_entry(number) for number in range(5)])
    expected = contents(index_of(gallery), gallery)
    if of == "version":
        monkeypatch.setattr(index_files, "__version__", "99.0")
    else:
        with open_gallery(tmp_path / "other.db", create=True) as other:
            other.add([new_entry(50 + number) for number in range(5)])
            contents(index_of(other), other)
            folder = files_of(gallery)[0].parent
            shutil.rmtree(folder)
            shutil.copytree(files_of(other)[0].parent, folder)
    notes = []
    assert contents(index_of(gallery, notes), gallery) == expected
    why = "are of another version or gallery: built again"
    assert notes == [f"files of the index of {gallery.name} {why}"] * (of == "version")
    assert contents(index_of(gallery), gallery) == expected
    assert len(files_of(gallery)) == 1


def test_entries_that_were_exchanged_are_indexed_again(gallery):
    """As where a copy of the gallery takes its place, in which others were enrolled."""
    gallery.add([new_entry(number) for number in range(5)])
    index = index_of(gallery, notes := [])
    contents(index, gallery)
    gallery.remove([5])
    changed(gallery.file, "UPDATE sqlite_sequence SET seq = 4 WHERE name = 'fpmatch_entry'")
    gallery.add([new_entry(9)])
    assert contents(index, gallery) == afresh(gallery)
    assert len(notes) <= 1


def test_on_a_full_disk_the_index_is_in_memory(gallery, monkeypatch):
    gallery.add([new_entry(number) for number in range(4)])
    contents(index_of(gallery), gallery)
    before = {path: path.read_bytes() for path in files_of(gallery)}

    def full(path, *_, **__):
        raise OutputError("cannot be written: no space left on device", path=path)

    with monkeypatch.context() as patch:
        patch.setattr(index_files, "write_arrays", full)
        notes = []
        index = index_of(gallery, notes)
        for number in range(4, 8):
            gallery.add([new_entry(number)])
            assert contents(index, gallery) == afresh(gallery)
        why = "cannot be written: no space left on device"
        assert notes == [f"the index of {gallery.name} is kept in memory: {why}"]
        assert {path: path.read_bytes() for path in files_of(gallery)} == before
        gallery.remove([3, 5])  # what cannot be copied without them is deleted
        assert files_of(gallery) == []
        assert contents(index, gallery) == afresh(gallery)
    gallery.add([new_entry(9)])
    assert contents(index, gallery) == contents(index_of(gallery), gallery) == afresh(gallery)


def test_an_index_in_the_home_folder_is_noted_and_reached_by_removal(gallery, monkeypatch):
    """Where the gallery's own folder cannot be written."""
    gallery.add([new_entry(number) for number in range(6)])

    def refused(path, **_):
        if path.name.endswith(".prepared"):
            raise OSError(30, "Read-only file system")
        path.mkdir(parents=True, exist_ok=True)

    monkeypatch.setattr(index_files, "make_folder", refused)
    beside, home = index_files.kept_folders(gallery)
    contents(index_of(gallery, notes := []), gallery)
    (note,) = notes
    assert note.startswith(f"the index of {gallery.name} is kept in {home}: ")
    assert "read-only" in note.lower()
    (before,) = home.glob("*.segment")
    size = before.stat().st_size
    gallery.remove([2])
    (after,) = home.glob("*.segment")
    assert after.stat().st_size < size
    assert not beside.exists()
    left = [number for number, _ in contents(index_of(gallery, []), gallery)]
    assert left == [1, 3, 4, 5, 6]


def test_an_install_without_kernels_erases_a_print_and_keeps_the_index(gallery):
    gallery.add([new_entry(number) for number in range(6)])
    expected = contents(index_of(gallery), gallery)
    (path,) = files_of(gallery)
    script = [
        *("import sys, importlib.util as u", "find = u.find_spec"),
        "u.find_spec = lambda name, *a: None if name.endswith('_kernel') else find(name, *a)",
        "from fpmatch.gallery.gallery import open_gallery",
        "from fpmatch.matching.constants import COMPILED",
        "assert not COMPILED",
        "open_gallery(sys.argv[1]).remove([2])",
        "assert not [k for k in sys.modules if k.startswith('fpmatch.gallery.index._')]",
    ]
    subprocess.run([sys.executable, "-c", "\n".join(script), gallery.file], check=True)
    (now,) = files_of(gallery)
    assert now != path
    assert contents(index_of(gallery), gallery) == [one for one in expected if one[0] != 2]


WORK = """
import sys
from pathlib import Path
import platformdirs
sys.path[:0] = sys.argv[4:]
from test_follow import GalleryIndex, MATCHER, new_entry, open_gallery, serial
platformdirs.user_cache_path = lambda name: Path(sys.argv[2], name)
with open_gallery(sys.argv[1]) as gallery:
    index = GalleryIndex(MATCHER, engine=serial())
    for number in range(int(sys.argv[3]), 10**6):
        print("now", flush=True)
        gallery.add([new_entry(number, number // 3)])
        index.follow(gallery)
        if number % 5 == 0:
            gallery.remove([max(index.numbers.tolist()) - 2])
            index.follow(gallery)
"""


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="no signals of POSIX")
def test_killed_at_30_random_moments_the_index_is_that_of_the_gallery(tmp_path):
    """What is on the disk while a process is stopped is what one leaves that is killed."""
    rng = np.random.default_rng(22)
    folder = tmp_path / "working"
    folder.mkdir()
    with open_gallery(folder / "g.db", create=True) as gallery:
        gallery.add([new_entry(number, number // 3) for number in range(20)])
    words = [folder / "g.db", tmp_path / "cache", 20, *Path(__file__).parents[:2]]
    script = [sys.executable, "-c", WORK, *map(str, words)]
    copies = [tmp_path / f"copy {attempt}" for attempt in range(30)]
    with subprocess.Popen(script, stdout=subprocess.PIPE, text=True) as worker:
        for copy in copies:
            assert worker.stdout.readline() == "now\n"
            time.sleep(float(rng.uniform(0.0, 0.05)))
            worker.send_signal(signal.SIGSTOP)
            os.waitpid(worker.pid, os.WUNTRACED)
            shutil.copytree(folder, copy)
            worker.send_signal(signal.SIGCONT)
        worker.kill()
    states = set()
    for copy in copies:
        with open_gallery(copy / "g.db") as gallery:
            states.add(gallery.content_hash())
            assert (
                contents(index_of(gallery), gallery)
                == contents(index_of(gallery), gallery)
                == afresh(gallery)
            )
    assert len(states) > 5
