import errno
import os
import shutil
import stat
from contextlib import contextmanager, suppress
from functools import partial

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
    (tmp_path / "file").touch()
    (tmp_path / "folder").mkdir()
    for write in (check_writable, partial(atomic_write_bytes, content=b"1")):
        with pytest.raises(OutputError, match=rf"{target}: cannot be written: [\w ]+$"):
            write(tmp_path / target)
    with pytest.raises(OutputError, match=r"cannot be written: file name too long$"):
        atomic_write_bytes(tmp_path / ("x" * 5000), b"")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "folder"]


def test_what_can_be_written_is_not_there_yet(tmp_path):
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


def interrupt(stream, _):
    stream.write(b"half")
    raise KeyboardInterrupt


def fill_the_disk(*_):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), ".hidden.part")


def lose_the_folder(stream, folder):
    stream.write(b"half")
    shutil.rmtree(folder)


@pytest.mark.parametrize(
    ("fail", "error", "text"),
    [
        (interrupt, KeyboardInterrupt, ""),
        (fill_the_disk, OutputError, "cannot be written: no space left on device"),
        (lose_the_folder, OutputError, "cannot be written: no such file or directory"),
    ],
)
def test_a_file_that_is_not_finished_is_not_there_nor_are_its_folders(tmp_path, fail, error, text):
    path, old = tmp_path / "new" / "folder" / "a.png", tmp_path / "old.png"
    old.write_bytes(b"old")

    def write(place):
        with atomic_write(place) as stream:
            fail(stream, path.parent)

    with pytest.raises(error) as caught:
        write(path)
    assert str(caught.value) == (f"{path}: {text}" if text else "")
    if fail is not lose_the_folder:
        with pytest.raises(error):
            write(old)
        assert [*tmp_path.iterdir()] == [old]
    assert old.read_bytes() == b"old"
    atomic_write_bytes(path, b"1")
    assert path.read_bytes() == b"1"


def test_a_full_disk_is_found_before_the_work(tiny_disk):
    fill = tiny_disk / "fill"
    with suppress(OSError), fill.open("wb", buffering=0) as stream:
        while stream.write(bytes(4096)):
            pass
    with pytest.raises(OutputError) as caught:
        check_writable(tiny_disk / "a.png")
    assert str(caught.value) == f"{tiny_disk / 'a.png'}: cannot be written: no space left on device"
    assert [path.name for path in tiny_disk.iterdir()] == ["fill"]
