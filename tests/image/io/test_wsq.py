"""What NIST's decoder makes of a file; damaged ones are refused in words."""

import numpy as np
import pytest
from PIL import Image

from fpmatch.errors import ImageError, ImageReadError
from fpmatch.formats.agency.wsq import decode_wsq
from fpmatch.image.io.grey import DEFAULT_LIMITS, ImageLimits
from tests.image.made_files import DATA, wsq

START, END, FRAME, BLOCK = b"\xff\xa0", b"\xff\xa1", b"\xff\xa2", b"\xff\xa3"


@pytest.mark.parametrize("name", ["rings_131x99", "rings_53x61"])
def test_pixels_are_those_of_nists_own_decoder(name):
    picture = decode_wsq(wsq(name), DEFAULT_LIMITS)
    expected = np.asarray(Image.open(DATA / f"{name}.png")).astype(int)
    assert picture.pixels.shape == expected.shape
    assert np.abs(picture.pixels - expected).max() <= 1
    assert (picture.dpi, picture.format, picture.notes) == (500.0, "WSQ", ())


@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\0", b"  \n", b" \t\r\n", b""])
def test_the_lines_of_the_comment_may_end_in_other_ways(end):
    comment = b"NIST_COM 2" + (end or b"\n") + b"PPI 569" + end
    segment = b"\xff\xa8" + (2 + len(comment)).to_bytes(2, "big") + comment
    assert decode_wsq(START + segment + wsq()[2:], DEFAULT_LIMITS).dpi == 569
    assert decode_wsq(wsq().replace(b"PPI 500", b"PPI -10"), DEFAULT_LIMITS).dpi is None


def test_the_size_is_checked_before_anything_is_decoded():
    frame = wsq().index(FRAME)
    huge = bytearray(wsq())
    huge[frame + 6 : frame + 10] = (9_000).to_bytes(2, "big") * 2
    with pytest.raises(ImageError, match="more than 16 megapixels"):
        decode_wsq(bytes(huge), DEFAULT_LIMITS)
    with pytest.raises(ImageError, match="53 x 61"):
        decode_wsq(wsq(), ImageLimits(min_side_px=54))


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "cut short"),
        (START + END, "frame, filters or quantisers are missing"),
        (wsq()[:-2], "cut short"),
        (wsq().replace(b"\xff\xa6", b"\xff\xa8"), "coefficients before their tables"),
        (wsq()[: wsq().index(BLOCK)] + END, "coefficients are missing"),
        (wsq()[:-2] + wsq()[wsq().rindex(BLOCK) :], "too many coefficients"),
        (wsq()[:-2] + b"\xff\x10\x00\x02" + END, "a marker is missing"),
        (wsq().replace(b"\xff\xa4\x00:\t\x07", b"\xff\xa4\x00:\t\x08"), "filters of even length"),
        (wsq().replace(b"\x00\t2\xd3", b"\x00\x002\xd3"), "a filter amplifies"),
    ],
)
def test_damage_is_named(data, reason):
    with pytest.raises(ImageReadError, match=reason):
        decode_wsq(data, DEFAULT_LIMITS)
