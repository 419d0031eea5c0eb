"""ANSI/NIST-ITL files: each block of minutiae by its own convention, and where frames stand."""

import numpy as np
import pytest

from fpmatch.formats.registry import AN2
from tests.formats.made_records import an2_file, only_view, read

PX = 500 / 2540  # pixels in 0.01 mm at 500 dpi


@pytest.mark.parametrize(
    ("block", "x", "y", "quality"),
    [
        # qualities run from 2, the best, to 63; 0 and 1 are unknown
        ("standard", [1000, 2000, 0], [400 / PX - 500, 400 / PX - 1000, 400 / PX], [100, 100, 0]),
        ("iafis", [1000, 2000, 0], [500, 1000, 0], [100, 100, 0]),
        ("m1", [100 / PX, 200 / PX, 0], [50 / PX, 100 / PX, 0], [90, 80, 100]),
        ("efs", [1100, 2100, 100], [700, 1200, 200], None),
    ],
)
@pytest.mark.parametrize("image", ["13", "4"])  # the type of the record that gives the size
def test_each_block_by_its_own_convention(block, image, x, y, quality):
    record = read(an2_file(block, image))
    assert record.format == "an2"
    (view,) = record.views
    minutiae = view.template.minutiae
    assert np.allclose(minutiae.xy, np.column_stack([x, y]) * PX, atol=0.01)
    assert np.allclose(np.degrees(minutiae.angle), [270, 90, 180], atol=0.01)
    assert minutiae.kind.tolist() == [1, 2, 0]
    assert view.quality_known is (quality is not None)
    assert minutiae.quality.tolist() == (quality or [100, 100, 100])
    assert (view.finger, view.impression) == (7, 1)
    assert (view.template.width, view.template.height, view.template.dpi) == (300, 400, 500)
    assert (view.size_known, view.dpi_known) == (True, True)


def test_without_an_image_record_the_size_is_what_the_minutiae_span():
    view = only_view(an2_file("standard", "none"))
    assert (view.dpi_known, view.size_known) == (True, False)
    assert (view.template.width, view.template.height) == (394, 197 + 1)
    stated = only_view(an2_file("standard", "none"), size=(500, 600)).template
    assert (stated.width, stated.height) == (500, 600)
    assert stated.minutiae.y.max() == 600


def test_without_any_resolution_that_of_the_reader_holds():
    data = an2_file("standard", "none", "00.00")
    assert not only_view(data).dpi_known
    view = only_view(data, dpi=1000)
    assert view.template.dpi == 1000
    assert view.template.minutiae.x.max() == pytest.approx(2000 * 1000 / 2540, abs=0.01)


def test_a_file_of_images_alone_is_no_template():
    assert not AN2.recognises(an2_file().replace(b"\x1e9\x1f01", b""))


@pytest.mark.parametrize(
    ("region", "offset", "size"),
    [
        ("1500\x1f2000\x1f100\x1f200\x1f0,0-1500,0-1500,2000", (100, 200), (315, 433)),
        ("1500\x1f2000\x1f\x1f\x1f0,0-1500,0-1500,2000", (0, 0), (295, 394)),
        ("\x1f\x1f100\x1f200", (100, 200), None),
        ("", (0, 0), None),
    ],
)
def test_the_region_of_the_extended_feature_set(region, offset, size):
    view = only_view(an2_file("efs", "none", region=region))
    expected = (np.array([[1000, 500], [2000, 1000], [0, 0]]) + offset) * PX
    assert np.allclose(view.template.minutiae.xy, expected, atol=0.01)
    assert view.size_known is (size is not None)
    if size:
        assert (view.template.width, view.template.height) == size


def test_minutiae_of_the_extended_feature_set_without_a_direction_or_type():
    minutiae = "1000\x1f500\x1f270\x1e2000\x1f1000\x1f\x1fB\x1e0\x1f0\x1f180\x1f\x1e5\x1f5"
    record = read(an2_file("efs", minutiae=minutiae))
    assert record.views[0].template.minutiae.kind.tolist() == [0, 0]
    assert record.notes == ("2 minutiae without a direction passed over",)
