"""No file makes a reader use more than 1 GB or 5 s; the limit of pixels is that of four palms."""

import json
import struct
import subprocess
import sys
import zlib
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from fpmatch import extract
from fpmatch.errors import ImageError
from fpmatch.image.io.grey import GreyImage, ImageLimits, RawSize, grey_image
from fpmatch.image.io.read import decode_image
from tests.image.made_files import an2, rings, saved, tagged_print, with_fields, wsq

MOST_MEGABYTES = 1000
MOST_SECONDS = 5
READ = """
import json, resource, sys
from pathlib import Path
from fpmatch import read_image
from fpmatch.errors import FpmatchError
try:
    read_image(sys.argv[1])
except FpmatchError as error:
    used = resource.getrusage(resource.RUSAGE_SELF)
    peak, status = used.ru_maxrss, Path("/proc/self/status")
    if status.exists():  # on Linux ru_maxrss has that of the process before, too
        peak = int(status.read_text().partition("VmHWM:")[2].split()[0])
    print(json.dumps([str(error), peak / 1000, used.ru_utime + used.ru_stime]))
"""


PIXELS = "more than 16 megapixels"
PARTS = "more than 200000 parts"
SIDE = 7990  # less than 64 megapixels
END, FRAME, BLOCK, HUFFMAN = 0xFFA1, 0xFFA2, 0xFFA3, 0xFFA6  # markers of WSQ


def white(file_format, mode="L", **options):
    """Return a white image of the largest area as a file, a pattern of bytes that compresses."""
    stream = BytesIO()
    Image.new(mode, (SIDE, SIDE), "white").save(stream, format=file_format, **options)
    return stream.getvalue()


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
CHUNK = struct.pack(">L4sL", 0, b"teXt", zlib.crc32(b"teXt"))
IMAGES = {
    "PNG": (lambda: white("PNG"), PIXELS),
    "PNG, colour": (lambda: white("PNG", "RGB", dpi=(1000, 1000)), "more than 32 megapixels"),
    "PNG, chunks": (lambda: many_parts("PNG", CHUNK, 33), PARTS),
    "PGM, comment": (lambda: b"P5\n#" + b"a" * 3_000_000, PARTS),
    "TIFF, Deflate": (lambda: white("TIFF", compression="tiff_adobe_deflate"), PIXELS),
    "JPEG": (lambda: white("JPEG", dpi=(500, 500)), f"{PIXELS} at 500 dpi"),
    "JPEG, segments": (lambda: many_parts("JPEG", b"\xff\xe5\0\2", 2), PARTS),
    "GIF": (lambda: white("GIF"), PIXELS),
    "GIF, comments": (lambda: many_parts("GIF", b"!\xfe\1a\0", 13), PARTS),
    "WebP": (lambda: white("WEBP", "RGB", lossless=True), PIXELS),
    "JPEG 2000, boxes": (lambda: many_parts("JPEG2000", b"\0\0\0\x08free", 12), PARTS),
    "WSQ": (lambda: wsq_of(4100, 181, b""), "more than 16 megapixels"),
    "WSQ, symbols": (lambda: wsq_of(4000, 181, bytes(2_000_000)), "more than 4000000 symbols"),
    "AN2": (
        lambda: an2(tagged_print(PRINT, white("PNG"), compression=b"PNG")),
        f"{PIXELS} at 500 dpi",
    ),
    "AN2, fields": (record_of_many_fields, "no print in it"),
}
"""Of each kind of file what makes one, and what the refusal contains."""


@pytest.mark.slow
@pytest.mark.parametrize("kind", IMAGES)
def test_hostile_files_are_refused_in_one_line_with_little_memory_and_time(tmp_path, kind):
    make, words = IMAGES[kind]
    path = tmp_path / "print"
    path.write_bytes(make())
    run = subprocess.run(
        [sys.executable, "-c", READ, path], capture_output=True, check=True, text=True
    )
    message, megabytes, seconds = json.loads(run.stdout)
    assert message.startswith(f"{path}: ")
    assert words in message
    assert "\n" not in message
    assert megabytes < MOST_MEGABYTES
    assert seconds < MOST_SECONDS


@pytest.mark.parametrize(
    ("side", "dpi", "given", "most"),
    [
        (4001, None, None, "16 megapixels, as its file states no resolution"),
        (4001, 500, None, "16 megapixels at 500 dpi"),
        (4001, 200, None, "16 megapixels at 200 dpi"),
        (6001, 750, None, "36 megapixels at 750 dpi"),
        (6001, 1000, 750, "36 megapixels at 750 dpi"),
        (4001, None, 500, "16 megapixels at 500 dpi"),
        (8001, 4000, None, "64 megapixels"),
    ],
)
def test_the_limit_of_pixels_is_that_of_four_palms_at_the_resolution(side, dpi, given, most):
    head = saved(rings(), "BMP", **({} if dpi is None else {"dpi": (dpi, dpi)}))
    changed = bytearray(head)
    changed[18:26] = np.array([side, side], "<u4").tobytes()  # there are no such pixels
    with pytest.raises(ImageError, match=f"more than {most}"):
        decode_image(bytes(changed), "print.bmp", dpi=given)


def test_frames_and_arrays_have_the_limit_too():
    size, pixels = RawSize(4100, 4100), np.full((4100, 4100), 255, np.uint8)
    with pytest.raises(ImageError, match="16 megapixels"):
        decode_image(bytes(size.bytes), "frame", raw_sizes=[size])
    for image in (pixels, grey_image(pixels), GreyImage(pixels, 500.0)):
        with pytest.raises(ImageError, match="16 megapixels at 500 dpi"):
            extract(image)
    with pytest.raises(ImageError, match="more than 1 megapixels"):
        ImageLimits(max_megapixels=1).check(1100, 1100, 1000)
