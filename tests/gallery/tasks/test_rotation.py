"""Rotation of keys: all templates are sealed anew in one transaction; nothing stays readable."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from made_prints import changed, entries_of, entry_of, readable, refused, scattered

from fpmatch.gallery import gallery as rotation
from fpmatch.gallery.encryption.keys import add_key, load_keys, make_keys
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import open_gallery, rotate
from fpmatch.gallery.search.search import Search
from fpmatch.gallery.store.stored_template import pack_template

PRINTS = [scattered(seed, 30) for seed in range(20)]
PACKED = [(k, pack_template(template)) for k, template in enumerate(PRINTS, 1)]


@pytest.fixture(autouse=True)
def few_rows(source, monkeypatch):
    monkeypatch.setattr(rotation, "_ROWS_PER_READ", 3)


def make(where, *, encrypt):
    with open_gallery(where, create=True, encrypt=encrypt) as gallery:
        gallery.add(entries_of(*PRINTS))
    return where


def packed(where):
    with open_gallery(where) as gallery:
        return list(gallery.packed_templates())


def keys_in_use(where):
    with open_gallery(where) as gallery:
        return tuple(gallery.summarize()["keys"])


def test_a_plain_gallery_is_encrypted_while_another_is_open(where, source):
    make(where, encrypt=False)
    with open_gallery(where) as gallery, open_gallery(where) as other:
        assert len(list(other.templates())) == len(PRINTS)
        assert rotate(gallery)["sealed"] == len(PRINTS)
        assert rotate(gallery)["sealed"] == 0
        assert list(other.packed_templates()) == PACKED
        assert other.add([entry_of(99)]) == [None]
        add_key(source)
        assert rotate(gallery)["sealed"] == len(PRINTS) + 1
        assert list(other.packed_templates())[:-1] == PACKED
        assert gallery.summarize()["keys"] == [load_keys(source).current.id]


def test_nothing_of_the_plain_templates_or_of_the_former_key_is_left(tmp_path, source, monkeypatch):
    monkeypatch.setattr("fpmatch.gallery.search.search.EXHAUSTIVE_UP_TO", 2)
    path = make(tmp_path / "g.db", encrypt=False)
    with open_gallery(path) as gallery:
        before = Search(gallery, engine=serial())._index.segments[0].embedding.tobytes()
        assert readable(tmp_path, PRINTS[0])
        rotate(gallery)
        assert not any(readable(tmp_path, template) for template in PRINTS)
        assert not list(tmp_path.glob("g.db.prepared/*"))
        after = Search(gallery, engine=serial(), note=pytest.fail)
        assert after._index.segments[0].embedding.tobytes() == before
        assert len(list(tmp_path.glob("g.db.prepared/*"))) == 1
        first = load_keys(source).current.id
        add_key(source)
        with monkeypatch.context() as patch:  # stopped after its transaction
            patch.setattr(gallery, "vacuum", lambda: 1 / 0)
            with pytest.raises(ZeroDivisionError):
                rotate(gallery)
        assert packed(path) == PACKED
        assert rotate(gallery)["sealed"] == 0
    keys = Path(source.removeprefix("file:"))
    keys.write_text("\n".join(x for x in keys.read_text().splitlines() if x[:16] != first))
    with open_gallery(path) as gallery:
        assert len(Search(gallery, engine=serial(), note=pytest.fail)) == len(PRINTS)


ROTATE = """
import sys, time
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery import gallery as rotation
rotation._ROWS_PER_READ = 1
def show(stage, done, total):
    print(stage, done, total, flush=True)
    time.sleep(60 * (done == 5))  # until it is killed
with open_gallery(sys.argv[1]) as gallery:
    rotation.rotate(gallery, progress=show)
"""


@pytest.mark.slow
def test_a_killed_process_has_changed_nothing(tmp_path, source):
    path = make(tmp_path / "g.db", encrypt=True)
    before = keys_in_use(path)
    add_key(source)
    command = [sys.executable, "-c", ROTATE, str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        lines = [process.stdout.readline() for _ in range(6)]
        os.kill(process.pid, signal.SIGKILL)
    assert lines[5] == f"rotate 5 {len(PRINTS)}\n"
    assert (packed(path), keys_in_use(path)) == (PACKED, before)


@pytest.mark.parametrize("encrypt", [True, False])
def test_a_damaged_entry_is_left_and_named_and_not_readable(tmp_path, source, run, encrypt):
    path = make(tmp_path / "g.db", encrypt=encrypt)
    changed(path, "UPDATE fpmatch_entry SET subject = 'x' WHERE id = 4")
    key = add_key(source).current.id
    result = run("gallery", "rewrite", path, "--encrypt", "--json")
    assert (result.exit_code, "entry 4, left as it is" in result.stderr) == (1, True)
    document = json.loads(result.stdout)
    assert (document["key"], document["sealed"]) == (key, len(PRINTS) - encrypt)
    assert [one["id"] for one in document["damaged"]] == [4]
    assert not readable(tmp_path, PRINTS[3])
    with open_gallery(path) as gallery:
        assert len(list(gallery.templates())) == len(PRINTS) - 1
        assert list(gallery.damaged) == [4]


def test_without_all_keys_nothing_is_changed(tmp_path, source, monkeypatch):
    path = make(tmp_path / "g.db", encrypt=True)
    before = path.read_bytes()
    make_keys(f"file:{tmp_path / 'other'}")
    monkeypatch.delenv("FPMATCH_KEY")
    for key in (f"file:{tmp_path / 'other'}", None):
        with open_gallery(path, key=key) as gallery:
            refused(rotate, gallery, code="missing key")
    assert path.read_bytes() == before
