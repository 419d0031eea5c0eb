"""What `scripts/fuzz` feeds with bytes: every reader of templates and of images.

A target is a name, good files to begin from, and a function that reads bytes. It may refuse them by
an error of the family FpmatchError; whatever else it raises is a bug. A new reader is a line in
`all_targets`, or needs none where a registry lists it.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from fpmatch.errors import FpmatchError
from fpmatch.formats.record import ExtendedData, Reading, TemplateRecord, View
from fpmatch.formats.registry import CODECS, codec_of_content
from fpmatch.image.limits import ImageLimits
from fpmatch.image.readers import reader_of
from fpmatch.minutiae import Minutiae, RidgeField, Template

if TYPE_CHECKING:
    from fpmatch.formats.codec import Codec

Read = Callable[[bytes], None]

# Smaller than what commands take: a fuzzer gains nothing from a picture of 64 megapixels.
IMAGE_LIMITS = ImageLimits(max_side_px=4000, max_megapixels=4.0)
WRITTEN_ONE_IN = 8  # of the templates that are read: writing takes longer
IMAGE_DATA = Path(__file__).resolve().parents[1] / "tests" / "image" / "data"
AN2_BLOCKS = {
    "standard": [(6, "07"), (12, "001\x1f10000500090\x1f0\x1fA\x1e002\x1f20001000270\x1f2\x1fB")],
    "iafis": [(14, "07"), (23, "001\x1f10000500270\x1f00\x1fA\x1e002\x1f20001000090\x1f02\x1fC")],
    "m1": [
        *((128, "300"), (129, "400"), (130, "2"), (131, "197"), (132, "197"), (134, "07")),
        (137, "001\x1f100\x1f50\x1f135\x1f1\x1f90\x1e002\x1f200\x1f100\x1f45\x1f2\x1f80"),
    ],
    "efs": [
        (300, "1500\x1f2000\x1f100\x1f200"),
        (331, "1000\x1f500\x1f270\x1fE\x1e0\x1f0\x1f1\x1fX"),
    ],
}


@dataclass(frozen=True)
class Target:
    """Hold a name, good files, and what reads bytes and raises nothing but FpmatchError."""

    name: str
    corpus: list[bytes]
    read: Read


def all_targets() -> list[Target]:
    """Return a target for every template format, and one for each kind of picture."""
    targets = [
        Target(codec.name, _template_files(codec), _template_reader(codec)) for codec in CODECS
    ]
    return targets + [Target(f"image-{kind}", files, read_picture) for kind, files in _pictures()]


def read_picture(data: bytes) -> None:
    """Read bytes as an image of whatever format they begin like."""
    reader_of(data).decode(data, IMAGE_LIMITS)


def _template_reader(codec: Codec) -> Read:
    """Return what reads bytes by a codec, and by the one that takes them, and writes them again."""

    def read(data: bytes) -> None:
        try:
            _check(codec, data)
        except FpmatchError:
            taken = codec_of_content(data)
            if taken is codec:
                raise
            _check(taken, data)

    return read


def _check(codec: Codec, data: bytes) -> None:
    """Read bytes by a codec; what was read must be written, read again and written alike.

    The latter of a part of them only, always the same.
    """
    record = codec.decode(data, Reading())
    if zlib.crc32(data) % WRITTEN_ONE_IN:
        return
    for other in CODECS:
        if other.encode is None:
            continue
        try:
            once = other.encode(record).data
        except FpmatchError:  # the format cannot hold such prints
            continue
        again = other.encode(other.decode(once, Reading()))
        if again.data != once:
            raise AssertionError(f"{other.name}: what was written, read and written differs")


def _template_files(codec: Codec) -> list[bytes]:
    if codec.encode is None:
        return [_an2_file(fields) for fields in AN2_BLOCKS.values()]
    files = []
    for record in _records():
        try:
            files.append(codec.encode(record).data)
        except FpmatchError:  # several prints, for a format of one
            continue
    return files


def _records() -> list[TemplateRecord]:
    """Return records of one print and of two, with and without all that they may have."""
    rng = np.random.default_rng(1)
    n = 12
    minutiae = Minutiae(
        rng.integers(0, 300, n),
        rng.integers(0, 400, n),
        rng.uniform(0, 2 * np.pi, n),
        rng.integers(0, 3, n),
        rng.integers(1, 101, n),
    )
    field = RidgeField(100.0, rng.uniform(0, 3, (4, 3)), rng.random((4, 3)) < 0.7)
    plain = View(Template(minutiae, 300, 400, 500.0), finger=2, quality=80)
    bare = replace(plain, quality=None, quality_known=False)
    full = [
        replace(plain, finger=7, extended=ExtendedData(layout, b"\x00\x02\x00\x08\x01\x00\x01\x00"))
        for layout in ("iso2005", "iso2011", "ansi2004", "ansi2009")
    ]
    views = [plain, bare, replace(plain, template=replace(plain.template, field=field)), *full]
    return [*(TemplateRecord("", (view,)) for view in views), TemplateRecord("", (plain, full[0]))]


def _an2_file(fields: list[tuple[int, str]]) -> bytes:
    image = [(2, "01"), (6, "300"), (7, "400"), (8, "1"), (9, "500"), (10, "500"), (999, "x")]
    first = [(2, "0400"), (3, "1\x1f2\x1e9\x1f01\x1e13\x1f01"), (11, "19.69")]
    return _text(1, first) + _text(9, [(2, "01"), (3, "1"), *fields]) + _text(13, image)


def _text(kind: int, fields: list[tuple[int, str]]) -> bytes:
    """Return a record of an AN2 file that begins with its own length."""
    rest = "".join(f"\x1d{kind}.{number:03d}:{value}" for number, value in fields) + "\x1c"
    length = len(rest) + len(f"{kind}.001:")
    length += len(str(length + len(str(length))))
    return f"{kind}.001:{length}{rest}".encode("latin-1")


def _pictures() -> list[tuple[str, list[bytes]]]:
    """Return pictures of a few rings by kind of file."""
    y, x = np.mgrid[:80, :64]
    grey = (127 + 100 * np.cos(np.hypot(x - 30, y - 40) * 0.8)).astype(np.uint8)
    pictures = {
        "grey": Image.fromarray(grey),
        "colour": Image.fromarray(np.stack([grey, grey // 2, 255 - grey], 2)),
        "deep": Image.fromarray(grey.astype(np.uint16) * 257),
        "bits": Image.fromarray(grey > 127),
    }
    ways = {
        "png": [("PNG", {"dpi": (500, 500)})],
        "tiff": [
            ("TIFF", {"compression": way})
            for way in ("raw", "tiff_lzw", "tiff_deflate", "packbits")
        ],
        "bmp": [("BMP", {})],
        "jpeg": [("JPEG", {"dpi": (500, 500)})],
        "gif": [("GIF", {})],
        "ppm": [("PPM", {})],
        "webp": [("WEBP", {})],
        "jpeg2000": [("JPEG2000", {})],
    }
    kinds = [
        (kind, [file for way in writers for file in _saved(list(pictures.values()), *way)])
        for kind, writers in ways.items()
    ]
    wsq = [path.read_bytes() for path in sorted(IMAGE_DATA.glob("*.wsq"))]
    png = _saved([pictures["grey"]], "PNG", {})[0]
    kinds.append(("an2", [_an2_image(grey.tobytes(), 0), _an2_image(png, 6)]))
    kinds.append(("fir", [_finger_image(grey.tobytes(), 0), _finger_image(png, 6)]))
    return kinds + ([("wsq", wsq)] if wsq else [])


def _an2_image(data: bytes, code: int) -> bytes:
    """Return an AN2 file with a picture of 64 x 80 pixels: type 14 of pixels, type 4 of a PNG."""
    if code == 0:
        numbers = [(6, "64"), (7, "80"), (8, "1"), (9, "500"), (10, "500"), (11, "NONE")]
        kind, record = 14, _text(14, [*numbers, (12, "8"), (999, data.decode("latin-1"))])
    else:
        head = struct.pack(">9B2HB", 1, 0, 1, *[255] * 5, 0, 64, 80, code)
        kind, record = 4, struct.pack(">L", 4 + len(head) + len(data)) + head + data
    return _text(1, [(2, "0400"), (3, f"1\x1f1\x1e{kind}\x1f01"), (11, "19.69")]) + record


def _finger_image(data: bytes, compression: int) -> bytes:
    """Return a record of ISO/IEC 19794-4:2011 with a picture of 64 x 80 pixels."""
    scale = struct.pack(">B4H", 1, 500, 500, 500, 500)
    body = bytes(15) + bytes([7, 1]) + scale
    body += struct.pack(">3B2HL", 8, compression, 0, 64, 80, len(data)) + data
    body = struct.pack(">L", 4 + len(body)) + body
    return b"FIR\x00020\x00" + struct.pack(">LH2B", 16 + len(body), 1, 0, 1) + body


def _saved(pictures: list[Image.Image], kind: str, options: dict[str, object]) -> list[bytes]:
    """Return pictures as files of a kind, those that it can hold."""
    files = []
    for picture in pictures:
        stream = io.BytesIO()
        try:
            picture.save(stream, kind, **options)
        except (OSError, KeyError):
            continue
        files.append(stream.getvalue())
    return files
