"""Every image format: what is read of it, and the one-line errors for damage."""

import struct
import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from fpmatch.errors import FpmatchError, ImageError, ImageReadError
from fpmatch.formats.agency.wsq import decode_wsq
from fpmatch.image.io.grey import ALL_TRANSPARENT, DEFAULT_LIMITS, ON_BLACK, ON_WHITE, RawSize
from fpmatch.image.io.pillow_formats import FIRST_OF_SEVERAL, MAX_JPEG_SCANS, MAX_PNM_TEXT
from fpmatch.image.io.read import read_image
from fpmatch.image.io.registry import READERS, sniff
from fpmatch.image.quality.polarity import INVERTED
from tests.image.made_files import (
    damaged,
    decoded,
    ihead,
    lossless_jpeg,
    one_of_each,
    rings,
    saved,
    wsq,
)

FILES = one_of_each()
GREY = rings()


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
def test_damage_raises_in_words_and_does_nothing_else(name, data):
    broken = data.draw(damaged(FILES[name]))
    words = ""
    try:
        pixels = decoded(broken).pixels
        assert (pixels.dtype, pixels.ndim) == (np.uint8, 2)
    except FpmatchError as error:
        words = str(error)
    assert "\n" not in words


def bare_tiff(bits, samples):
    """Return a TIFF of the size of `GREY` whose samples are these bytes."""
    height, width = GREY.shape
    tags = [(256, 4, width), (257, 4, height), (258, 3, bits), (259, 3, 1), (262, 3, 1)]
    tags += [(273, 4, 8 + 2 + 9 * 12 + 4), (277, 3, 1), (278, 4, height), (279, 4, len(samples))]
    directory = len(tags).to_bytes(2, "little")
    for number, kind, value in tags:
        directory += number.to_bytes(2, "little") + kind.to_bytes(2, "little")
        directory += (1).to_bytes(4, "little") + value.to_bytes(4, "little")
    return b"II*\x00" + (8).to_bytes(4, "little") + directory + bytes(4) + samples


@pytest.mark.parametrize("share", [0.05, 0.3, 0.5, 0.7, 0.95])
@pytest.mark.parametrize("name", FILES)
def test_a_truncated_file_is_never_read_in_silence(name, share):
    part = FILES[name][: int(share * len(FILES[name]))]
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        with pytest.raises(ImageReadError, match="damaged" if share == 0.5 else None):
            decoded(part)
    assert not heard


@pytest.mark.parametrize("bits", [2, 4, 12])
def test_tiffs_of_odd_depths(bits):
    largest = 2**bits - 1
    values = GREY.astype(np.uint16) * np.uint32(largest) // 255
    places = np.arange(bits - 1, -1, -1)
    packed = np.packbits((values[..., None] >> places & 1).reshape(len(GREY), -1), axis=1)
    expected = np.rint(values * (255 / largest))
    assert np.abs(decoded(bare_tiff(bits, packed.tobytes())).pixels - expected).max() <= 1


def test_tiffs_of_32_bits_and_of_a_kind_that_nobody_reads():
    wide = GREY.astype("<u4")
    for samples in (wide, wide * 257, wide * 0x01010101):
        assert np.array_equal(decoded(bare_tiff(32, samples.tobytes())).pixels, GREY)
    compression = b"\x03\x01\x03\x00\x01\x00\x00\x00"
    data = saved(GREY, "TIFF").replace(compression + b"\x01", compression + b"\x63")
    with pytest.raises(ImageReadError, match="compression 99"):
        decoded(data)


@pytest.mark.parametrize(
    ("start", "kind"),
    [
        (b"%PDF-1.7", "a PDF document"),
        (b"FMR\x00 20\x00", "a minutiae template"),
        (b"FIR\x00020\x00", "a finger image record"),
        (bytes(128) + b"DICM", "a DICOM file"),
        (b"\x00\x00\x00\x1cftypheic", "a HEIC image"),
    ],
)
def test_what_is_no_image_is_named(start, kind):
    with pytest.raises(ImageReadError, match=rf"known format \({kind}"):
        decoded(start + bytes(100))


