"""Small files, and files of many small parts, whose readers would need much memory or time."""

import struct
import zlib
from io import BytesIO

import numpy as np
from PIL import Image

from tests.image.made_files import (
    an2,
    saved,
    tagged_print,
    with_fields,
    wsq,
)

PIXELS = "more than 16 megapixels"
PARTS = "more than 200000 parts"
SIDE = 7990  # less than 64 megapixels
END, FRAME, BLOCK, HUFFMAN = 0xFFA1, 0xFFA2, 0xFFA3, 0xFFA6  # markers of WSQ


def white(file_format, mode="L", **options):
    """Return a white image of the largest area as a file, a pattern of bytes that compresses."""
    stream = BytesIO()
    Image.new(mode, (SIDE, SIDE), "white").save(stream, format=file_format, **options)
    return stream.getvalue()


def run_length_bmp():
    """Return a BMP whose rows are runs of one value."""
    body = (b"\xff\xff" * (SIDE // 255) + bytes([SIDE % 255, 255]) + b"\0\0") * SIDE + b"\0\1"
    start = 54 + 1024
    head = struct.pack("<LllHHLLllLL", 40, SIDE, SIDE, 1, 8, 1, len(body), 0, 0, 0, 0)
    palette = b"".join(bytes([k, k, k, 0]) for k in range(256))
    return b"BM" + struct.pack("<LHHL", start + len(body), 0, 0, start) + head + palette + body


def wsq_of(side, symbol, coded):
    """Return a WSQ of a square image, whose one symbol has a code of one bit, 0."""
    data, at, kept = wsq(), 2, b"\xff\xa0"
    while (marker := int.from_bytes(data[at : at + 2], "big")) != BLOCK:
        segment = data[at : at + 2 + int.from_bytes(data[at + 2 : at + 4], "big")]
        at += len(segment)
        if marker == FRAME:
            segment = segment[:6] + struct.pack(">HH", side, side) + segment[10:]
        kept += segment if marker != HUFFMAN else b""
    table = bytes([0, 1, *[0] * 15, symbol])
    kept += struct.pack(">HH", HUFFMAN, 2 + len(table)) + table
    return kept + struct.pack(">HHB", BLOCK, 3, 0) + coded + struct.pack(">H", END)


def bytes_in_png(chunk, count):
    """Return a PNG with many equal chunks without content before its pixels."""
    data, empty = saved(np.full((64, 64), 200, np.uint8), "PNG"), struct.pack(">L", 0) + chunk
    at = data.index(b"IDAT") - 4
    return data[:at] + (empty + struct.pack(">L", zlib.crc32(chunk))) * count + data[at:]


def many_parts(file_format, part, at, count=4_000_000):
    """Return a small image as a file with a part again and again from byte `at` on."""
    data = saved(np.full((64, 64), 200, np.uint8), file_format)
    at += 3 * 2 ** (data[10] % 8 + 1) if file_format == "GIF" else 0  # its palette
    return data[:at] + part * count + data[at:]


def record_of_many_fields():
    """Return an ANSI/NIST file of 300 records of 9,000 fields and no image."""
    record = with_fields(14, [(3 + n % 4, b"a") for n in range(9000)])
    return an2(*[(14, record)] * 300)


PRINT = np.broadcast_to(np.uint8(200), (64, 64))
IMAGES = {
    "PNG": (lambda: white("PNG"), PIXELS),
    "PNG, colour": (lambda: white("PNG", "RGB", dpi=(1000, 1000)), "more than 32 megapixels"),
    "PNG, chunks": (lambda: bytes_in_png(b"teXt", 2_000_000), PARTS),
    "PNG, pieces": (lambda: bytes_in_png(b"IDAT", 2_000_000), PARTS),
    "TIFF, Deflate": (lambda: white("TIFF", compression="tiff_adobe_deflate"), PIXELS),
    "TIFF, fax": (lambda: white("TIFF", "1", compression="group4"), PIXELS),
    "TIFF, strips": (
        lambda: white("TIFF", compression="tiff_adobe_deflate", tiffinfo={278: 1}),
        PIXELS,
    ),
    "JPEG": (lambda: white("JPEG", dpi=(500, 500)), f"{PIXELS} at 500 dpi"),
    "JPEG, segments": (lambda: many_parts("JPEG", b"\xff\xe5\0\2", 2), PARTS),
    "BMP": (run_length_bmp, PIXELS),
    "GIF": (lambda: white("GIF"), PIXELS),
    "GIF, comments": (lambda: many_parts("GIF", b"!\xfe\1a\0", 13), PARTS),
    "WebP": (lambda: white("WEBP", "RGB", lossless=True), PIXELS),
    "JPEG 2000": (lambda: white("JPEG2000"), PIXELS),
    "JPEG 2000, boxes": (lambda: many_parts("JPEG2000", b"\0\0\0\x08free", 12), PARTS),
    "PGM": (lambda: b"P5 7990 7990 255\n" + bytes(SIDE**2), PIXELS),
    "WSQ": (lambda: wsq_of(4100, 181, b""), "more than 16 megapixels"),
    "WSQ, symbols": (lambda: wsq_of(4000, 181, bytes(2_000_000)), "more than 4000000 symbols"),
    "AN2": (
        lambda: an2(tagged_print(PRINT, white("PNG"), compression=b"PNG")),
        f"{PIXELS} at 500 dpi",
    ),
    "AN2, fields": (record_of_many_fields, "no print in it"),
    "FIR": (
        lambda: b"FIR\x00020\x00" + white("PNG"),
        "known format (a finger image record",
    ),
}
"""Of each kind of file what makes one, and what the refusal contains."""
