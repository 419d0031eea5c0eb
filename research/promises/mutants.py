"""Good files of every format, damaged copies of them, and files that state absurd sizes."""

from __future__ import annotations

import io
import re
import struct
import zlib
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from PIL import Image

from research.fuzzing.mutators.records import chunk
from research.fuzzing.targets.good_images import an2_text
from research.promises.program import PROBE

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path
    from random import Random

    from research.promises.program import Place

_PICTURES: Final[dict[str, dict[str, Any]]] = {
    "png": {},
    "bmp": {},
    "gif": {},
    "pgm": {"format": "PPM"},
    "jpg": {},
    "scans.jpg": {"progressive": True},
    "webp": {},
    "jp2": {},
    "tif": {},
    "lzw.tif": {"compression": "tiff_lzw"},
    "zip.tif": {"compression": "tiff_adobe_deflate"},
    "jpeg.tif": {"compression": "jpeg"},
    "fax.tif": {"compression": "group4"},
}
_TEMPLATES: Final = (
    *("json", "csv", "minutiae-csv", "iso2005", "iso2011", "ansi2004", "ansi2009"),
    *("ansi2009am1", "xyt", "xyt-m1"),
)
_EXTREMES: Final = (b"\0", b"\xff", b"\x7f\xff\xff\xff", b"\xff\xff\xff\xff", b"\x80\0\0\0")
_NUMBERS: Final = (b"nan", b"-1", b"1e999", b"99999999999999999999", b"0", b"", b"\xff", b"1e-320")


def pictures(place: Place) -> dict[str, bytes]:
    """Return the probe in every format of images that Pillow writes."""
    with Image.open(PROBE) as opened:
        grey = opened.convert("L")
    made = {}
    for name, options in _PICTURES.items():
        path = place.folder / f"good.{name}"
        (grey.convert("1") if "fax" in name else grey).save(path, dpi=(500, 500), **options)
        made[name] = path.read_bytes()
    return made


def template_files(place: Place) -> dict[str, bytes]:
    """Return the template of the probe in every format."""
    place.done("key", "keys.txt", "--new")
    for name in _TEMPLATES:
        place.done("convert", PROBE, f"good.{name}", "--format", name)
    made = {name: (place.folder / f"good.{name}").read_bytes() for name in _TEMPLATES}
    array, text = io.BytesIO(), "10 20 1.5\n99 40 3\n50 80 2\n"
    np.save(array, np.loadtxt(text.splitlines()))
    return {**made, "npy": array.getvalue(), "numbers.txt": text.encode(), "an2": an2()}


def an2() -> bytes:
    """Return an ANSI/NIST-ITL file with a record of type 9 of three minutiae."""
    minutiae = (f"{k:03}\x1f{1000 * k:04}{1200 * k:04}{40 * k:03}\x1f60\x1fA" for k in (1, 2, 3))
    fields = [(2, "01"), (3, "4"), (4, "S"), (5, "A\x1fA\x1fA"), (6, "1"), (7, "U")]
    fields += [(10, "3"), (11, "0"), (12, "\x1e".join(minutiae))]
    first = [(2, "0300"), (3, "1\x1f1\x1e9\x1f01"), (4, "A"), (5, "20200101"), (7, "A")]
    first += [(8, "A"), (9, "A"), (11, "19.69"), (12, "19.69")]
    return an2_text(1, first) + an2_text(9, fields)


def mutants(good: bytes, random: Random, number: int) -> Iterator[bytes]:
    """Damage a file in one of many ways, so many times."""
    places = [one.span() for one in re.finditer(rb"-?\d+(\.\d+)?", good)]
    for _ in range(number):
        k, length = random.randrange(len(good)), random.choice((1, 2, 4, 30, 400))
        match random.randrange(7):
            case 0:
                yield good[:k]
            case 1:
                yield good[:k] + good[k + length :]
            case 2:
                yield good[:k] + good[k : k + length] * random.choice((2, 3, 200)) + good[k:]
            case 3:
                value = random.choice(_EXTREMES)
                yield good[:k] + value + good[k + len(value) :]
            case 4:
                start, end = random.choice(places)
                yield good[:start] + random.choice(_NUMBERS) + good[end:]
            case _:
                changed = bytearray(good)
                for _ in range(random.choice((1, 1, 3, 20))):
                    changed[random.randrange(len(good))] = random.randrange(256)
                yield bytes(changed)


