"""Image files of every format that is read, made without any library that reads them."""

import struct
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image

from fpmatch.image.io.read import decode_image
from research.fuzzing.good_images import an2_text, lossless_jpeg

DATA = Path(__file__).parent / "data"


def rings(height=72, width=60):
    """Return concentric ridges that fill the picture."""
    y, x = np.mgrid[:height, :width].astype(float)
    return (128 + 90 * np.cos(2 * np.pi * np.hypot(x - 25, y - 40) / 9)).astype(np.uint8)


def saved(pixels, file_format, **options):
    """Return a picture as a file of one of Pillow's formats."""
    stream = BytesIO()
    Image.fromarray(pixels).save(stream, format=file_format, **options)
    return stream.getvalue()


def decoded(data):
    """Return a picture as the reader of its format reads it, with the polarity of its file."""
    return decode_image(data, "file", polarity="dark")


def wsq(name="rings_53x61"):
    """Return a WSQ file that NIST's own encoder made of rings."""
    return (DATA / f"{name}.wsq").read_bytes()


def with_fields(type_, fields):
    """Return a record of text fields of ANSI/NIST-ITL, its length first."""
    return an2_text(type_, [(number, value.decode("latin-1")) for number, value in fields])


def an2(*records, scan=b"19.69"):
    """Return an ANSI/NIST file of records, each its type and its bytes."""
    contents = [b"1\x1f%d" % len(records)]
    contents += [b"%d\x1f%02d" % (type_, n) for n, (type_, _) in enumerate(records)]
    fields = [(2, b"0400"), (3, b"\x1e".join(contents)), (4, b"AMN"), (11, scan), (12, scan)]
    return with_fields(1, fields) + b"".join(data for _, data in records)


def tagged_print(pixels, data=None, *, type_=14, compression=b"NONE", scale=(1, 500, 500)):
    """Return a record of type 13 to 15 with a print; `scale` is its units and resolutions."""
    fields = [(6 + n, b"%d" % value) for n, value in enumerate((*pixels.shape[::-1], *scale))]
    fields += [(11, compression), (12, b"8"), (999, pixels.tobytes() if data is None else data)]
    return type_, with_fields(type_, fields)


def binary_print(pixels, data=None, *, compression=0, native=0):
    """Return a record of type 4 with a print."""
    image = pixels.tobytes() if data is None else data
    size = pixels.shape[::-1]
    head = struct.pack(">9B2HB", 1, 0, 1, *[255] * 5, native, *size, compression)
    return 4, struct.pack(">L", 4 + len(head) + len(image)) + head + image


def one_of_each():
    """Return a small file of every format."""
    grey = rings()
    pillow = ("TIFF", "PNG", "BMP", "JPEG", "PPM", "GIF", "WEBP", "JPEG2000")
    palette = BytesIO()
    Image.fromarray(grey).quantize(16).save(palette, format="TIFF", compression="tiff_lzw")
    return {name: saved(grey, name) for name in pillow} | {
        "TIFF, LZW": palette.getvalue(),
        "TIFF, fax": saved(grey > 128, "TIFF", compression="group4"),
        "TIFF, JPEG": saved(grey, "TIFF", compression="jpeg"),
        "PNG, 16 bits": saved(grey.astype(np.uint16) * 257, "PNG", dpi=(500, 500)),
        "PNG, RGBA": saved(np.dstack([grey, grey, grey, grey]), "PNG"),
        "JPEG, lossless": lossless_jpeg(grey, table_class=1),
        "WSQ": wsq(),
        "AN2, type 4": an2(binary_print(grey)),
        "AN2, type 14": an2(tagged_print(rings(61, 53), wsq(), compression=b"WSQ20")),
    }
