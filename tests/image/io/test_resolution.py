from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from fpmatch.errors import ImageError
from fpmatch.image.io.grey import ImageLimits, usable_axes, usable_dpi
from fpmatch.image.io.pillow_formats import ASSUMED_UNIT
from fpmatch.image.io.read import decode_image
from tests.image.made_files import decoded, rings, saved

GREY = rings()


def told(data):
    picture = decoded(data)
    return picture.dpi, picture.notes


def exif(dpi, unit=2):
    tags = Image.Exif()
    tags[282] = tags[283] = dpi
    tags[296] = unit
    return tags.tobytes()


@pytest.mark.parametrize(
    ("comment", "dpi"),
    [
        ("NIST_COM 9\nPIX_WIDTH 300\nPPI 500\nLOSSY 1", 500),
        ("scanned at 569 dpi", 569),
        ("DPI: 1000", 1000),
        ("dpi=508.0", 508),
        ("PPI -1", None),
        ("72 dpi", None),
        ("serial number 500", None),
        ("PPI 50000", None),
    ],
)
def test_comments(comment, dpi):
    for data in (
        saved(GREY, "JPEG", comment=comment.encode()),
        saved(GREY, "GIF", comment=comment.encode()),
    ):
        assert told(data)[0] == dpi, data[:60]


def test_what_is_usable():
    assert told(saved(GREY, "TIFF", resolution=500, resolution_unit=1)) == (500, (ASSUMED_UNIT,))
    assert told(saved(GREY, "TIFF", resolution=1, resolution_unit=1)) == (None, ())
    assert told(saved(GREY, "JPEG", exif=exif(500))) == (500, ())
    assert told(saved(GREY, "JPEG", exif=exif(200, unit=3))) == (508, ())
    assert told(saved(GREY, "JPEG", dpi=(500, 500), comment=b"PPI 569"))[0] == 500
    assert told(saved(GREY, "JPEG", dpi=(96, 96), comment=b"PPI 569"))[0] == 569
    assert told(saved(GREY, "TIFF", dpi=(1000, 1001))) == (1000, ())
    assert usable_axes(500, 506) == (500, 506)
    damaged = exif(500)[:10] + bytes(len(exif(500)) - 10)
    assert told(saved(GREY, "JPEG", exif=damaged))[0] is None
    assert usable_dpi("500") == 500
    for value in (None, "wide", float("nan"), float("inf"), 0, -500, 99.9, 4000.5, BytesIO()):
        assert usable_dpi(value) is None


def test_an_image_of_two_resolutions_is_resampled_to_the_higher():
    image = decode_image(saved(GREY, "TIFF", dpi=(500, 357)), "print", polarity="dark")
    height, width = GREY.shape
    assert image.pixels.shape == (round(height * 500 / 357), width)
    assert image.dpi == 500
    (note,) = image.notes
    assert note == "its resolution is 500 dpi across and 357 down: resampled to 500"
    with pytest.raises(ImageError, match=r"print: image of .* is too large"):
        decode_image(
            saved(np.tile(GREY, (8, 1)), "TIFF", dpi=(101, 4000)),
            "print",
            limits=ImageLimits(max_side_px=1000),
        )