def write_mutants(
    place: Place, files: dict[str, bytes], each: int, *, cut: bool = False
) -> list[Path]:
    """Write damaged copies of files, or cut ones; return their paths."""
    rng, paths = place.random, []
    for name, good in files.items():
        cuts = (good[: rng.randrange(len(good))] for _ in range(each))
        for k, content in enumerate(cuts if cut else mutants(good, rng, each)):
            paths.append(place.write(f"{k}.{name}", content))
    return paths


def giants() -> dict[str, bytes]:
    """Return files of a few bytes that state a side of 60,000 pixels or more, or as many rows."""
    huge = 60_000
    head = struct.pack(">2I5B", huge, huge, 8, 0, 0, 0, 0)
    frame = struct.pack(">2H", huge, huge)
    bitmap = struct.pack("<2s3I3I2H6I", b"BM", 9999, 0, 1078, 40, huge, huge, 1, 8, *(0,) * 6)
    return {
        "giant.png": b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", bytes(9)),
        "giant.bmp": bitmap + bytes(9000),
        "giant.gif": b"GIF89a" + b"\xff" * 4 + b"\x80\0\0" + bytes(6) + b",\0\0\0\0" + b"\xff" * 4,
        "giant.pgm": b"P5 99999 99999 255\n" + bytes(999),
        "giant.pbm": b"P1 99999 99999\n0 1 0",
        "giant.jpg": b"\xff\xd8\xff\xc0\0\x0b\x08" + frame + b"\1\1\x11\0" + bytes(99),
        "giant.tif": tiff(huge, huge, [1]),
        "giant.wsq": b"\xff\xa0\xff\xa2\0\x11\0\xff" + frame + bytes(99),
        "giant.json": b'{"format": "fpmatch-template", "version": 2, "width": 1e9, "height": 1e9}',
        "giant.iso": b"FMR\0 20\0" + b"\xff" * 900,
    }


def bombs() -> dict[str, bytes]:
    """Return files of few bytes that decode to many, or by many steps."""
    flat, deep = Image.new("L", (5600, 5600)), io.BytesIO()
    Image.new("L", (2000, 2000)).save(deep, "JPEG", progressive=True)
    scans = deep.getvalue()
    last = scans.rindex(b"\xff\xda")
    made = {
        "scans.jpg": scans[:last] + scans[last:-2] * 3000 + scans[-2:],
        "strips.tif": tiff(100, 60_000, [1] * 60_000),
        "text.png": _flat(Image.new("L", (300, 300)), "PNG").replace(
            chunk(b"IEND", b""),
            chunk(b"zTXt", b"a\0\0" + zlib.compress(bytes(300_000_000))) + chunk(b"IEND", b""),
        ),
        "space.csv": b"# fpmatch-template 1 width=388 height=374 dpi=500\n" + b" \n" * 8_000_000,
        "deep.json": b'{"format": "fpmatch-template", "a": ' + b"[" * 2_000_000,
        "digits.json": b'{"format": "fpmatch-template", "version": ' + b"9" * 15_000_000 + b"}",
        "digits.xyt": b"9" * 15_000_000 + b" 1 1\n",
    }
    for kind in ("PNG", "GIF", "WEBP", "JPEG2000", "TIFF"):
        made[f"flat.{kind.lower()}"] = _flat(flat, kind)
    return made


def tiff(width: int, height: int, strips: list[int]) -> bytes:
    """Return a TIFF whose strips, of so many bytes each, all begin at one place."""
    tags = [(256, 4, [width]), (257, 4, [height]), (258, 3, [8]), (259, 3, [1]), (262, 3, [1])]
    tags += [(273, 4, [8] * len(strips)), (278, 4, [-(-height // len(strips))]), (279, 4, strips)]
    place, entries, data = 8 + 2 + 12 * len(tags) + 4, b"", b""
    for tag, kind, values in tags:
        content = struct.pack(f"<{len(values)}I", *values)
        offset = content if len(values) == 1 else struct.pack("<I", place + len(data))
        data += content if len(values) > 1 else b""
        entries += struct.pack("<2HI", tag, kind, len(values)) + offset
    return b"II*\0\x08\0\0\0" + struct.pack("<H", len(tags)) + entries + bytes(4) + data


def _flat(image: Image.Image, kind: str) -> bytes:
    stream = io.BytesIO()
    options = {"lossless": True} if kind == "WEBP" else {}
    image.save(stream, kind, **options, **({"compression": "tiff_lzw"} if kind == "TIFF" else {}))
    return stream.getvalue()
