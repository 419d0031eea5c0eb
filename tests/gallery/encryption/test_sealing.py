"""Sealed records: round trips, and every change of every byte."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import EncryptionError, ImageReadError
from fpmatch.gallery.encryption.keys import Key, KeyRing
from fpmatch.gallery.encryption.records import (
    HEAD_BYTES,
    OVERHEAD,
    is_sealed,
    key_id_of,
    seal,
    unseal,
)
from fpmatch.prints.reading import decode_print

KEY, OTHER = Key(bytes(range(32))), Key(bytes(32))
RING = KeyRing([KEY, OTHER])
ABOUT = {"purpose": b"entry", "salt": b"gallery", "bound": [b"ada", b"index", b"1"]}


@given(st.binary(max_size=300), st.binary(max_size=20), st.lists(st.binary(max_size=20)))
def test_a_record_returns_what_was_sealed(data, salt, bound):
    about = {"purpose": b"x", "salt": salt, "bound": bound}
    record = seal(KEY, data, **about)
    assert unseal(RING, record, **about) == data
    assert len(record) == len(data) + OVERHEAD
    assert seal(KEY, data, **about) != record
    assert is_sealed(record)
    assert key_id_of(record) == KEY.id
    assert len(data) < 8 or data not in record[HEAD_BYTES:]


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
        *(
            {"bound": bound}
            for bound in (
                [b"bob", b"index", b"1"],
                [b"adai", b"ndex", b"1"],
                [b"ada", b"index"],
                [b"ada", b"index", b"1", b""],
            )
        ),
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


def test_the_core_says_that_it_does_not_open_a_sealed_record():
    with pytest.raises(ImageReadError, match="a sealed template: only galleries"):
        decode_print(seal(Key(bytes(32)), b"{}", purpose=b"template"), "it")
