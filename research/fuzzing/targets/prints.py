"""Targets: every reader of templates and of pictures; the registries of formats list them."""

from __future__ import annotations

import io
import zlib
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from fpmatch.errors import FpmatchError
from fpmatch.formats.files import decode_record
from fpmatch.formats.record import ReadingOptions, TemplateRecord, View
from fpmatch.formats.registry import CODECS, recognise
from fpmatch.image.extract import extract
from fpmatch.image.io.grey import ImageLimits
from fpmatch.image.io.read import decode_image, read_image
from fpmatch.matching.calibration import MAX_SCORE
from fpmatch.matching.verify import verify
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template
from research.fuzzing.damage import with_right_length, with_right_sums
from research.fuzzing.good_images import IMAGE_KINDS, RAW_SIZES, an2_text, image_files
from research.fuzzing.target import SAMPLES, Read, Reader, Target
from research.fuzzing.targets.stores import PROBE, templates

if TYPE_CHECKING:
    from fpmatch.formats.record import Codec

# Smaller than those of the commands: large images would only be slow.
IMAGE_LIMITS = ImageLimits(max_side_px=4000, max_megapixels=4.0)
EXTRACT_LIMITS = ImageLimits(max_side_px=600, max_megapixels=0.1)
WRITTEN_ONE_IN = 8  # of the templates that are read: writing takes longer
REPAIRED_IMAGES = {"png": with_right_sums, "fir": with_right_length}
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

READ_ONLY = {  # a record of one minutia in each format of the family that is only read
    "ansi2009": bytes.fromhex(
        "464d5200 30333000 0000002e 0000 0000 00 0000 01 00"
        "02 00 00 50 0000 0000 012c 0190 00c5 00c5 01 8064 0032 2d 4d 0000"
    ),
    "iso2011": bytes.fromhex(
        "464d5200 30333000 0000003c 0001 00"
        "0000002d ffffffffffffffffff 00 0000 0000 01 50 0000 0000"
        "02 00 00c5 00c5 00 012c 0190 60 01 8064 0032 40 4d 0000"
    ),
}


def print_targets() -> list[Target]:
    """Return a target for every template format, and one for each kind of picture."""
    return [
        *(Target(codec.name, partial(_template, codec), (b"nan", b"1e400")) for codec in CODECS),
        *(Target(f"image-{kind}", partial(_pictures, kind)) for kind in IMAGE_KINDS),
        Target("compare", _compared, kernels=True),
        Target("extract", _extracted, kernels=True),
    ]


def read_picture(data: bytes) -> None:
    """Read bytes as an image of whatever format they begin like, or as bare pixels."""
    decode_image(data, "it", limits=IMAGE_LIMITS, raw_sizes=RAW_SIZES)


def _template(codec: Codec) -> Reader:
    repair = with_right_length if codec.name.startswith(("iso", "ansi")) else None
    return Reader(_template_files(codec), _template_reader(codec), repair)


def _pictures(kind: str) -> Reader:
    return Reader(image_files()[kind], read_picture, REPAIRED_IMAGES.get(kind))


def _compared() -> Reader:
    """Compare what is read with a good template, in both orders."""
    good = templates()[PROBE]

    def read(data: bytes) -> None:
        for view in decode_record(data, "it").views[:2]:
            for pair in ((view.template, good), (good, view.template)):
                found = verify(*pair)
                if not 0 <= found.score <= MAX_SCORE:
                    raise AssertionError(f"score {found.score}")

    records = [TemplateRecord("", (View(template),)) for template in templates().values()]
    kinds = [codec for codec in CODECS if codec.name in {"json", "iso2005"}]
    encoded = [codec.encode(one) for codec in kinds if codec.encode for one in records[-2:]]
    return Reader([one.data for one in encoded], read)


def _extracted() -> Reader:
    """Extract the minutiae of pictures of some formats."""

    def read(data: bytes) -> None:
        found = decode_image(data, "it", limits=EXTRACT_LIMITS)
        extract(found, found.dpi or 500.0)

    kinds = image_files()
    corpus = [*kinds["png"][:3], *kinds["tiff"][:4], *kinds["bmp"][:2], *kinds["wsq"][:1]]
    middle = read_image(SAMPLES / "101_1.tif").pixels[80:280, 80:240]
    stream = io.BytesIO()
    Image.fromarray(middle).save(stream, "PNG", dpi=(500, 500), compress_level=1)
    return Reader([*corpus, *[stream.getvalue()] * 5], read)


def _template_reader(codec: Codec) -> Read:
    """Return what reads bytes by a codec, and by the one that takes them, and writes them again."""

    def read(data: bytes) -> None:
        try:
            _check(codec, data)
        except FpmatchError:
            taken = recognise(data)
            if taken is None or taken is codec:
                raise
            _check(taken, data)

    return read


def _check(codec: Codec, data: bytes) -> None:
    """Read bytes by a codec; for a fixed part of the inputs also check writing."""
    record = codec.decode(data, ReadingOptions())
    if zlib.crc32(data) % WRITTEN_ONE_IN:
        return
    for other in CODECS:
        if other.encode is None:
            continue
        try:
            once = other.encode(record).data
        except FpmatchError:  # the format cannot hold such prints
            continue
        again = other.encode(other.decode(once, ReadingOptions()))
        if again.data != once:
            raise AssertionError(f"{other.name}: what was written, read and written differs")


def _template_files(codec: Codec) -> list[bytes]:
    if codec.name in READ_ONLY:
        return [READ_ONLY[codec.name]]
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
        rng.integers(0, 300, n).astype(np.float32),
        rng.integers(0, 400, n).astype(np.float32),
        rng.uniform(0, 2 * np.pi, n).astype(np.float32),
        rng.integers(0, 3, n).astype(np.uint8),
        rng.integers(1, 101, n).astype(np.uint8),
    )
    orientation = rng.uniform(0, 3, (4, 3)).astype(np.float32)
    field = RidgeField(100.0, orientation, rng.random((4, 3)) < 0.7)
    plain = View(Template(minutiae, 300, 400, 500.0), finger=2, quality=80)
    bare = replace(plain, quality=None, quality_known=False)
    full = replace(plain, finger=7, extended=b"\x00\x02\x00\x08\x01\x00\x01\x00")
    views = [plain, bare, replace(plain, template=replace(plain.template, field=field))]
    records = [TemplateRecord("", (view,)) for view in views]
    for layout in ("iso2005", "ansi2004"):
        records += [TemplateRecord(layout, (full,)), TemplateRecord(layout, (plain, full))]
    return records


def _an2_file(fields: list[tuple[int, str]]) -> bytes:
    image = [(2, "01"), (6, "300"), (7, "400"), (8, "1"), (9, "500"), (10, "500"), (999, "x")]
    first = [(2, "0400"), (3, "1\x1f2\x1e9\x1f01\x1e13\x1f01"), (11, "19.69")]
    return an2_text(1, first) + an2_text(9, [(2, "01"), (3, "1"), *fields]) + an2_text(13, image)
