"""Rotation of keys: nothing is lost, nothing stays readable, others go on meanwhile."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from made_prints import changed, entries_of, entry_of, readable, scattered

from fpmatch.errors import GalleryError
from fpmatch.gallery.encryption.key_text import add_key, make_keys, remove_key
from fpmatch.gallery.encryption.keys import load_keys
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import Gallery, open_gallery
from fpmatch.gallery.search.opening import open_search
from fpmatch.gallery.store.stored_template import pack_template
from fpmatch.gallery.tasks import rotation
from fpmatch.gallery.tasks.rotation import rotate

PRINTS = [scattered(seed, 30) for seed in range(20)]
PACKED = [(k, pack_template(template)) for k, template in enumerate(PRINTS, 1)]


@pytest.fixture(autouse=True)
def few_rows(source, monkeypatch):
    monkeypatch.setattr(rotation, "ROWS_PER_COMMIT", 3)


def make(where, *, encrypt):
    with open_gallery(where, create=True, encrypt=encrypt) as gallery:
        gallery.add(entries_of(*PRINTS))
    return where


def packed(where, **options):
    with open_gallery(where, **options) as gallery:
        return list(gallery.packed_templates())


def keys_in_use(where):
    with open_gallery(where) as gallery:
        return gallery.summary().keys


def test_all_templates_are_sealed_with_the_current_key(where, source):
    make(where, encrypt=True)
    (first,) = keys_in_use(where)
    second = add_key(source).current.id
    with open_gallery(where) as gallery:
        done = rotate(gallery)
    assert (done.key, done.sealed, done.damaged) == (second, len(PRINTS), {})
    remove_key(source, first)
    assert packed(where) == PACKED
    assert keys_in_use(where) == (second,)
    with open_gallery(where) as gallery:
        assert rotate(gallery).sealed == 0


def test_a_plain_gallery_is_encrypted_and_decrypted(where, source):
    make(where, encrypt=False)
    with open_gallery(where) as other, open_gallery(where) as gallery:
        assert len(list(other.templates())) == len(PRINTS)
        assert rotate(gallery).sealed == len(PRINTS)
        assert list(other.packed_templates()) == PACKED  # opened before
        assert other.add([entry_of(99)]) == [None]
        assert gallery.summary().keys == load_keys(source).ids
        done = rotate(gallery, decrypt=True)
        assert (done.key, done.sealed) == ("plain", len(PRINTS) + 1)
        assert list(other.packed_templates())[:-1] == PACKED
        assert gallery.summary().version == 3
        with pytest.raises(GalleryError, match="is not encrypted"):
            rotate(gallery, decrypt=True)


@pytest.fixture
def indexed(monkeypatch):
    """Have small galleries indexed."""
    monkeypatch.setattr("fpmatch.gallery.search.opening.EXHAUSTIVE_UP_TO", 2)


@pytest.mark.usefixtures("indexed")
def test_nothing_of_the_plain_templates_is_left(tmp_path):
    path = make(tmp_path / "g.db", encrypt=False)
    with open_gallery(path) as gallery:
        before = open_search(gallery, engine=serial()).index.segments[0].embedding.tobytes()
        assert readable(tmp_path, PRINTS[0])
        rotate(gallery)
        assert not any(readable(tmp_path, template) for template in PRINTS)
        assert not list(tmp_path.glob("g.db.prepared/*"))
        after = open_search(gallery, engine=serial(), note=pytest.fail)
    assert after.index.segments[0].embedding.tobytes() == before
    for file in tmp_path.glob("g.db.prepared/*"):
        assert before[:64] not in file.read_bytes()


@pytest.mark.usefixtures("indexed")
def test_the_index_follows_the_key(tmp_path, source):
    path = make(tmp_path / "g.db", encrypt=True)
    with open_gallery(path) as gallery:
        open_search(gallery, engine=serial())
        first = load_keys(source).current.id
        add_key(source)
        rotate(gallery)
    remove_key(source, first)
    notes = []
    with open_gallery(path) as gallery:
        assert len(open_search(gallery, engine=serial(), note=notes.append)) == len(PRINTS)
    assert notes == []


def test_a_plain_file_of_an_earlier_version_is_deleted(tmp_path, source):
    path = make(tmp_path / "g.db", encrypt=True)
    (tmp_path / "g.db.prepared").mkdir()
    planted = tmp_path / "g.db.prepared" / "unit-circle-0-planted.arrays"
    planted.write_bytes(b"fpmatch arrays 1")
    add_key(source)
    with open_gallery(path) as gallery:
        rotate(gallery)
    assert not planted.exists()


def test_entries_of_meanwhile_are_sealed_with_the_new_key(tmp_path, source):
    path = make(tmp_path / "g.db", encrypt=True)
    (first,) = keys_in_use(path)
    second = add_key(source).current.id

    def enrol_more(_stage, done, _total):
        with open_gallery(path) as other:
            other.add([entry_of(1000 + done)])
            assert [p for p in other.packed_templates() if p[0] <= len(PRINTS)] == PACKED
            if done < len(PRINTS):
                assert other.summary().keys == (second, first)

    with open_gallery(path) as gallery:
        rotate(gallery, progress=enrol_more)
    remove_key(source, first)
    assert packed(path)[: len(PRINTS)] == PACKED
    assert len(packed(path)) > len(PRINTS) + 5
    assert keys_in_use(path) == (second,)


class Killed(Exception):
    pass


@pytest.mark.parametrize(("encrypt", "decrypt"), [(False, False), (True, False), (True, True)])
def test_wherever_it_is_killed_it_goes_on(tmp_path, source, monkeypatch, encrypt, decrypt):
    path = make(tmp_path / "g.db", encrypt=encrypt)
    target = add_key(source).current.id
    for stop in ("delete_files", "_seal_some", "vacuum", "_end"):
        with monkeypatch.context() as patch:
            place = Gallery if stop == "vacuum" else rotation
            original, calls = getattr(place, stop), []

            def killed(*args, original=original, calls=calls):
                calls.append(args)
                if len(calls) == 2 or original.__name__ != "_seal_some":
                    raise Killed
                return original(*args)

            patch.setattr(place, stop, killed)
            with open_gallery(path) as gallery:
                if stop != "vacuum" or not encrypt:
                    with pytest.raises(Killed):
                        rotate(gallery, decrypt=decrypt)
        assert packed(path) == PACKED
    with open_gallery(path) as gallery:
        rotate(gallery, decrypt=decrypt)
    assert packed(path) == PACKED
    assert keys_in_use(path) == (() if decrypt else (target,))
    assert decrypt or not any(readable(tmp_path, template) for template in PRINTS)


@pytest.mark.slow
def test_a_killed_process_loses_nothing(tmp_path, source):
    path = make(tmp_path / "g.db", encrypt=True)
    second = add_key(source).current.id
    code = (
        "from fpmatch.gallery.tasks import rotation\n"
        "from fpmatch.gallery.gallery import Gallery, open_gallery\n"
        "rotation.ROWS_PER_COMMIT = 1\n"
        f"with open_gallery({str(path)!r}) as gallery:\n"
        "    rotation.rotate(gallery, progress=lambda *state: print(*state, flush=True))\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    lines = [process.stdout.readline() for _ in range(6)]
    os.kill(process.pid, signal.SIGKILL)
    process.wait(timeout=30)
    process.stdout.close()
    assert lines[5] == f"rotate 5 {len(PRINTS)}\n"
    assert packed(path) == PACKED
    assert len(keys_in_use(path)) == 2
    with open_gallery(path) as gallery:
        assert rotate(gallery).sealed <= len(PRINTS) - 5
    assert keys_in_use(path) == (second,)
    assert packed(path) == PACKED


@pytest.mark.slow
def test_two_processes_search_and_enrol_during_a_rotation(tmp_path, source):
    path = make(tmp_path / "g.db", encrypt=True)
    code = (
        "import sys\n"
        f"sys.path.insert(0, {str(Path(__file__).parents[1])!r})\n"
        "from made_prints import entry_of\n"
        "from fpmatch.gallery.gallery import Gallery, open_gallery\n"
        f"with open_gallery({str(path)!r}) as gallery:\n"
        "    print('ready', flush=True)\n"
        "    for k in range(8):\n"
        "        assert gallery.add([entry_of(int(sys.argv[1]) + k)]) == [None]\n"
        f"        assert len(list(gallery.templates())) > {len(PRINTS)}\n"
        "    assert not gallery.damaged\n"
    )
    others = [
        subprocess.Popen([sys.executable, "-c", code, start], stdout=subprocess.PIPE, text=True)
        for start in ("1000", "2000")
    ]
    for other in others:
        assert other.stdout.readline() == "ready\n"
    rounds = 0
    while any(other.poll() is None for other in others):
        add_key(source)
        with open_gallery(path) as gallery:
            rotate(gallery)
        rounds += 1
        time.sleep(0.05)
    for other in others:
        other.stdout.close()
    assert [other.returncode for other in others] == [0, 0]
    assert rounds > 1
    assert packed(path)[: len(PRINTS)] == PACKED
    assert len(packed(path)) == len(PRINTS) + 16
    assert keys_in_use(path) == (load_keys(source).current.id,)


def test_a_damaged_entry_is_left_and_named(tmp_path, source):
    path = make(tmp_path / "g.db", encrypt=True)
    changed(path, "UPDATE fpmatch_entry SET subject = 'x' WHERE id = 4")
    add_key(source)
    with open_gallery(path) as gallery:
        done = rotate(gallery)
        assert (list(done.damaged), done.sealed) == ([4], len(PRINTS) - 1)
        assert len(list(gallery.templates())) == len(PRINTS) - 1
        assert list(gallery.damaged) == [4]


def test_without_all_keys_nothing_is_changed(tmp_path, source, monkeypatch):
    path = make(tmp_path / "g.db", encrypt=True)
    before = path.read_bytes()
    other = f"file:{tmp_path / 'other'}"
    make_keys(other)
    with open_gallery(path, key=other) as gallery, pytest.raises(GalleryError) as caught:
        rotate(gallery)
    assert caught.value.code == "missing key"
    monkeypatch.delenv("FPMATCH_KEY")
    with open_gallery(path) as gallery, pytest.raises(GalleryError, match="FPMATCH_KEY"):
        rotate(gallery)
    assert path.read_bytes() == before
