"""Absurd files are refused before they cost anything; what programs write in earnest is not."""

import struct

import numpy as np
import pytest

from fpmatch.errors import ImageReadError
from fpmatch.image.io.grey import DEFAULT_LIMITS
from fpmatch.image.io.pillow_formats import MAX_JPEG_SCANS, MAX_PNM_TEXT
from fpmatch.image.io.registry import find_reader
from fpmatch.image.io.wsq import decode_wsq
from tests.image.made_files import rings, saved, wsq

GREY = rings()


def test_a_jpeg_of_too_many_scans():
    whole = saved(GREY, "JPEG", progressive=True)
    reader = find_reader(whole)
    assert reader.decode(whole, DEFAULT_LIMITS).pixels.shape == GREY.shape
    scan = whole.rindex(b"\xff\xda")
    many = whole[:-2] + whole[scan:-2] * MAX_JPEG_SCANS + whole[-2:]
    with pytest.raises(ImageReadError, match="more than 100 scans"):
        reader.decode(many, DEFAULT_LIMITS)


@pytest.mark.parametrize(("order", "big"), [("<", False), (">", False), ("<", True), (">", True)])
def test_a_tiff_of_too_many_strips_or_tags(order, big):
    start = (b"II" if order == "<" else b"MM") + struct.pack(order + "H", 43 if big else 42)
    start += struct.pack(order + "HHQ", 8, 0, 16) if big else struct.pack(order + "L", 8)
    count, entry = ("Q", "HHQQ") if big else ("H", "HHLL")
    strips = start + struct.pack(order + count, 1) + struct.pack(order + entry, 273, 4, 300_001, 8)
    with pytest.raises(ImageReadError, match=r"300001 .*273"):
        find_reader(strips).decode(strips, DEFAULT_LIMITS)
    tags = start + struct.pack(order + count, 1001)
    with pytest.raises(ImageReadError, match="1001 tags"):
        find_reader(tags).decode(tags, DEFAULT_LIMITS)


def test_a_pnm_of_nothing_but_comments_or_digits():
    pixels = b"60 72 255\n" + GREY.tobytes()
    assert find_reader(b"P5\n#one\n# two\r\n" + pixels).name == "PPM"
    talk = b"P5\n" + b"#" * 200_000 + b"\n" + pixels
    with pytest.raises(ImageReadError, match="header"):
        find_reader(talk).decode(talk, DEFAULT_LIMITS)
    digits = b"P2 60 72 255 " + bytes(MAX_PNM_TEXT)
    with pytest.raises(ImageReadError, match="80 MB"):
        find_reader(digits).decode(digits, DEFAULT_LIMITS)
    few = b"P2 60 72 255 " + b" ".join(b"%d" % value for value in GREY.ravel())
    assert np.array_equal(find_reader(few).decode(few, DEFAULT_LIMITS).pixels, GREY)


def test_a_wsq_of_nothing_but_segments_tables_or_empty_runs():
    start = wsq()[: wsq().index(b"\xff\xa6")]
    comments = b"\xff\xa8\x00\x02" * 1001
    tables = (bytes([0, 1]) + bytes(15) + b"\xb4") * 9
    table = bytes([0, 1]) + bytes(15) + b"\x69"  # one code of one bit: a run of what follows
    runs = b"\xff\xa6\x00\x14" + table + b"\xff\xa3\x00\x03\x00" + bytes(100) + b"\xff\xa1"
    for rest, reason in (
        (comments, "more than 1000 segments"),
        (b"\xff\xa6" + (2 + len(tables)).to_bytes(2, "big") + tables, "too many Huffman tables"),
        (runs, "a run of no coefficients"),
    ):
        with pytest.raises(ImageReadError, match=reason):
            decode_wsq(start + rest, DEFAULT_LIMITS)
