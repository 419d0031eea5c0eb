import os
import stat
from contextlib import contextmanager

import pytest

from fpmatch.base.folders import create_private, make_folder, make_private, remove_unfinished
from fpmatch.base.output import atomic_write, atomic_write_bytes, check_writable
from fpmatch.errors import OutputError

posix = pytest.mark.skipif(os.name == "nt", reason="rights are those of the folder on Windows")


@contextmanager
def umask(mask):
    before = os.umask(mask)
    try:
        yield
    finally:
        os.umask(before)


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


def test_a_public_file_is_replaced_with_the_usual_permissions_and_nothing_left_beside_it(tmp_path):
    path = tmp_path / "a.png"
    path.write_bytes(b"old")
    usual = path.stat().st_mode
    atomic_write_bytes(path, b"new", public=True)
    assert path.read_bytes() == b"new"
    assert path.stat().st_mode == usual
    assert list(tmp_path.iterdir()) == [path]


@posix
@pytest.mark.parametrize("mask", [0, 0o022, 0o077, 0o777])
def test_files_and_folders_are_private_whatever_the_umask(tmp_path, mask):
    with umask(mask):
        make_folder(tmp_path / "a" / "b")
        path = tmp_path / "a" / "b" / "scores.csv"
        with atomic_write(path) as stream:
            (unfinished,) = path.parent.iterdir()
            assert mode(unfinished) == 0o600
            stream.write(b"1")
        create_private(path.with_name("gallery.db"))
        create_private(path.with_name("gallery.db"))
    assert [mode(p) for p in sorted(path.parent.iterdir())] == [0o600] * 2
    assert mode(tmp_path / "a") == mode(tmp_path / "a" / "b") == 0o700
    path.chmod(0o666)
    atomic_write_bytes(path, b"2")
    assert mode(path) == 0o600


@posix
@pytest.mark.parametrize(
    ("before", "after", "private"),
    [
        *[(0o644, 0o600, True), (0o600, 0o600, True), (0o666, 0o660, False)],
        *[(0o660, 0o660, False), (0o755, 0o700, True), (0o2770, 0o2770, False)],
    ],
)
def test_rights_are_narrowed_but_those_of_a_group_that_may_write(tmp_path, before, after, private):
    (tmp_path / "a").mkdir()
    (tmp_path / "a").chmod(before)
    assert make_private(tmp_path / "a") is private
    assert mode(tmp_path / "a") == after
    assert make_private(tmp_path / "missing") is False


@pytest.mark.parametrize("target", ["missing/a.png", "file/a.png", "folder"])
def test_what_cannot_be_written_is_named(tmp_path, target):
    (tmp_path / "file").write_bytes(b"")
    (tmp_path / "folder").mkdir()
    with pytest.raises(OutputError, match=f"{target}: cannot be written: ") as caught:
        atomic_write_bytes(tmp_path / target, b"content")
    assert "\n" not in str(caught.value)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "folder"]


def test_an_interrupted_file_is_not_there(tmp_path):
    path = tmp_path / "scores.csv"
    path.write_bytes(b"old")

    def write_half():
        with atomic_write(path) as stream:
            stream.write(b"half of the new")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_half()
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_places_that_cannot_be_written(tmp_path):
    with pytest.raises(OutputError, match="is a folder"):
        check_writable(tmp_path)
    with pytest.raises(OutputError, match="cannot be written"):
        check_writable(tmp_path / "nowhere" / "scores.csv")
    with pytest.raises(OutputError, match="name too long"):
        atomic_write_bytes(tmp_path / ("x" * 5000), b"")
    check_writable(tmp_path / "scores.csv")
    assert list(tmp_path.iterdir()) == []


def test_what_a_killed_process_left_is_removed_and_nothing_else(tmp_path):
    for name in (".0123456789abcdef.part", "a.part", ".part", ".0123.part"):
        (tmp_path / name).touch()
    remove_unfinished(tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == [".0123.part", ".part", "a.part"]


def test_unfinished_files_are_known_by_their_names(tmp_path):
    with atomic_write(tmp_path / "a.png"):
        (left,) = tmp_path.iterdir()
        left.with_name("kept").hardlink_to(left)
    (tmp_path / "kept").rename(left)
    remove_unfinished(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]
