"""Keys and their sources: what they accept, refuse, and never show."""

import base64
import os
import pickle
import stat
import traceback
from pathlib import Path

import pytest

from fpmatch.errors import EncryptionError
from fpmatch.gallery.encryption.keys import Key, KeyRing, add_key, load_keys, make_keys, parse_keys


@pytest.fixture
def source(tmp_path):
    return f"file:{tmp_path / 'keys.txt'}"


def test_a_key_file_is_made_private_whatever_the_umask(tmp_path, source):
    before = os.umask(0)
    try:
        made = make_keys(source)
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "keys.txt").stat().st_mode) == 0o600
    assert list(tmp_path.iterdir()) == [tmp_path / "keys.txt"]
    with pytest.raises(EncryptionError) as caught:  # nothing is overwritten
        make_keys(source)
    assert caught.value.code == "exists"
    assert load_keys(source).ids == made.ids


def test_an_added_key_is_the_current_one_and_is_there_at_once(source):
    ring = make_keys(source)
    first, second = ring.current.id, add_key(source).current.id
    assert load_keys(source).ids == (second, first)
    assert ring.find(second).id == second  # of keys that were read before


def test_the_environment_names_the_source_and_a_line_may_lack_the_id(source, monkeypatch):
    ring, path = make_keys(source), Path(source.removeprefix("file:"))
    path.write_text(ring.current.as_line().split()[1])
    monkeypatch.setenv("FPMATCH_KEY", source)
    assert load_keys().ids == ring.ids


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("abc", 1),
        ("# a comment\n\nnot base64!", 3),
        (base64.b64encode(b"k" * 31).decode(), 1),
        (base64.b64encode(b"k" * 33).decode(), 1),
        ("0000000000000000 " + base64.b64encode(b"k" * 32).decode(), 1),
        ("x y " + base64.b64encode(b"k" * 32).decode(), 1),
        ("é", 1),
    ],
)
def test_a_malformed_text_is_refused_with_its_line_and_nothing_of_it(text, line):
    with pytest.raises(EncryptionError) as caught:
        parse_keys(text, "file:k")
    assert str(caught.value).startswith(f"file:k: line {line}: ")
    assert text.split()[-1] not in str(caught.value)


def test_the_secret_is_in_no_repr_error_traceback_or_pickle(source):
    ring = make_keys(source)
    key = ring.current
    secret = key.as_line().split()[1]
    shown = [repr(key), str(key), repr(ring), repr([ring])]
    try:
        ring.find("0" * 16)
    except EncryptionError as error:
        shown += [str(error), *traceback.format_exception(error)]
    assert not any(secret in text or repr(base64.b64decode(secret)) in text for text in shown)
    with pytest.raises(TypeError):
        pickle.dumps(key)
    with pytest.raises(TypeError):
        pickle.dumps(KeyRing([key]))
    packed = pickle.dumps(ring)
    assert base64.b64decode(secret) not in packed
    assert secret.encode() not in packed
    assert pickle.loads(packed).ids == ring.ids


def test_without_the_library_one_line_names_the_extra(monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "cryptography.hazmat.primitives.hashes", None)
    with pytest.raises(EncryptionError, match=r"fpmatch\[encryption\]"):
        Key(bytes(32)).cipher(b"x", b"")


BAD_SOURCES = ("", "keys.txt", "file:", "http://x", ":", "FILE:keys.txt", "env:HOME")
BAD_FILES = {
    **{"binary": (b"\xff\xfe\0", 0o600), "empty": (b"", 0o600), "comment": (b"# none\n", 0o600)},
    **{oct(mode): (Key(bytes(32)).as_line().encode(), mode) for mode in (0o640, 0o604, 0o620)},
    **{"none": None, "folder": None, "a\0b": None, "pipe": None},
}


@pytest.mark.parametrize("bad", [*BAD_SOURCES, *map("file:{}".format, BAD_FILES)])
def test_what_is_no_source_of_keys_is_refused_on_one_line(tmp_path, monkeypatch, bad):
    monkeypatch.delenv("FPMATCH_KEY", raising=False)
    monkeypatch.chdir(tmp_path)
    Path("folder").mkdir()
    os.mkfifo("pipe", 0o600)
    given = BAD_FILES.get(bad.removeprefix("file:"))
    if given is not None:
        content, mode = given
        path = Path(bad.removeprefix("file:"))
        path.write_bytes(content)
        path.chmod(mode)
    with pytest.raises(EncryptionError) as caught:
        load_keys(bad)
    assert "\n" not in str(caught.value)
    assert (caught.value.code == "not private") == ("0o6" in bad)
