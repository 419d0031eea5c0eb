"""The same grey values whatever the container; nothing else gets in."""

import os
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, TiffImagePlugin

from fpmatch import verify
from fpmatch.errors import ImageError, ImageReadError, ResolutionError
from fpmatch.image.io.grey import ON_BLACK, ON_WHITE, grey_image
from fpmatch.image.io.read import GreyImage, ImageLimits, read_image

SAMPLE = Path(__file__).resolve().parents[3] / "sample_data" / "101_1.tif"


@pytest.fixture
def grey(rng):
    """Return a picture in which every grey value occurs."""
    return rng.permutation(np.arange(60 * 64) % 256).reshape(64, 60).astype(np.uint8)


def save(path, picture, **options):
    picture.save(path, **options)
    return path


@pytest.mark.parametrize(
    ("name", "options"),
    [
        *((name, {}) for name in ("a.tif", "a.png", "a.bmp", "a.pgm", "a.gif")),
        ("tiff.png", {"format": "TIFF"}),  # found by content, not by name
        *(("a.tif", {"compression": c}) for c in ("tiff_lzw", "tiff_adobe_deflate", "packbits")),
    ],
)
def test_lossless_formats_give_the_pixels_back(tmp_path, grey, name, options):
    path = save(tmp_path / name, Image.fromarray(grey), **options)
    assert np.array_equal(read_image(path).pixels, grey)


def test_files_of_other_depths_and_colours(tmp_path, grey):
    deep, colour = grey.astype(np.uint16) * 257, np.dstack([grey] * 3)
    pictures = {
        **dict.fromkeys(("deep.tif", "deep.png", "deep.pgm"), (Image.fromarray(deep), grey)),
        "big endian.tif": (Image.frombytes("I;16B", (60, 64), deep.astype(">u2")), grey),
        "bilevel.png": (Image.fromarray(grey > 127), (grey > 127) * 255),
        "palette.png": (Image.fromarray(grey).quantize(256), grey),
        **dict.fromkeys(("rgb.png", "rgb.bmp", "rgb.ppm"), (Image.fromarray(colour), grey)),
        "float.tif": (Image.fromarray((grey / 255).astype(np.float32)), grey),
        "int.tif": (Image.fromarray(grey.astype(np.int32)), grey),
    }
    for name, (picture, expected) in pictures.items():
        assert np.array_equal(read_image(save(tmp_path / name, picture)).pixels, expected), name
    tags = TiffImagePlugin.ImageFileDirectory_v2()
    tags[262] = 0  # white is zero
    inverted = save(tmp_path / "inverted.tif", Image.fromarray(deep), tiffinfo=tags)
    with Image.open(inverted) as picture:
        assert picture.tag_v2[262] == 0
    assert np.array_equal(read_image(inverted).pixels, 255 - grey)


def test_bad_paths_are_named_with_their_reason(tmp_path):
    (tmp_path / "empty.tif").touch()
    (tmp_path / "text.tif").write_text("This is not an image.\n")
    os.mkfifo(tmp_path / "pipe.tif")
    reasons = {
        "gone.tif": "no such file",
        ".": "is a folder, not an image",
        "empty.tif": "the file is empty",
        "text.tif": "not an image of a known format",
        "pipe.tif": "is not a regular file, not an image",
    }
    for name, reason in reasons.items():
        path = tmp_path / name
        with pytest.raises(ImageReadError) as caught:
            read_image(path)
        assert str(caught.value) == f"{path}: {reason}"
    with pytest.raises(ImageReadError):
        read_image("nul\0")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_file_without_permission(tmp_path, grey):
    path = save(tmp_path / "print.png", Image.fromarray(grey))
    path.chmod(0)
    with pytest.raises(ImageReadError, match="Permission denied"):
        read_image(path)