def test_transparency_is_said(tmp_path):
    half = np.where(np.arange(60) < 30, 255, 0) * np.ones((72, 1))
    black, white = np.zeros((72, 60, 3)), np.full((72, 60, 3), 255)
    opaque, nothing = np.full((72, 60), 255), np.zeros((72, 60))
    ridges = np.dstack([GREY] * 3)
    for colours, alpha, expected, notes in (
        (ridges, half, np.where(half, GREY, 255), (ON_WHITE,)),
        (ridges, opaque, GREY, ()),
        (ridges, nothing, GREY, (ALL_TRANSPARENT,)),
        (black, GREY, 255 - GREY, (ON_WHITE,)),
        (white, GREY, GREY, (ON_BLACK,)),
    ):
        path = tmp_path / "print.png"
        rgba = Image.fromarray(np.dstack([colours, alpha]).astype(np.uint8))
        for picture in (rgba, rgba.convert("LA")):
            picture.save(path)
            image = read_image(path)
            assert np.array_equal(image.pixels, expected)
            assert image.notes == notes
    Image.fromarray(GREY).save(path, transparency=int(GREY[0, 0]))
    keyed = np.where(GREY[0, 0] == GREY, 255, GREY)
    assert np.array_equal(read_image(path).pixels, keyed)


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
    print_ = pressed[0]
    path = tmp_path / "negative.png"
    Image.fromarray(255 - print_).save(path)
    image = read_image(path)
    assert np.array_equal(image.pixels, print_)
    assert image.notes == (INVERTED,)
    assert image.format == "PNG"
    as_it_is = read_image(path, polarity="dark")
    assert np.array_equal(as_it_is.pixels, 255 - print_)
    assert as_it_is.notes == ()
    asked = read_image(path, polarity="white")
    assert np.array_equal(asked.pixels, print_)
    assert asked.notes == (INVERTED,)
    with pytest.raises(ImageError, match="no polarity 'black'"):
        read_image(path, polarity="black")


def test_bare_pixels(tmp_path):
    path = tmp_path / "print.raw"
    path.write_bytes(GREY.tobytes())
    sizes = [RawSize(300, 300), RawSize.parse(" 60x72 ")]
    image = read_image(path, raw_sizes=sizes)
    assert np.array_equal(image.pixels, GREY)
    assert (image.dpi, image.format) == (None, "raw")
    with pytest.raises(ImageReadError, match=r"known format; if its 4320 bytes are pixels"):
        read_image(path)
    with pytest.raises(ImageReadError, match=r"4320 .*300x300 \(90000\)"):
        read_image(path, raw_sizes=sizes[:1])
    with pytest.raises(ImageError, match="4320 x 1"):
        read_image(path, raw_sizes=[RawSize(4320, 1)])


