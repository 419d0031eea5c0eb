"""Small images in every format, for ``python -m research fuzz`` to damage.

They are small so that reading is fast, and differ in depth, colour, compression and order, each of
which has its own code in the decoders.
"""

from __future__ import annotations

import io
import struct
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from fpmatch.image.io.grey import RawSize

WIDTH, HEIGHT = 64, 80
RAW_SIZES = (RawSize(WIDTH, HEIGHT), RawSize(53, 61))
IMAGE_DATA = Path(__file__).resolve().parents[2] / "tests" / "image" / "data"
AN2_CODES = {"NONE": 0, "WSQ20": 1, "JPEGB": 2, "JP2": 4, "PNG": 6}  # of compression
TIFF_WAYS = ("raw", "tiff_lzw", "tiff_deflate", "tiff_adobe_deflate", "packbits")
BITS_WAYS = ("raw", "packbits", "tiff_ccitt", "group3", "group4")
IMAGE_KINDS = (
    *("png", "tiff", "bmp", "jpeg", "gif", "pnm", "webp", "jpeg2000", "wsq", "raw", "an2"),
)
MANY_STRIPS = {278: 16}  # rows of each


@cache
def image_files() -> dict[str, list[bytes]]:
    """Return good files by kind of file."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    grey = (127 + 100 * np.cos(np.hypot(x - 30, y - 40) * 0.8)).astype(np.uint8)
    pictures = {
        "grey": Image.fromarray(grey),
        "colour": Image.fromarray(np.stack([grey, grey // 2, 255 - grey], 2)),
        "clear": Image.fromarray(np.stack([grey, grey, grey, 255 - grey // 2], 2)),
        "deep": Image.fromarray(grey.astype(np.uint16) * 257),
        "bits": Image.fromarray(grey > 127),
        "palette": Image.fromarray(grey).quantize(16),
    }
    kinds: dict[str, list[bytes]] = {
        "png": _saved(pictures, "PNG", dpi=(500, 500)),
        "tiff": _tiffs(pictures),
        "bmp": _saved(pictures, "BMP", dpi=(500, 500)),
        "jpeg": [
            *_saved(_some(pictures, "grey", "colour"), "JPEG", dpi=(500, 500)),
            *_saved(_some(pictures, "grey"), "JPEG", progressive=True),
            lossless_jpeg(grey, table_class=1),
            *_saved({"ink": pictures["colour"].convert("CMYK")}, "JPEG", optimize=True),
        ],
        "gif": [
            *_saved(_some(pictures, "grey", "bits", "palette"), "GIF"),
            *_saved(_some(pictures, "palette"), "GIF", interlace=0, transparency=0),
            *_saved(_some(pictures, "grey"), "GIF", save_all=True, append_images=[grey_turned()]),
        ],
        "pnm": _saved(pictures, "PPM"),
        "webp": _saved(_some(pictures, "grey", "clear"), "WEBP"),
        "jpeg2000": [
            *_saved(_some(pictures, "grey", "colour", "deep"), "JPEG2000"),
            *_saved(_some(pictures, "grey"), "JPEG2000", no_jp2=True, irreversible=True),
        ],
        "wsq": [path.read_bytes() for path in sorted(IMAGE_DATA.glob("*.wsq"))],
        "raw": [grey.tobytes(), grey[:61, :53].tobytes()],
    }
    inner = {"NONE": grey.tobytes(), "WSQ20": kinds["wsq"][-1], "JPEGB": kinds["jpeg"][0]}
    inner |= {"JP2": kinds["jpeg2000"][0], "PNG": kinds["png"][0]}
    kinds["an2"] = [
        *(_an2_binary(data, AN2_CODES[name]) for name, data in inner.items()),
        *(_an2_tagged(data, name) for name, data in inner.items()),
    ]
    return kinds


def an2_text(kind: int, fields: list[tuple[int, str]]) -> bytes:
    """Return a record of an AN2 file that begins with its own length."""
    rest = "".join(f"\x1d{kind}.{number:03d}:{value}" for number, value in fields) + "\x1c"
    length = len(rest) + len(f"{kind}.001:")
    length += len(str(length + len(str(length))))
    return f"{kind}.001:{length}{rest}".encode("latin-1")


def lossless_jpeg(
    pixels: np.ndarray[Any, np.dtype[np.uint8]], table_class: int = 0, number: int = 0
) -> bytes:
    """Return a lossless JPEG (SOF3, the pixel to the left predicts) with a class of its tables."""
    height, width = pixels.shape
    values = pixels.astype(int)
    before = np.empty_like(values)
    before[:, 1:] = values[:, :-1]
    before[1:, 0] = values[:-1, 0]
    before[0, 0] = 128
    bits = ""
    for difference in (values - before).ravel().tolist():
        size = abs(difference).bit_length()
        low = difference if difference > 0 else difference + 2**size - 1
        bits += f"{size:04b}" + (f"{low:0{size}b}" if size else "")
    bits += "1" * (-len(bits) % 8)
    coded = int(bits, 2).to_bytes(len(bits) // 8, "big").replace(b"\xff", b"\xff\x00")

    def segment(marker: int, data: bytes) -> bytes:
        return bytes([0xFF, marker]) + (2 + len(data)).to_bytes(2, "big") + data

    table = bytes([table_class << 4 | number, 0, 0, 0, 9, *bytes(12), *range(9)])
    return b"".join(
        [
            b"\xff\xd8",
            segment(0xFE, b"NIST_COM 2\nPPI 500\n"),
            segment(0xC3, struct.pack(">B2H4B", 8, height, width, 1, 1, 0x11, 0)),
            segment(0xC4, table),
            segment(0xDA, bytes([1, 1, number << 4, 1, 0, 0])) + coded + b"\xff\xd9",
        ]
    )


def grey_turned() -> Image.Image:
    """Return a second picture for files of several."""
    return Image.linear_gradient("L").resize((WIDTH, HEIGHT))


def _tiffs(pictures: dict[str, Image.Image]) -> list[bytes]:
    bits = _some(pictures, "bits")
    files = [file for way in TIFF_WAYS for file in _saved(pictures, "TIFF", compression=way)]
    files += [file for way in BITS_WAYS for file in _saved(bits, "TIFF", compression=way)]
    files += _saved(_some(pictures, "grey", "colour"), "TIFF", compression="jpeg")
    more = {"tiffinfo": MANY_STRIPS, "dpi": (500, 500)}
    files += _saved(_some(pictures, "grey"), "TIFF", compression="tiff_lzw", **more)
    return files + _saved(
        _some(pictures, "grey"), "TIFF", save_all=True, append_images=[grey_turned()]
    )


def _an2_tagged(data: bytes, compression: str) -> bytes:
    """Return an AN2 file with a picture in a record of type 14."""
    numbers = [(6, str(WIDTH)), (7, str(HEIGHT)), (8, "1"), (9, "500"), (10, "500")]
    record = an2_text(14, [*numbers, (11, compression), (12, "8"), (999, data.decode("latin-1"))])
    return _an2_first(14) + record


def _an2_binary(data: bytes, code: int) -> bytes:
    """Return an AN2 file with a picture in a record of type 4."""
    head = struct.pack(">9B2HB", 1, 0, 1, *[255] * 5, 0, WIDTH, HEIGHT, code)
    return _an2_first(4) + struct.pack(">L", 4 + len(head) + len(data)) + head + data


def _an2_first(kind: int) -> bytes:
    return an2_text(1, [(2, "0400"), (3, f"1\x1f1\x1e{kind}\x1f01"), (11, "19.69")])


def _some(pictures: dict[str, Image.Image], *names: str) -> dict[str, Image.Image]:
    return {name: pictures[name] for name in names}


def _saved(pictures: dict[str, Image.Image], kind: str, **options: object) -> list[bytes]:
    """Return pictures as files of a kind, those that it can hold."""
    files = []
    for picture in pictures.values():
        stream = io.BytesIO()
        try:
            picture.save(stream, kind, **options)
        except (OSError, KeyError):
            continue
        files.append(stream.getvalue())
    return files