@pytest.mark.parametrize(
    ("width", "height", "reason"),
    [
        (47, 300, "image of 47 x 300 pixels is smaller than one ridge neighbourhood"),
        (10_001, 48, "image of 10001 x 48 pixels is too large: a side may have 10000 pixels"),
        (9_000, 9_000, "image of 9000 x 9000 pixels is too large: more than 64 megapixels"),
        (7_000, 7_000, "image of 7000 x 7000 pixels is too large: more than 16 megapixels"),
        (20_000, 20_000, "image is too large: more than 64 megapixels"),
    ],
)
def test_sizes_beyond_the_limits(tmp_path, width, height, reason):
    path = tmp_path / "print.pgm"
    path.write_bytes(b"P5 %d %d 255\n" % (width, height))
    with pytest.raises(ImageError) as caught:
        read_image(path)
    assert str(caught.value).startswith(f"{path}: {reason}")


def test_limits_can_be_set(tmp_path, grey):
    assert grey_image(grey[:10, :10], limits=ImageLimits(min_side_px=10)).pixels.shape == (10, 10)
    with pytest.raises(ImageError, match="63 pixels"):
        grey_image(grey, limits=ImageLimits(max_side_px=63))
    path = tmp_path / "print.pgm"
    path.write_bytes(b"P5 60 72 255 " + bytes(2_000_000))
    with pytest.raises(ImageReadError, match=r"1\.5 MB"):
        read_image(path, limits=ImageLimits(max_file_megabytes=1.5))
    assert read_image(path).pixels.shape == (72, 60)


def test_formats_that_start_other_programs_stay_shut(tmp_path, grey):
    path = save(tmp_path / "print.eps", Image.fromarray(grey))
    with pytest.raises(ImageReadError, match="known format"):
        read_image(path)


def test_arrays_of_every_type_mean_the_same(grey):
    deep = grey.astype(np.uint16) * 257
    same = {
        "uint8": grey,
        "uint16": deep,
        "big-endian": deep.astype(">u2"),
        "wide ints of 8 bits": grey.astype(np.int64),
        "wide ints of 16 bits": deep.astype(np.int64),
        "floats to 1": grey / 255,
        "halves to 1": (grey / 255).astype(np.float16),
        "floats to 255": grey.astype(np.float32),
        "rgb": np.dstack([grey] * 3),
        "rgba": np.dstack([grey, grey, grey, np.full_like(grey, 255)]),
        "one channel": grey[..., None],
        "deep rgb": np.dstack([deep] * 3),
        "lists": grey.tolist(),
        "Fortran order": np.asfortranarray(grey),
        "a view": np.repeat(grey, 2, axis=1)[:, ::2],
    }
    for name, array in same.items():
        result = grey_image(array).pixels
        assert result.flags.c_contiguous, name
        assert result.dtype == np.uint8, name
        assert np.array_equal(result, grey), name


def test_booleans_are_black_and_white_and_colours_count_by_brightness_over_white(grey):
    assert np.array_equal(grey_image(np.eye(50, dtype=bool)).pixels, 255 * np.eye(50))
    red_half = np.zeros((50, 50, 4), np.uint8)
    red_half[..., 0], red_half[..., 3] = 255, 128
    assert grey_image(red_half[..., :3]).pixels[0, 0] == 76  # 0.299 * 255
    assert grey_image(red_half).pixels[0, 0] == round(76 * 128 / 255 + 127)
    grey.setflags(write=False)
    assert grey_image(grey).pixels is grey


@pytest.mark.parametrize(
    ("array", "reason"),
    [
        (np.full((50, 50), np.nan), "NaN or infinite"),
        (np.full((50, 50), np.inf), "NaN or infinite"),
        (np.full((50, 50), -1), "outside 0 to 255"),
        (np.full((50, 50), 70_000), "outside 0 to 65535"),
        (np.full((50, 50), 256.0), "outside 0 to 255"),
        (np.full((50, 50), 1j), "must hold numbers, not complex128"),
        (np.full((50, 50), "a"), "must hold numbers, not <U1"),
        (np.full((50, 50), None), "must hold numbers, not object"),
        (np.zeros(2500), r"not \(2500,\)"),
        (np.zeros((50, 50, 2)), r"not \(50, 50, 2\)"),
        (np.zeros((50, 50, 3, 1)), r"not \(50, 50, 3, 1\)"),
        (np.zeros((0, 50)), "smaller than one ridge neighbourhood"),
        ([[1, 2], [3]], "must be an array of numbers"),
        (None, r"not \(\)"),
    ],
    ids=str,
)
def test_arrays_that_are_no_images(array, reason):
    with pytest.raises(ImageError, match=reason):
        grey_image(array)


