"""Files sealed in blocks: round trips, and every change of every byte."""

import io

import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_prints import flipped

from fpmatch.errors import EncryptionError
from fpmatch.gallery.encryption.keys import Key, KeyRing, new_key
from fpmatch.gallery.store import blocks
from fpmatch.gallery.store.blocks import BLOCK_BYTES, sealed_blocks, unseal_blocks

KEY, OTHER = Key(bytes(range(32))), Key(bytes(32))
RING = KeyRing([KEY, OTHER])


def in_blocks(data, key=KEY, **about):
    file = io.BytesIO()
    with sealed_blocks(file, key, **({"purpose": b"prints"} | about)) as stream:
        for k in range(0, len(data), 100_000):
            assert stream.write(data[k : k + 100_000]) == len(data[k : k + 100_000])
    return file.getvalue()


def content(file, ring=RING, **about):
    return bytes(unseal_blocks(ring, io.BytesIO(file), **({"purpose": b"prints"} | about)))


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
        with pytest.raises(EncryptionError):
            content(flipped(file, k, 1 + k % 255))


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
