"""The same grey values whatever the container; what is no image is refused in one line."""

import os
import re
import struct
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image, TiffImagePlugin

from fpmatch import verify
from fpmatch.errors import FpmatchError, ImageError, ImageReadError, ResolutionError
from fpmatch.image.io.grey import ALL_TRANSPARENT, ON_BLACK, ON_WHITE, grey_image
from fpmatch.image.io.pillow_formats import FIRST_OF_SEVERAL, MAX_JPEG_SCANS
from fpmatch.image.io.read import READERS, GreyImage, ImageLimits, RawSize, read_image, sniff
from fpmatch.image.quality.polarity import INVERTED
from tests.image.made_files import decoded, lossless_jpeg, one_of_each, rings, saved

SAMPLE = Path(__file__).resolve().parents[3] / "sample_data" / "101_1.tif"
FILES = one_of_each()
GREY = rings()
DEEP = GREY.astype(np.uint16) * 257


def test_every_reader_reads_its_formats():
    for name, data in FILES.items():
        picture = decoded(data)
        assert min(picture.pixels.shape) >= 48, name
        assert picture.pixels.std() > 10, name
        assert picture.format, name
    used = {sniff(data).name for data in FILES.values()}
    assert used == {reader.name for reader in READERS}


@pytest.mark.parametrize("name", FILES)
@given(data=st.data())
def test_any_bytes_are_an_image_or_a_typed_error_of_one_line(name, data):
    broken = bytearray(FILES[name])
    for _ in range(data.draw(st.integers(0, 4))):
        # the header decides most: aim there half the time
        at = data.draw(st.integers(0, min(len(broken), 64)) | st.integers(0, len(broken)))
        broken[at : at + data.draw(st.integers(0, 8))] = data.draw(st.binary(max_size=8))
    end = data.draw(st.integers(0, len(broken)) | st.none())
    words = ""
    try:
        pixels = decoded(bytes(broken[:end])).pixels
        assert (pixels.dtype, pixels.ndim) == (np.uint8, 2)
    except FpmatchError as error:
        words = str(error)
    assert "\n" not in words


@given(
    st.sampled_from([np.uint8, np.uint16, np.int32, np.float64, np.bool_, np.complex64]).flatmap(
        lambda kind: arrays(kind, st.sampled_from([(48, 50), (48, 50, 3), (50, 48, 4), (9, 60)]))
    )
)
def test_any_array_is_an_image_or_a_typed_error_of_one_line(array):
    words = ""
    try:
        pixels = grey_image(array).pixels
        assert (pixels.dtype, pixels.shape) == (np.uint8, array.shape[:2])
        assert pixels.flags.c_contiguous
    except ImageError as error:
        words = str(error)
    assert "\n" not in words


def test_a_value_far_beyond_all_others_is_white():
    array = np.zeros((50, 50))
    array[::2], array[0, 0] = 5e-324, 1e300
    assert (grey_image(array).pixels == np.where(array, 255, 0)).all()


@pytest.mark.parametrize("share", [0.05, 0.3, 0.5, 0.7, 0.95])
@pytest.mark.parametrize("name", FILES)
def test_a_truncated_file_is_never_read_in_silence(name, share):
    part = FILES[name][: int(share * len(FILES[name]))]
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        with pytest.raises(ImageReadError, match="damaged" if share == 0.5 else None):
            decoded(part)
    assert not heard


