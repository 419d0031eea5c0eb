"""Image files that other software made: size, resolution and format of each, where they lie."""

from pathlib import Path

import pytest

from fpmatch.image.io.grey import RawSize
from fpmatch.image.io.read import read_image

FORMATS = Path(__file__).parents[3] / "shared" / "formats"
RAW = [RawSize(332, 533)]
GOOD = {
    "an2/nistref_type-14-tip-eji-wsq.an2": (344, 370, 500, "ANSI/NIST type 14, WSQ"),
    "an2/nistref_type-9-13-m1.an2": (800, 768, 500, "ANSI/NIST type 13"),
    "an2/nistref_type-9-4-iafis.an2": (800, 768, 500, "ANSI/NIST type 4"),
    "bmp/nbis_sivv_card0001_01.bmp": (1090, 995, 1000, "BMP"),
    "bmp_rgba/1__M_Left_index_finger.BMP": (96, 103, None, "BMP"),
    "gif/jnbis_sample.gif": (545, 622, None, "GIF"),
    "jp2/libbiomeval_img.jp2": (908, 1007, 1000, "JPEG2000"),
    "jpeg/sourceafis_probe.jpeg": (388, 374, None, "JPEG"),
    "pgm/fingerjet_a001_03p.pgm": (364, 536, None, "PPM"),
    "png/sourceafis_probe.png": (388, 374, None, "PNG"),
    "raw8/sourceafis_gray-probe.dat": (332, 533, None, "raw"),
    "tif/palette_crop_102_1.TIF": (382, 300, None, "TIFF"),
    "tif_palette/crossmatch_0123_1.tif": (504, 480, 500, "TIFF"),
    "wsq/libbiomeval_img.wsq": (256, 256, 500, "WSQ"),
    "wsq/sourceafis_wsq-original.wsq": (832, 768, 500, "WSQ"),
}
pytestmark = pytest.mark.skipif(not FORMATS.is_dir(), reason="the files are not here")


@pytest.mark.parametrize("name", GOOD)
def test_size_resolution_and_format(name):
    image = read_image(FORMATS / name, raw_sizes=RAW if name.startswith("raw8") else ())
    height, width = image.pixels.shape
    assert (width, height, image.dpi, image.format) == GOOD[name]
    assert image.pixels.std() > 20
