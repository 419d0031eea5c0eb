"""Records of prints that never were, and what the formats keep of them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from hypothesis import strategies as st

from fpmatch.errors import TemplateError
from fpmatch.formats.record import ReadingOptions, TemplateRecord, View
from fpmatch.formats.registry import CODECS, codec_of_name, recognise
from fpmatch.templates.minutiae import Minutiae, Template
from research.fuzzing.good_images import an2_text

FORMATS = Path(__file__).parents[3] / "shared" / "formats"  # files of other software
WRITTEN = [codec.name for codec in CODECS if codec.encode]
FMR = ["iso2005", "ansi2004"]
ANGLE_STEP_DEG = {
    **{"iso2005": 360 / 256, "ansi2004": 2.0, "xyt": 1.0, "xyt-m1": 2.0},
    **{"csv": 1e-4, "minutiae-csv": 1e-4, "json": 0.0},
}


def read(data, *, file_format=None, **options):
    """Return the record in the bytes of a file, under the `ReadingOptions`."""
    codec = codec_of_name(file_format) if file_format else recognise(data)
    if codec is None:
        raise TemplateError("of no known format")
    return codec.decode(data, ReadingOptions(**options))


def only_view(data, **options):
    return read(data, **options).single()


def columns(count, *position):
    """Return the columns of minutiae, of two strategies for x and y."""
    values = (*position, st.floats(0, 6.25, width=32), st.integers(0, 2), st.integers(0, 100))
    return st.tuples(*(st.lists(column, min_size=count, max_size=count) for column in values))


@st.composite
def templates(draw, most=12, fewest=0):
    """Return a template whose minutiae lie inside it."""
    width, height = draw(st.tuples(st.integers(2, 3000), st.integers(2, 3000)))
    position = (st.floats(0, side - 1, width=32) for side in (width, height))
    minutiae = Minutiae(*draw(columns(draw(st.integers(fewest, most)), *position)))
    return Template(minutiae, width, height, draw(st.integers(100, 4000)))


@st.composite
def records(draw, views=1, fewest=0):
    """Return a record of as many views as `views` at most, of one frame."""
    first = draw(templates(fewest=fewest))
    others = draw(st.lists(templates(), max_size=views - 1))
    drawn = []
    for template in [first, *others]:
        inside = (template.minutiae.x < first.width) & (template.minutiae.y < first.height)
        drawn.append(
            View(
                replace(first, minutiae=template.minutiae.take(inside)),
                finger=draw(st.integers(0, 10)),
                impression=draw(st.integers(0, 9)),
                quality=draw(st.none() | st.integers(0, 100)),
                quality_known=draw(st.booleans()),
            )
        )
    return TemplateRecord("", tuple(drawn))


def written(name, record):
    return codec_of_name(name).encode(record).data


def record_of(*templates):
    """Return a record of templates about which nothing else is known."""
    return TemplateRecord("", tuple(map(View, templates)))


def frame_of(record):
    """Return the reading options for a format that keeps neither size nor resolution."""
    template = record.views[0].template
    return {"dpi": template.dpi, "size": (template.width, template.height)}


def turn_deg(a, b):
    difference = a.astype(float) - b.astype(float)
    return np.abs(np.degrees(np.angle(np.exp(1j * difference))))


def sample_record(count=20):
    """Return a record of one view with `count` minutiae, always the same."""
    rng = np.random.default_rng(8)
    minutiae = Minutiae(
        rng.integers(0, 300, count),
        rng.integers(0, 400, count),
        rng.uniform(0, 2 * np.pi, count),
        rng.integers(0, 3, count),
        rng.integers(1, 101, count),
    )
    view = View(Template(minutiae, 300, 400, 500.0), finger=7, impression=1, quality=80)
    return TemplateRecord("", (view,))


# Records by hand: 300 x 400 pixels at 500 dpi, right index, and one bifurcation at (100, 50), 90
# degrees, quality 77.
BY_HAND = {
    name: bytes.fromhex(text)
    for name, text in {
        "iso2005": "464d5200 20323000 00000024 0000 012c 0190 00c5 00c5 01 00"
        "02 00 50 01 8064 0032 40 4d 0000",
        "ansi2004": "464d5200 20323000 0026 0000 0000 0000 012c 0190 00c5 00c5 01 00"
        "02 00 50 01 8064 0032 2d 4d 0000",
        "ansi2009": "464d5200 30333000 0000002e 0000 0000 00 0000 01 00"
        "02 00 00 50 0000 0000 012c 0190 00c5 00c5 01 8064 0032 2d 4d 0000",
        "iso2011": "464d5200 30333000 0000003c 0001 00"
        "0000002d ffffffffffffffffff 00 0000 0000 01 50 0000 0000"
        "02 00 00c5 00c5 00 012c 0190 60 01 8064 0032 40 4d 0000",
    }.items()
}


def sample_files():
    """Return a file of every format that defines its angles, by name."""
    record = sample_record()
    files = {name: written(name, record) for name in WRITTEN}
    return {**BY_HAND, **files, "an2": an2_file()}


def an2_file(
    block="standard",
    image="13",
    resolution="19.69",
    *,
    region="1500\x1f2000\x1f100\x1f200",
    minutiae="1000\x1f500\x1f270\x1fE\x1e2000\x1f1000\x1f90\x1fB\x1e0\x1f0\x1f180\x1fX",
):
    """Return an AN2 file with three minutiae in a block of type 9, and an image record.

    `region` and `minutiae` are fields of the extended feature set.
    """
    blocks = {
        "standard": [(6, "07"), (12, "001\x1f10000500090\x1f0\x1fA\x1e002\x1f20001000270\x1f2\x1fB"
                                     "\x1e003\x1f00000000000\x1f63\x1fD")],
        "iafis": [(14, "07"), (23, "001\x1f10000500270\x1f00\x1fA\x1e002\x1f20001000090\x1f02\x1fB"
                                   "\x1e003\x1f00000000180\x1f63\x1fC")],
        "m1": [(128, "300"), (129, "400"), (130, "2"), (131, "197"), (132, "197"), (134, "07"),
               (137, "001\x1f100\x1f50\x1f135\x1f1\x1f90\x1e002\x1f200\x1f100\x1f45\x1f2\x1f80"
                     "\x1e003\x1f0\x1f0\x1f90\x1f0\x1f0")],
        "efs": [(300, region), (302, "7"), (331, minutiae)],
        "none": [(6, "07")],
    }  # fmt: skip
    images = {
        "13": an2_text(13, [(2, "01"), (6, "300"), (7, "400"), (8, "1"), (9, "500"), (10, "500"),
                         (999, "pixels\x1d13.006:9\x1d")]),
        "4": (36).to_bytes(4, "big") + bytes([1, 1, *[255] * 6, 0, 1, 44, 1, 144, 0]) + bytes(18),
        "none": b"",
    }  # fmt: skip
    kind = {"13": "\x1e13\x1f01", "4": "\x1e4\x1f01", "none": ""}[image]
    count = 2 if image == "none" else 3
    contents = f"1\x1f{count - 1}\x1e9\x1f01{kind}"
    first = an2_text(1, [(2, "0400"), (3, contents), (11, resolution), (12, resolution)])
    return first + an2_text(9, [(2, "01"), (3, "1"), *blocks[block]]) + images[image]
