"""Files of arrays: what was written comes back, or the file is refused, whatever was done to it."""

import errno
import gzip
import io
import json
import os
import pickle
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_prints import flipped

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
def small(tmp_path, monkeypatch):
    """Return a file of several blocks, of 64 bytes each."""
    monkeypatch.setattr(array_file, "BLOCK", 64)
    write_arrays(tmp_path / "arrays", arrays_of(5, 70), COLUMNS, ABOUT)
    return tmp_path / "arrays"


@pytest.mark.parametrize("block", [64, 128, array_file.BLOCK])
@pytest.mark.parametrize("sizes", [(0, 0), (1, 0), (0, 1), (8, 64), (9, 200)])
def test_arrays_come_back_as_they_were(tmp_path, monkeypatch, sizes, block):
    monkeypatch.setattr(array_file, "BLOCK", block)
    given_ = arrays_of(*sizes)
    write_arrays(tmp_path / "arrays", given_, COLUMNS, ABOUT)
    found = read_arrays(tmp_path / "arrays", COLUMNS, ABOUT)
    assert list(found) == list(COLUMNS)
    for name, array in found.items():
        assert (array.dtype, array.tolist()) == (given_[name].dtype, given_[name].tolist())
        assert array.flags.aligned
        assert not array.flags.writeable
    assert [path.name for path in tmp_path.iterdir()] == ["arrays"]


def test_what_is_written_may_be_sealed(tmp_path):
    """A compressed stream stands for an encrypted one."""
    path = tmp_path / "arrays"
    write_arrays(path, arrays_of(5, 70), COLUMNS, ABOUT, seal=partial(gzip.open, mode="wb"))
    assert path.read_bytes()[:2] == b"\x1f\x8b"
    found = read_arrays(path, COLUMNS, ABOUT, unseal=lambda s: gzip.decompress(s.read()))
    assert {k: a.tolist() for k, a in found.items()} == {
        k: a.tolist() for k, a in arrays_of(5, 70).items()
    }
    assert refusal(path) == "damaged"
    write_arrays(path, arrays_of(5, 70), COLUMNS, ABOUT)
    with pytest.raises(FpmatchError) as caught:
        read_arrays(path, COLUMNS, ABOUT, unseal=lambda s: gzip.decompress(s.read()))
    assert caught.value.code == "unreadable"


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


def test_every_bit_of_a_file_counts(small):
    content = small.read_bytes()
    for place in range(len(content)):
        small.write_bytes(flipped(content, place, 1 << place % 8))
        assert refusal(small) in {"damaged", "other"}


def test_every_length_but_the_right_one_is_found(small):
    content = small.read_bytes()
    for length in range(len(content)):
        small.write_bytes(content[:length])
        assert refusal(small) == "damaged"
        small.write_bytes(content + content[length:])
        assert refusal(small) == "damaged"


