"""Sealed records and files: round trips, and every change of every byte."""

import io

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.base.encryption.keys import Key, KeyRing, new_key
from fpmatch.base.encryption.records import HEAD_BYTES, OVERHEAD, is_sealed, key_id_of, seal, unseal
from fpmatch.errors import EncryptionError
from fpmatch.gallery.store import blocks
from fpmatch.gallery.store.blocks import BLOCK_BYTES, sealed_blocks, unseal_blocks

KEY, OTHER = Key(bytes(range(32))), Key(bytes(32))
RING = KeyRing([KEY, OTHER])
ABOUT = {"purpose": b"entry", "salt": b"gallery", "bound": [b"ada", b"index", b"1"]}


def in_blocks(data, key=KEY, **about):
    file = io.BytesIO()
    with sealed_blocks(file, key, **({"purpose": b"prints"} | about)) as stream:
        for k in range(0, len(data), 100_000):
            assert stream.write(data[k : k + 100_000]) == len(data[k : k + 100_000])
    return file.getvalue()


def content(file, ring=RING, **about):
    return bytes(unseal_blocks(ring, io.BytesIO(file), **({"purpose": b"prints"} | about)))


@given(st.binary(max_size=300), st.binary(max_size=20), st.lists(st.binary(max_size=20)))
def test_a_record_returns_what_was_sealed(data, salt, bound):
    about = {"purpose": b"x", "salt": salt, "bound": bound}
    record = seal(KEY, data, **about)
    assert unseal(RING, record, **about) == data
    assert len(record) == len(data) + OVERHEAD
    assert is_sealed(record)
    assert key_id_of(record) == KEY.id
    assert len(data) < 8 or data not in record[HEAD_BYTES:]


def test_two_records_of_the_same_bytes_differ():
    assert seal(KEY, b"print", **ABOUT) != seal(KEY, b"print", **ABOUT)


def test_every_flipped_bit_of_a_record_is_detected():
    record = seal(KEY, b"a template", **ABOUT)
    for k in range(8 * len(record)):
        changed = bytearray(record)
        changed[k // 8] ^= 1 << k % 8
        with pytest.raises(EncryptionError):
            unseal(RING, bytes(changed), **ABOUT)


@pytest.mark.parametrize(
    "changed",
    [
        {"purpose": b"entries"},
        {"salt": b"galleries"},
        {"bound": [b"bob", b"index", b"1"]},
        {"bound": [b"adai", b"ndex", b"1"]},
        {"bound": [b"ada", b"index1", b""]},
        {"bound": [b"ada", b"index"]},
        {"bound": [b"ada", b"index", b"1", b""]},
    ],
)
def test_a_record_is_bound_to_its_place(changed):
    with pytest.raises(EncryptionError) as caught:
        unseal(RING, seal(KEY, b"a template", **ABOUT), **ABOUT | changed)
    assert caught.value.code == "damaged"


@given(st.binary(max_size=80))
def test_other_bytes_are_no_record(data):
    for start in (b"", b"\x89FPS\r\n\x1a\x01", b"\x89FPS\r\n\x1a\x02"):
        with pytest.raises(EncryptionError):
            unseal(RING, start + data, **ABOUT)


def test_a_missing_key_is_named():
    record = seal(KEY, b"a template", **ABOUT)
    with pytest.raises(EncryptionError, match=KEY.id) as caught:
        unseal(KeyRing([OTHER]), record, **ABOUT)
    assert caught.value.code == "missing key"


SIZES = [0, 1, BLOCK_BYTES - 1, BLOCK_BYTES, BLOCK_BYTES + 1, 3 * BLOCK_BYTES, 200_001]


@pytest.mark.parametrize("size", SIZES)
def test_a_file_returns_what_was_sealed(size):
    data = bytes(k % 251 for k in range(size))
    assert content(in_blocks(data)) == data


def test_every_flipped_byte_of_a_file_of_several_blocks_is_detected(monkeypatch):
    monkeypatch.setattr(blocks, "BLOCK_BYTES", 64)
    file = in_blocks(bytes(range(200)))
    assert content(file) == bytes(range(200))
    for k in range(len(file)):
        changed = bytearray(file)
        changed[k] ^= 1 + k % 255
        with pytest.raises(EncryptionError):
            content(bytes(changed))


def test_every_length_but_the_whole_is_detected(monkeypatch):
    monkeypatch.setattr(blocks, "BLOCK_BYTES", 64)
    file = in_blocks(bytes(range(200)))
    for length in range(len(file)):
        with pytest.raises(EncryptionError):
            content(file[:length])
    for more in range(1, 200):
        with pytest.raises(EncryptionError):
            content(file + bytes(more))


def test_blocks_that_were_moved_doubled_or_taken_from_another_file_are_detected(monkeypatch):
    monkeypatch.setattr(blocks, "BLOCK_BYTES", 64)
    file, other = in_blocks(bytes(256)), in_blocks(bytes(256))
    head, block = blocks.HEAD_BYTES, 64 + 16
    parts = [file[k : k + block] for k in range(head, len(file), block)]
    alien = other[head : head + block]
    for order in ([1, 0, 2, 3], [0, 0, 2, 3], [0, 1, 2, 3, 3], [3], [0, 1, 2]):
        with pytest.raises(EncryptionError):
            content(file[:head] + b"".join(parts[k] for k in order))
    with pytest.raises(EncryptionError):
        content(file[:head] + alien + b"".join(parts[1:]))


def test_a_file_is_bound_to_its_purpose_and_place():
    file = in_blocks(b"prints", bound=[b"gallery", b"1"])
    assert content(file, bound=[b"gallery", b"1"]) == b"prints"
    for about in ({}, {"bound": [b"gallery1"]}, {"purpose": b"x", "bound": [b"gallery", b"1"]}):
        with pytest.raises(EncryptionError) as caught:
            content(file, **about)
        assert caught.value.code == "damaged"
    with pytest.raises(EncryptionError) as caught:
        content(file, KeyRing([new_key()]), bound=[b"gallery", b"1"])
    assert caught.value.code == "missing key"


@given(st.binary(max_size=80))
def test_other_bytes_are_no_file(data):
    for start in (b"", blocks.MAGIC, blocks.MAGIC + bytes.fromhex(KEY.id)):
        with pytest.raises(EncryptionError):
            content(start + data)