def test_a_grey_image_checks_itself(grey):
    assert GreyImage(grey, 500).dpi == 500.0
    with pytest.raises(ResolutionError, match="outside the usable range"):
        GreyImage(grey, 72)
    with pytest.raises(ImageError, match="two-dimensional array of uint8"):
        GreyImage(grey.astype(float))
    with pytest.raises(ImageError, match="must have pixels"):
        GreyImage(grey[:0])


@pytest.mark.parametrize("bits", [10, 12])
def test_samples_that_use_few_of_16_bits_are_stretched_and_it_is_said(tmp_path, bits):
    shallow = read_image(SAMPLE).pixels
    deep = shallow.astype(np.uint16) << (bits - 8)
    expected = deep - np.quantile(deep, 0.001)
    expected = np.clip(255 * expected / np.quantile(expected, 0.999), 0, 255)
    Image.fromarray(deep).save(tmp_path / "deep.png")
    Image.fromarray(deep).save(tmp_path / "deep.tif")
    height, width = deep.shape
    header = f"P5 {width} {height} 65535\n".encode()
    (tmp_path / "deep.pgm").write_bytes(header + deep.astype(">u2").tobytes())
    read = [read_image(tmp_path / f"deep.{end}", polarity="dark") for end in ("png", "tif", "pgm")]
    read += [
        grey_image(one)
        for one in (deep, deep.astype(np.int32), deep.astype(np.float32) - 5000, deep / 65535.0)
    ]
    for image in read:
        assert np.abs(image.pixels - expected).max() < 3
        (note,) = image.notes
        assert re.search("its samples run from .* is scaled to black to white", note)
    for picture in (Image.fromarray(deep), Image.fromarray(deep.astype(np.int32))):
        assert verify(picture, SAMPLE, dpi=500).score > 80
    assert grey_image(shallow.astype(np.uint16) * 257).notes == ()


def test_8_bits_in_a_container_of_16_are_8_bits(tmp_path):
    shallow = read_image(SAMPLE).pixels
    for image in (grey_image(shallow.astype(np.uint16)), grey_image(shallow.astype(">u2"))):
        assert np.array_equal(image.pixels, shallow)
        assert "8 of their 16 bits" in image.notes[0]
    assert grey_image(shallow.astype(np.int64)).notes == ()


@pytest.mark.parametrize("scale", [1e-9, 1e-3, 1.0, 1e5, 1e30])
@pytest.mark.parametrize("offset", [-0.7, 0.0, 3.0])
def test_floats_of_any_range_are_read(scale, offset):
    shallow = read_image(SAMPLE).pixels
    found = grey_image((shallow / 255.0 + offset) * scale).pixels
    assert np.corrcoef(found.ravel(), shallow.ravel())[0, 1] > 0.999
    assert found.max() - found.min() > 200


def test_transparency_goes_over_the_ground_of_more_contrast():
    shallow = read_image(SAMPLE).pixels
    same, faint = np.dstack([shallow] * 4), np.dstack([shallow] * 3 + [np.full_like(shallow, 20)])
    brightness = np.dstack([np.full_like(shallow, 255)] * 3 + [shallow])
    ink = np.dstack([np.zeros_like(shallow)] * 3 + [255 - shallow])
    for picture, note in (
        (same, ON_BLACK),
        (brightness, ON_BLACK),
        (ink, ON_WHITE),
        (faint, ON_WHITE),
    ):
        image = grey_image(picture)
        assert image.notes == (note,)
        assert verify(picture, SAMPLE, dpi=500).score > 80