def test_lossless_files_of_every_depth_and_colour_give_the_pixels_back(tmp_path):
    tags = TiffImagePlugin.ImageFileDirectory_v2()
    tags[262] = 0  # white is zero
    grey, deep = Image.fromarray(GREY), Image.fromarray(DEEP)
    colour = Image.fromarray(np.dstack([GREY] * 3))
    files = [
        *((grey, name, {}, GREY) for name in ("a.tif", "a.png", "a.bmp", "a.pgm", "a.gif")),
        *((grey, "a.tif", {"compression": c}, GREY) for c in ("tiff_lzw", "packbits")),
        (grey, "tiff.png", {"format": "TIFF"}, GREY),  # found by content, not by name
        *((deep, name, {}, GREY) for name in ("deep.tif", "deep.png", "deep.pgm")),
        (Image.frombytes("I;16B", (60, 72), DEEP.astype(">u2")), "big endian.tif", {}, GREY),
        (deep, "white is zero.tif", {"tiffinfo": tags}, 255 - GREY),
        (Image.fromarray(GREY > 127), "bilevel.png", {}, (GREY > 127) * 255),
        (Image.fromarray(GREY).quantize(256), "palette.png", {}, GREY),
        *((colour, name, {}, GREY) for name in ("rgb.png", "rgb.bmp", "rgb.ppm")),
        (Image.fromarray((GREY / 255).astype(np.float32)), "float.tif", {}, GREY),
        (Image.fromarray(GREY.astype(np.int32)), "int.tif", {}, GREY),
    ]
    for picture, name, options, expected in files:
        picture.save(tmp_path / name, **options)
        found = read_image(tmp_path / name, polarity="dark").pixels
        assert np.array_equal(found, expected), name


def test_arrays_of_every_type_mean_the_same():
    same = {
        "uint8": GREY,
        "big-endian": DEEP.astype(">u2"),
        "wide ints of 8 bits": GREY.astype(np.int64),
        "wide ints of 16 bits": DEEP.astype(np.int64),
        "floats to 1": GREY / 255,
        "halves to 1": (GREY / 255).astype(np.float16),
        "floats to 255": GREY.astype(np.float32),
        "rgba": np.dstack([GREY, GREY, GREY, np.full_like(GREY, 255)]),
        "one channel": GREY[..., None],
        "deep rgb": np.dstack([DEEP] * 3),
        "lists": GREY.tolist(),
        "Fortran order": np.asfortranarray(GREY),
    }
    for name, array in same.items():
        assert np.array_equal(grey_image(array).pixels, GREY), name
    assert np.array_equal(grey_image(np.eye(50, dtype=bool)).pixels, 255 * np.eye(50))
    red_half = np.zeros((50, 50, 4), np.uint8)
    red_half[..., 0], red_half[..., 3] = 255, 128
    assert grey_image(red_half[..., :3]).pixels[0, 0] == 76  # 0.299 * 255
    assert grey_image(red_half).pixels[0, 0] == round(76 * 128 / 255 + 127)
    fixed = GREY.copy()
    fixed.setflags(write=False)
    assert grey_image(fixed).pixels is fixed


@pytest.mark.parametrize(
    ("array", "reason"),
    [
        (np.full((50, 50), np.nan), "NaN or infinite"),
        (np.full((50, 50), -1), "outside 0 to 255"),
        (np.full((50, 50), 70_000), "outside 0 to 65535"),
        (np.full((50, 50, 4), 300.0) * np.arange(4) * 1e3, "outside 0 to 255"),
        (np.full((50, 50), 1j), "must hold numbers, not complex128"),
        (np.full((50, 50), None), "must hold numbers, not object"),
        (np.zeros((50, 50, 2)), r"not \(50, 50, 2\)"),
        (np.zeros((0, 50)), "smaller than one ridge neighbourhood"),
        ([[1, 2], [3]], "must be an array of numbers"),
        (None, r"not \(\)"),
    ],
    ids=str,
)
def test_arrays_that_are_no_images(array, reason):
    with pytest.raises(ImageError, match=reason):
        grey_image(array)


def test_a_grey_image_checks_itself():
    assert GreyImage(GREY, 500).dpi == 500.0
    with pytest.raises(ResolutionError, match="outside the usable range"):
        GreyImage(GREY, 72)
    with pytest.raises(ImageError, match="two-dimensional array of uint8"):
        GreyImage(GREY.astype(float))
    with pytest.raises(ImageError, match="must have pixels"):
        GreyImage(GREY[:0])