@pytest.mark.parametrize("bits", [1, 2, 4])
def test_packed_pixels_have_their_first_in_the_high_bits(tmp_path, bits):
    levels = GREY >> (8 - bits)
    digits = "".join(f"{value:0{bits}b}" for value in levels.ravel().tolist())
    path = tmp_path / "packed.raw"
    path.write_bytes(int(digits, 2).to_bytes(len(digits) // 8, "big"))
    image = read_image(path, raw_sizes=[RawSize(60, 72)])
    assert np.array_equal(image.pixels, levels * (255 // (2**bits - 1)))
    assert image.notes == (f"its {4320 * bits // 8} bytes were read as {bits} bits a pixel",)


@pytest.mark.parametrize(
    ("words", "turned"),
    [
        (",bottom-up", GREY[::-1]),
        (", Mirrored", GREY[:, ::-1]),
        (",mirrored,bottom-up", GREY[::-1, ::-1]),
    ],
)
def test_rows_of_bare_pixels_may_run_from_the_bottom_or_from_the_right(tmp_path, words, turned):
    path = tmp_path / "print.raw"
    path.write_bytes(turned.tobytes())
    image = read_image(path, raw_sizes=[RawSize.parse(f"60x72{words}")])
    assert np.array_equal(image.pixels, GREY)


def packed(pixels):
    return (pixels[:, ::2] >> 4 << 4 | pixels[:, 1::2] >> 4).astype(np.uint8).tobytes()


@pytest.mark.parametrize(
    ("data", "hint"),
    [
        (packed(rings(288, 256)), "--raw 256x288 (4 bits a pixel)"),
        (rings(288, 256).tobytes(), "--raw 256x288"),
        (rings(192, 192).tobytes(), "--raw 192x192"),
        (rings(128, 288).tobytes(), "--raw WIDTHxHEIGHT"),  # as many bytes as 192 x 192 pixels
        (np.random.default_rng(1).bytes(36864), "--raw WIDTHxHEIGHT"),
    ],
    ids=["4 bits", "8 bits", "square", "other", "noise"],
)
def test_the_hint_of_a_size_never_leads_to_a_scrambled_image(tmp_path, data, hint):
    path = tmp_path / "frame.bin"
    path.write_bytes(data)
    with pytest.raises(ImageReadError) as caught:
        read_image(path)
    assert str(caught.value).endswith(f"; if its {len(data)} bytes are pixels: {hint}")


@pytest.mark.parametrize(
    "data",
    [
        FILES["AN2, type 4"][:300],
        b"FP3" + bytes(5000),
        bytes(range(128, 248)),  # a template of a card: five bytes a minutia
    ],
    ids=["AN2", "FP3", "card"],
)
def test_no_hint_of_a_size_follows_what_is_recognised_or_too_small(tmp_path, data):
    path = tmp_path / "file"
    path.write_bytes(data)
    with pytest.raises(ImageReadError) as caught:
        read_image(path)
    assert "--raw" not in str(caught.value)


def test_an_ihead_file_is_read_from_its_header():
    image = decoded(FILES["IHead"])
    assert np.array_equal(image.pixels, GREY)
    assert (image.dpi, image.format) == (500, "IHead")
    for data, reason in (
        (ihead(GREY, compression=2), "compression 2"),
        (FILES["IHead"][:-1], "pixels are missing"),
        (FILES["IHead"][:120], "text where a number"),
    ):
        with pytest.raises(ImageReadError, match=reason):
            decoded(data)


@pytest.mark.parametrize("number", [0, 1, 3])
@pytest.mark.parametrize("table_class", [0, 1])
def test_a_lossless_jpeg_with_tables_of_either_class(table_class, number):
    image = decoded(lossless_jpeg(GREY, table_class, number))
    assert np.array_equal(image.pixels, GREY)
    assert image.dpi == 500


@pytest.mark.parametrize(
    "text",
    [
        *("", "60", "60x", "x72", "0x72", "60x72x3", "-60x72", "6e1x72", "60x72,", "60x72,turned"),
        "60x72,mirrored,mirrored",
    ],
)
def test_raw_sizes_are_two_numbers(text):
    with pytest.raises(ImageError, match="WIDTHxHEIGHT"):
        RawSize.parse(text)
    with pytest.raises(ImageError, match="must be positive"):
        RawSize(0, 5)


def test_a_jpeg_of_too_many_scans():
    whole = saved(GREY, "JPEG", progressive=True)
    assert decoded(whole).pixels.shape == GREY.shape
    scan = whole.rindex(b"\xff\xda")
    many = whole[:-2] + whole[scan:-2] * MAX_JPEG_SCANS + whole[-2:]
    with pytest.raises(ImageReadError, match="more than 100 scans"):
        decoded(many)


@pytest.mark.parametrize(("order", "big"), [("<", False), (">", False), ("<", True), (">", True)])
def test_a_tiff_of_too_many_strips_or_tags(order, big):
    start = (b"II" if order == "<" else b"MM") + struct.pack(order + "H", 43 if big else 42)
    start += struct.pack(order + "HHQ", 8, 0, 16) if big else struct.pack(order + "L", 8)
    count, entry = ("Q", "HHQQ") if big else ("H", "HHLL")
    strips = start + struct.pack(order + count, 1) + struct.pack(order + entry, 273, 4, 300_001, 8)
    with pytest.raises(ImageReadError, match=r"300001 .*273"):
        decoded(strips)
    tags = start + struct.pack(order + count, 1001)
    with pytest.raises(ImageReadError, match="1001 tags"):
        decoded(tags)


def test_a_pnm_of_nothing_but_comments_or_digits():
    pixels = b"60 72 255\n" + GREY.tobytes()
    assert decoded(b"P5\n#one\n# two\r\n" + pixels).format == "PPM"
    talk = b"P5\n" + b"#" * 200_000 + b"\n" + pixels
    with pytest.raises(ImageReadError, match="header"):
        decoded(talk)
    digits = b"P2 60 72 255 " + bytes(MAX_PNM_TEXT)
    with pytest.raises(ImageReadError, match="20 MB"):
        decoded(digits)
    few = b"P2 60 72 255 " + b" ".join(b"%d" % value for value in GREY.ravel())
    assert np.array_equal(decoded(few).pixels, GREY)


def test_a_wsq_of_nothing_but_segments_tables_or_empty_runs():
    start = wsq()[: wsq().index(b"\xff\xa6")]
    comments = b"\xff\xa8\x00\x02" * 1001
    tables = (bytes([0, 1]) + bytes(15) + b"\xb4") * 9
    table = bytes([0, 1]) + bytes(15) + b"\x69"  # one code of one bit: a run of what follows
    runs = b"\xff\xa6\x00\x14" + table + b"\xff\xa3\x00\x03\x00" + bytes(100) + b"\xff\xa1"
    for rest, reason in (
        (comments, "more than 1000 segments"),
        (b"\xff\xa6" + (2 + len(tables)).to_bytes(2, "big") + tables, "too many Huffman tables"),
        (runs, "a run of no coefficients"),
    ):
        with pytest.raises(ImageReadError, match=reason):
            decode_wsq(start + rest, DEFAULT_LIMITS)
