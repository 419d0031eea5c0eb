import errno
import os
import shutil
import stat
from contextlib import contextmanager, suppress

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


@pytest.mark.parametrize("target", ["file/a.png", "file/b/a.png", "folder"])
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
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="is a folder"):
        check_writable(tmp_path)
    with pytest.raises(OutputError, match="cannot be written"):
        check_writable(tmp_path / "file" / "folder" / "scores.csv")
    (tmp_path / "file").unlink()
    with pytest.raises(OutputError, match="name too long"):
        atomic_write_bytes(tmp_path / ("x" * 5000), b"")
    with pytest.raises(OutputError, match=r"a picture is written as \.png or \.svg"):
        check_writable(tmp_path / "a.jpg", what="a picture", suffixes=(".png", ".svg"))
    check_writable(tmp_path / "scores.csv")
    check_writable(tmp_path / "new" / "folder" / "scores.csv")
    assert list(tmp_path.iterdir()) == []


def test_what_a_killed_process_left_is_removed_and_nothing_else(tmp_path):
    for name in (".0123456789abcdef.part", "a.part", ".part", ".0123.part"):
        (tmp_path / name).touch()
    remove_unfinished(tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == [".0123.part", ".part", "a.part"]


def test_folders_that_are_missing_are_made_and_removed_where_the_file_is_not_written(tmp_path):
    path = tmp_path / "new" / "folder" / "a.png"

    def write_on_a_full_disk():
        with atomic_write(path):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), ".hidden.part")

    with pytest.raises(OutputError) as caught:
        write_on_a_full_disk()
    assert str(caught.value) == f"{path}: cannot be written: no space left on device"
    assert list(tmp_path.iterdir()) == []
    atomic_write_bytes(path, b"1")
    assert path.read_bytes() == b"1"


def test_a_folder_that_vanishes_while_a_file_is_written_is_one_line(tmp_path):
    path = tmp_path / "folder" / "a.png"

    def write_and_lose_the_folder():
        with atomic_write(path) as stream:
            stream.write(b"half")
            shutil.rmtree(path.parent)

    with pytest.raises(OutputError) as caught:
        write_and_lose_the_folder()
    assert str(caught.value) == f"{path}: cannot be written: no such file or directory"
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_is_found_before_the_work(tiny_disk):
    fill = tiny_disk / "fill"
    with suppress(OSError), fill.open("wb", buffering=0) as stream:
        while stream.write(bytes(4096)):
            pass
    with pytest.raises(OutputError) as caught:
        check_writable(tiny_disk / "a.png")
    assert str(caught.value) == f"{tiny_disk / 'a.png'}: cannot be written: no space left on device"
    assert [path.name for path in tiny_disk.iterdir()] == ["fill"]