def test_samples_that_use_few_of_16_bits_are_stretched_and_it_is_said(tmp_path):
    shallow = read_image(SAMPLE).pixels
    deep = shallow.astype(np.uint16) << 2
    expected = deep - np.quantile(deep, 0.001)
    expected = np.clip(255 * expected / np.quantile(expected, 0.999), 0, 255)
    Image.fromarray(deep).save(tmp_path / "deep.png")
    read = [read_image(tmp_path / "deep.png", polarity="dark")]
    read += [grey_image(one) for one in (deep, deep.astype(np.int32), deep / 65535.0)]
    read += [grey_image(deep * scale - 5000.0 * scale) for scale in (1e-9, 1.0, 1e30)]
    for image in read:
        assert np.abs(image.pixels - expected).max() < 3
        (note,) = image.notes
        assert re.search("its samples run from .* is scaled to black to white", note)
    assert verify(Image.fromarray(deep), SAMPLE, dpi=500).score > 80
    assert grey_image(DEEP).notes == ()
    in_16 = grey_image(GREY.astype(np.uint16))
    assert np.array_equal(in_16.pixels, GREY)
    assert "8 of their 16 bits" in in_16.notes[0]


def bare_tiff(bits, samples):
    """Return a TIFF of the size of `GREY` whose samples are these bytes."""
    height, width = GREY.shape
    tags = [(256, 4, width), (257, 4, height), (258, 3, bits), (259, 3, 1), (262, 3, 1)]
    tags += [(273, 4, 8 + 2 + 9 * 12 + 4), (277, 3, 1), (278, 4, height), (279, 4, len(samples))]
    entries = [struct.pack("<HHLL", number, kind, 1, value) for number, kind, value in tags]
    return struct.pack("<2sHLH", b"II", 42, 8, 9) + b"".join(entries) + bytes(4) + samples


@pytest.mark.parametrize("bits", [2, 4, 12])
def test_tiffs_of_odd_depths(bits):
    largest = 2**bits - 1
    values = GREY.astype(np.uint16) * np.uint32(largest) // 255
    places = np.arange(bits - 1, -1, -1)
    packed = np.packbits((values[..., None] >> places & 1).reshape(len(GREY), -1), axis=1)
    image = decoded(bare_tiff(bits, packed.tobytes()))
    correlation = np.corrcoef(image.pixels.ravel(), values.ravel())[0, 1]
    assert correlation > 0.999  # 12 bits are stretched to the range that is used
    assert bool(image.notes) == (bits == 12)


def test_transparency_is_composed_over_the_ground_of_more_contrast(tmp_path):
    half = np.where(np.arange(60) < 30, 255, 0) * np.ones((72, 1))
    black, white = np.zeros((72, 60, 3)), np.full((72, 60, 3), 255)
    opaque, nothing = np.full((72, 60), 255), np.zeros((72, 60))
    ridges = np.dstack([GREY] * 3)
    path = tmp_path / "print.png"
    for colours, alpha, expected, notes in (
        (ridges, half, np.where(half, GREY, 255), (ON_WHITE,)),
        (ridges, opaque, GREY, ()),
        (ridges, nothing, GREY, (ALL_TRANSPARENT,)),
        (black, GREY, 255 - GREY, (ON_WHITE,)),
        (white, GREY, GREY, (ON_BLACK,)),
    ):
        rgba = Image.fromarray(np.dstack([colours, alpha]).astype(np.uint8))
        for picture in (rgba, rgba.convert("LA")):
            picture.save(path)
            image = read_image(path)
            assert np.array_equal(image.pixels, expected)
            assert image.notes == notes
    Image.fromarray(GREY).save(path, transparency=int(GREY[0, 0]))
    assert np.array_equal(read_image(path).pixels, np.where(GREY[0, 0] == GREY, 255, GREY))
    shallow = read_image(SAMPLE).pixels
    for picture in (np.dstack([shallow] * 4), np.dstack([shallow] * 3 + [0 * shallow + 20])):
        assert verify(picture, SAMPLE, dpi=500).score > 80


