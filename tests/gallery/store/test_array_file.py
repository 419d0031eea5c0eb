"""Files of arrays: what was written comes back, or the file is refused, whatever was done to it."""

import errno
import gzip
import json
import os

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import FpmatchError, OutputError
from fpmatch.gallery.store import array_file
from fpmatch.gallery.store.array_file import Column, read_arrays, write_arrays

COLUMNS = {
    "start": Column("<i8", ("rows",)),
    "xy": Column("<f4", ("rows", 2)),
    "code": Column("|u1", ("cells",)),
}
ABOUT = {"what": "a test"}


def arrays_of(rows, cells):
    rng = np.random.default_rng(rows)
    return {
        "start": rng.integers(-9, 9, rows),
        "xy": rng.random((rows, 2)).astype(np.float32),
        "code": rng.integers(0, 256, cells).astype(np.uint8),
    }


def refusal(path, columns=COLUMNS, about=ABOUT):
    """Return the code of the error that reading a file raises."""
    with pytest.raises(FpmatchError) as caught:
        read_arrays(path, columns, about)
    assert caught.value.path == str(path)
    assert "\n" not in str(caught.value)
    return caught.value.code


@pytest.fixture
def small(tmp_path):
    """Return a file."""
    write_arrays(tmp_path / "arrays", arrays_of(5, 70), COLUMNS, ABOUT)
    return tmp_path / "arrays"


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("sizes", [(0, 0), (1, 0), (0, 1), (8, 64), (9, 200)])
def test_arrays_come_back_as_they_were(tmp_path, sizes, packed):
    """A compressed file stands for an encrypted one."""
    given_, path = arrays_of(*sizes), tmp_path / "arrays"
    write_arrays(path, given_, COLUMNS, ABOUT, seal=gzip.compress if packed else None)
    found = read_arrays(path, COLUMNS, ABOUT, unseal=gzip.decompress if packed else None)
    assert list(found) == list(COLUMNS)
    for name, array in found.items():
        assert (array.dtype, array.tolist()) == (given_[name].dtype, given_[name].tolist())
        assert not array.flags.writeable
    assert [path.name for path in tmp_path.iterdir()] == ["arrays"]
    if packed:
        assert refusal(path) == "damaged"


@given(sizes=st.tuples(st.integers(0, 40), st.integers(0, 300)), data=st.data())
def test_any_change_of_any_bytes_is_found(tmp_path_factory, sizes, data):
    path = tmp_path_factory.mktemp("arrays") / "arrays"
    write_arrays(path, arrays_of(*sizes), COLUMNS, ABOUT)
    content = path.read_bytes()
    begin = data.draw(st.integers(0, len(content) - 1))
    end = begin + data.draw(st.integers(0, 9))
    changed = content[:begin] + data.draw(st.binary(max_size=9)) + content[end:]
    path.write_bytes(changed)
    if changed != content:
        assert refusal(path) in {"damaged", "other"}


SHAPES = ([], [4], [6], [5, 1], [-1], [5.0], ["5"], [True], 5, None, [2**62], [2**64 + 5])
HEADERS = [
    *(("arrays", value) for value in ([], None, {}, [1, 2, 3])),
    *(("name", value) for value in ("begin", ["start"], None)),
    *(("dtype", value) for value in ("<i4", ">i8", "|O", 8)),
    *(("shape", value) for value in (*SHAPES, [10**300], {"0": 5})),
    *(("whole", value) for value in (b"", b"{}", b"7", b"\xff", b"[" * 20_000, b"1" * 5000)),
]


@pytest.mark.parametrize(("part", "value"), HEADERS)
def test_a_header_that_states_something_else_is_refused(small, part, value):
    """The checksums are those of the changed header: it is its statements that are checked."""
    whole = small.read_bytes()
    _, length, _ = array_file.HEAD.unpack(whole[:64])
    document = json.loads(whole[64 : 64 + length])
    if part == "arrays":
        document[part] = value
    elif part != "whole":
        document["arrays"][0][("name", "dtype", "shape").index(part)] = value
    header = value if part == "whole" else json.dumps(document).encode()
    small.write_bytes(array_file.encode(header, whole[64 + length + -length % 64 :]))
    assert refusal(small) == "damaged"


def test_a_file_about_something_else_is_another(small):
    assert refusal(small, about={"what": "another"}) == "other"
    assert refusal(small, about={}) == "other"
    small.write_bytes(b"fpmatch arrays 2" + small.read_bytes()[16:])
    assert refusal(small) == "other"


def test_what_is_no_file_or_cannot_be_read_is_refused(small, tmp_path, monkeypatch):
    assert refusal(tmp_path / "nothing") == refusal(small / "below") == "missing"
    assert refusal(tmp_path) == "unreadable"
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe")
        assert refusal(tmp_path / "pipe") == "unreadable"
    with pytest.raises(OutputError, match="cannot be written"):
        write_arrays(tmp_path / "/dev/null/arrays", arrays_of(1, 1), COLUMNS, ABOUT)

    def fail(*_):
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr(array_file, "crc32", fail)
    assert refusal(small) == "unreadable"