def test_blocks_in_another_order_and_of_another_file_are_found(small):
    content, size = small.read_bytes(), len(array_file.read_content(small)[1])
    write_arrays(small, arrays_of(5, 70) | {"code": np.zeros(70)}, COLUMNS, ABOUT)
    other = small.read_bytes()
    sums = len(content) - (size // 64 + 1) * 4
    for to, of in np.ndindex(size // 64, size // 64):
        for source in (content, other):
            begin, end = sums - size + 64 * to, sums - size + 64 * of
            changed = bytearray(content)
            changed[begin : begin + 64] = source[end : end + 64]
            for with_checksum in (False, True):
                if with_checksum:
                    changed[sums + 4 * to : sums + 4 * to + 4] = source[sums + 4 * of :][:4]
                if changed != content:
                    small.write_bytes(changed)
                    assert refusal(small) == "damaged"


SHAPES = ([], [0], [4], [6], [5, 1], [-5], [-1], [5.0], ["5"], [True], [None], 5, "5", None)
HEADERS = [
    *(("arrays", value) for value in ([], None, 7, {}, [1, 2, 3])),
    *(("about", None), ("new", 7)),
    *(("name", value) for value in ("begin", ["start"], None)),
    *(("dtype", value) for value in ("<i4", ">i8", "|O", "nonsense", 8)),
    *(("shape", value) for value in (*SHAPES, [2**62], [2**64 + 5], [10**300], {"0": 5})),
]


@pytest.mark.parametrize(("part", "value"), HEADERS)
def test_a_header_that_states_something_else_is_refused(small, part, value):
    """The checksums are those of the changed header: it is its statements that are checked."""
    header, content = array_file.read_content(small)
    document = json.loads(header)
    if part in {"arrays", "about", "new"}:
        document[part] = value
    else:
        document["arrays"][0][("name", "dtype", "shape").index(part)] = value
    rewrite(small, json.dumps(document).encode(), content)
    assert refusal(small) == ("other" if part == "about" else "damaged")


@pytest.mark.parametrize(
    "header",
    [b"", b"{}", b"[]", b"7", b"\xff", b"{" * 20_000, b"[" * 20_000, b'{"about": 1}', b"1" * 5000],
)
def test_a_header_that_is_no_header_is_refused(small, header):
    _, content = array_file.read_content(small)
    rewrite(small, header, content)
    assert refusal(small) in {"damaged", "other"}


@pytest.mark.parametrize("extra", [1, 63, 64, 65, 4096])
def test_a_content_of_another_size_is_refused(small, extra):
    header, content = array_file.read_content(small)
    rewrite(small, header, np.append(content, np.zeros(extra, np.uint8)))
    assert refusal(small) == "damaged"
    rewrite(small, header, content[:-extra])
    assert refusal(small) == "damaged"


@pytest.mark.parametrize("change", ["missing", "extra", "order"])
def test_arrays_that_are_missing_too_many_or_in_another_order_are_refused(small, change):
    names = {"missing": ("start", "xy"), "order": ("xy", "start", "code")}.get(change)
    columns = {k: COLUMNS[k] for k in names or COLUMNS}
    if change == "extra":
        columns["more"] = Column("|u1", ("cells",))
    write_arrays(small, arrays_of(5, 70) | {"more": np.zeros(70)}, columns, ABOUT)
    assert refusal(small) == "damaged"


def test_dimensions_of_one_name_have_one_length(small):
    write_arrays(small, arrays_of(5, 70) | {"xy": np.zeros((6, 2))}, COLUMNS, ABOUT)
    assert refusal(small) == "damaged"


def test_a_file_about_something_else_is_another(small):
    assert refusal(small, about={"what": "another"}) == "other"
    assert refusal(small, about={}) == "other"
    small.write_bytes(b"fpmatch arrays 2" + small.read_bytes()[16:])
    assert refusal(small) == "other"


def npy():
    stream = io.BytesIO()
    np.save(stream, np.arange(9))
    return stream.getvalue()


@pytest.mark.parametrize(
    "content",
    [b"", b"something else", b"\x80\x04.", pickle.dumps({"a": np.arange(9)}), npy(), bytes(5000)],
)
def test_other_files_are_refused(small, content):
    small.write_bytes(content)
    assert refusal(small) == "damaged"


def test_what_is_no_file_is_refused(tmp_path):
    assert refusal(tmp_path / "nothing") == "missing"
    assert refusal(tmp_path) == "unreadable"
    (tmp_path / "file").touch()
    assert refusal(tmp_path / "file" / "arrays") == "missing"
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe")
        assert refusal(tmp_path / "pipe") == "unreadable"
    with pytest.raises(OutputError, match="cannot be written"):
        write_arrays(tmp_path / "/dev/null/arrays", arrays_of(1, 1), COLUMNS, ABOUT)


def test_a_disk_that_fails_is_an_error(small, monkeypatch):
    def fail(*_):
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr(array_file, "_checksum", fail)
    assert refusal(small) == "unreadable"


def test_writing_replaces_the_file_and_leaves_what_was_mapped(tmp_path):
    write_arrays(tmp_path / "arrays", arrays_of(5, 70), COLUMNS, ABOUT)
    mapped = read_arrays(tmp_path / "arrays", COLUMNS, ABOUT)
    write_arrays(tmp_path / "arrays", arrays_of(1, 0), COLUMNS, ABOUT)
    assert mapped["start"].tolist() == arrays_of(5, 70)["start"].tolist()
    assert len(read_arrays(tmp_path / "arrays", COLUMNS, ABOUT)["start"]) == 1


def rewrite(path, header, content):
    stored = bytes(content)
    with path.open("wb") as stream:
        array_file.write_content(stream, header, [memoryview(stored)])