@pytest.mark.parametrize("kind", ["TIFF", "GIF", "PNG", "WEBP"])
def test_that_others_are_left_is_said(tmp_path, kind):
    path = tmp_path / "several"
    pictures = [Image.fromarray(rings(64, 80) // (k + 1)) for k in range(3)]
    pictures[0].save(path, kind, save_all=True, append_images=pictures[1:], lossless=True)
    assert FIRST_OF_SEVERAL in read_image(path).notes
    assert np.ptp(read_image(path).pixels) > 150
    pictures[0].save(path, kind)
    assert FIRST_OF_SEVERAL not in read_image(path).notes


def test_white_ridges_are_turned_and_that_is_said(tmp_path, pressed):
    path = tmp_path / "negative.png"
    Image.fromarray(255 - pressed[0]).save(path)
    for polarity, turned in (("auto", True), ("white", True), ("dark", False)):
        image = read_image(path, polarity=polarity)
        assert np.array_equal(image.pixels, pressed[0] if turned else 255 - pressed[0])
        assert image.notes == (INVERTED,) * turned
    with pytest.raises(ImageError, match=r"no polarity 'black'.*auto, dark, white"):
        read_image(path, polarity="black")


@pytest.mark.parametrize("bits", [1, 2, 4, 8])
def test_bare_pixels_have_their_first_in_the_high_bits(tmp_path, bits):
    levels = GREY >> (8 - bits)
    digits = "".join(f"{value:0{bits}b}" for value in levels.ravel().tolist())
    path = tmp_path / "packed.raw"
    path.write_bytes(int(digits, 2).to_bytes(len(digits) // 8, "big"))
    image = read_image(path, raw_sizes=[RawSize(300, 300), RawSize.parse(" 60x72 ")])
    assert np.array_equal(image.pixels, levels * (255 // (2**bits - 1)))
    packed = f"its {4320 * bits // 8} bytes were read as {bits} bits a pixel"
    assert (image.dpi, image.format, image.notes) == (None, "raw", (packed,) * (bits < 8))


@pytest.mark.parametrize(
    "text", ["", "60", "60x", "0x72", "60x72x3", "-60x72", "6e1x72", "60x72,turned"]
)
def test_raw_sizes_are_two_numbers(text):
    with pytest.raises(ImageError, match="WIDTHxHEIGHT"):
        RawSize.parse(text)
    with pytest.raises(ImageError, match="must be positive"):
        RawSize(0, 5)


@pytest.mark.parametrize("number", [0, 1, 3])
@pytest.mark.parametrize("table_class", [0, 1])
def test_a_lossless_jpeg_with_tables_of_either_class(table_class, number):
    image = decoded(lossless_jpeg(GREY, table_class, number))
    assert np.array_equal(image.pixels, GREY)
    assert image.dpi == 500


def tiff_of(order, *entries):
    """Return a TIFF of tags alone, each a number, type, count and value."""
    head = (b"II" if order == "<" else b"MM") + struct.pack(order + "HLH", 42, 8, len(entries))
    return head + b"".join(struct.pack(order + "HHLL", *entry) for entry in entries)


SCANS = saved(GREY, "JPEG", progressive=True)
MANY_SCANS = SCANS[:-2] + SCANS[SCANS.rindex(b"\xff\xda") : -2] * MAX_JPEG_SCANS + SCANS[-2:]
ODD_TIFF = saved(GREY, "TIFF").replace(
    b"\x03\x01\x03\x00\x01\x00\x00\x00\x01", b"\x03\x01\x03\x00\x01\x00\x00\x00\x63"
)
UNKNOWN = "not an image of a known format"
BAD = {
    "gone": (None, "no such file"),
    "empty": (b"", "the file is empty"),
    "text": (b"This is not an image.\n", UNKNOWN),
    "pdf": (b"%PDF-1.7" + bytes(5000), f"{UNKNOWN} (a PDF document)"),
    "fmr": (b"FMR\x00 20\x00" + bytes(99), f"{UNKNOWN} (a minutiae template, ISO/IEC 19794-2 or"),
    "fir": (b"FIR\x00020\x00" + bytes(99), f"{UNKNOWN} (a finger image record, ISO/IEC 19794-4"),
    "ihead": (b"288\x00" + bytes(5000), f"{UNKNOWN} (an IHead image of NIST)"),
    "dicom": (bytes(128) + b"DICM" + bytes(99), f"{UNKNOWN} (a DICOM file)"),
    "heic": (b"\x00\x00\x00\x1cftypheic" + bytes(99), f"{UNKNOWN} (a HEIC image)"),
    "big tiff": (saved(GREY, "TIFF", big_tiff=True), f"{UNKNOWN} (a BigTIFF image)"),
    "eps": (b"%!PS-Adobe-3.0 EPSF-3.0\n", UNKNOWN),  # would start another program
    "card": (bytes(range(128, 248)), UNKNOWN),  # a template of five bytes a minutia: no hint
    "frame": (GREY.tobytes(), f"{UNKNOWN}; if its 4320 bytes are pixels: --raw WIDTHxHEIGHT"),
    "jpeg": (MANY_SCANS, "JPEG image of more than 100 scans"),
    "kind of tiff": (ODD_TIFF, "damaged TIFF image ("),
    "strips": (tiff_of("<", (273, 4, 300_001, 8)), "TIFF image with 300001 numbers in tag 273"),
    "motorola": (tiff_of(">", (273, 4, 300_001, 8)), "TIFF image with 300001 numbers in tag 273"),
    "overlap": (tiff_of("<", *[(700, 1, 99, 8)] * 9), "damaged TIFF image (its tags overlap)"),
    "narrow.pgm": (b"P5 47 300 255\n", "image of 47 x 300 pixels is smaller than one ridge"),
    "long.pgm": (b"P5 10001 48 255\n", "image of 10001 x 48 pixels is too large: a side may"),
    "large.pgm": (b"P5 9000 9000 255\n", "image of 9000 x 9000 pixels is too large: more than"),
    "bomb.pgm": (b"P5 20000 20000 255\n", "image is too large: more than 64 megapixels"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files_are_refused_in_one_line_that_names_them(tmp_path, name):
    data, reason = BAD[name]
    path = tmp_path / name
    if data is not None:
        path.write_bytes(data)
    with pytest.raises(FpmatchError) as caught:
        read_image(path)
    assert str(caught.value).startswith(f"{path}: {reason}")
    assert ("--raw" in str(caught.value)) == ("--raw" in reason)


def test_bad_paths_and_raw_sizes_are_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    frame = tmp_path / "frame"
    frame.write_bytes(GREY.tobytes())
    for given_path, sizes, reason in (
        (tmp_path, [], "is a folder, not an image"),
        (tmp_path / "pipe", [], "is not a regular file, not an image"),
        ("nul\0", [], "nul"),
        (frame, [RawSize(300, 300)], r"4320 bytes are no raw 300x300 \(90000\)"),
        (frame, [RawSize(4320, 1)], "4320 x 1"),
    ):
        with pytest.raises(FpmatchError, match=reason):
            read_image(given_path, raw_sizes=sizes)
    frame.chmod(0)
    if os.geteuid() != 0:  # root may read everything
        with pytest.raises(ImageReadError, match="Permission denied"):
            read_image(frame)


def test_limits_can_be_set(tmp_path):
    assert grey_image(GREY[:10, :10], limits=ImageLimits(min_side_px=10)).pixels.shape == (10, 10)
    path = tmp_path / "print.pgm"
    path.write_bytes(b"P5 60 72 255 " + bytes(2_000_000))
    with pytest.raises(ImageReadError, match=r"1\.5 MB"):
        read_image(path, limits=ImageLimits(max_file_megabytes=1.5))
    assert read_image(path).pixels.shape == (72, 60)
