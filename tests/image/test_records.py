"""Prints inside records of ANSI/NIST-ITL (AN2)."""

import sys

import numpy as np
import pytest

from fpmatch.errors import FpmatchError, ImageError, ImageReadError
from fpmatch.image.io.read import decode_image
from fpmatch.prints.reading import PrintReader
from tests.formats.made_records import an2_file
from tests.image.made_files import (
    an2,
    binary_print,
    decoded,
    lossless_jpeg,
    rings,
    saved,
    tagged_print,
    with_fields,
    wsq,
)

GREY = rings()
PNG = saved(GREY, "PNG")


@pytest.mark.parametrize(
    ("record", "scan", "kind", "dpi"),
    [
        *((tagged_print(GREY, type_=type_), b"19.69", type_, 500) for type_ in (13, 14, 15)),
        (binary_print(GREY, native=0), b"39.37", 4, 500),  # the standard's resolution
        (binary_print(GREY, native=1), b"39.37", 4, 1000),  # that of the scan
    ],
)
def test_a_transaction_with_bare_pixels(record, scan, kind, dpi):
    image = decoded(an2(record, scan=scan))
    assert np.array_equal(image.pixels, GREY)
    assert (image.dpi, image.format) == (dpi, f"ANSI/NIST type {kind}")


def test_what_is_odd_about_a_transaction_is_noted():
    image = decoded(an2(tagged_print(GREY), tagged_print(255 - GREY)))
    assert np.array_equal(image.pixels, GREY)
    assert image.notes == ("the first of its 2 images was read (--record chooses one)",)
    image = decoded(an2(tagged_print(GREY[:60], PNG, compression=b"PNG")))
    assert image.pixels.shape == GREY.shape
    assert image.notes == ("its record gives a size of 60 x 60 pixels, but its image has 60 x 72",)


AMPUTATED = (14, with_fields(14, [(2, b"00"), (6, b"60"), (18, b"1\x1fXX")]))
EMPTY = tagged_print(GREY, b"")


@pytest.mark.parametrize("absent", [AMPUTATED, EMPTY, binary_print(GREY, b"")])
def test_fingers_without_an_image_are_passed_over(absent):
    for records in ([absent, tagged_print(GREY)], [tagged_print(GREY), absent]):
        image = decoded(an2(*records))
        assert np.array_equal(image.pixels, GREY)
        assert image.notes == ()
    with pytest.raises(ImageReadError, match="has no print in it"):
        decoded(an2(absent, AMPUTATED))


def test_a_number_chooses_a_print_of_a_card():
    card = an2(AMPUTATED, tagged_print(GREY), EMPTY, tagged_print(255 - GREY), binary_print(GREY.T))
    for number, pixels in ((1, GREY), (2, 255 - GREY), (3, GREY.T)):
        image = decode_image(card, "card", polarity="dark", record=number)
        assert np.array_equal(image.pixels, pixels)
        assert image.notes == ()
    with pytest.raises(ImageReadError, match="card: ANSI/NIST file of 3 images, not 4"):
        decode_image(card, "card", record=4)
    one = decode_image(PNG, "one", polarity="dark", record=4)
    assert np.array_equal(one.pixels, GREY)


@pytest.mark.parametrize(
    ("scale", "shape", "dpi"),
    [
        ((1, 500, 500), (72, 60), 500),
        ((1, 569, 570), (72, 60), 569),
        ((1, 1000, 1001), (72, 60), 1000),
        ((1, 500, 357), (101, 60), 500),
        ((1, 250, 500), (72, 120), 500),
        ((2, 197, 141), (101, 60), 500),
        ((1, 500, 0), (72, 60), 500),
    ],
)
def test_two_resolutions_become_one(scale, shape, dpi):
    bare, compressed = (
        decoded(an2(tagged_print(GREY, data, compression=name, scale=scale)))
        for data, name in ((None, b"NONE"), (PNG, b"PNG"))
    )
    assert bare.pixels.shape == shape
    assert bare.dpi == dpi
    assert np.array_equal(bare.pixels, compressed.pixels)
    assert bool(bare.notes) is (shape != GREY.shape)


def test_a_lossless_jpeg_of_nist_in_a_record():
    jpeg = lossless_jpeg(GREY, table_class=1)
    for record in (
        tagged_print(GREY, jpeg, compression=b"JPEGL"),
        binary_print(GREY, jpeg, compression=3),
    ):
        assert np.array_equal(decoded(an2(record)).pixels, GREY)


def test_without_the_formats_of_agencies_a_file_of_theirs_is_named(monkeypatch, tmp_path):
    for module in ("an2", "wsq", "fmr_2011"):
        monkeypatch.setitem(sys.modules, f"fpmatch.formats.agency.{module}", None)
    for data in (wsq(), an2(tagged_print(GREY)), an2_file(), b"FMR\x00030\x00" + bytes(40)):
        path = tmp_path / "file"
        path.write_bytes(data)
        with pytest.raises(FpmatchError, match=r"file: .*fpmatch.formats.agency is not installed"):
            PrintReader()(path)


def test_an_unknown_scale_and_pixels_like_a_field_leave_it_to_the_file_inside():
    inside = saved(GREY, "PNG", dpi=(569, 569))
    record = tagged_print(GREY, inside, compression=b"PNG", scale=(0, 0, 0))
    assert decoded(an2(record)).dpi == 569
    odd = GREY.copy()
    odd[3, :8] = np.frombuffer(b"\x1d14.999:", np.uint8)  # pixels may look like a field
    assert np.array_equal(decoded(an2(tagged_print(odd))).pixels, odd)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (an2((9, with_fields(9, [(2, b"00")]))), "without a grey print .its records: type 1, 9."),
        (an2(tagged_print(GREY))[:-100], "cut short"),
        (an2(tagged_print(GREY))[:20], "cut short"),
        (b"1.001:many", "does not begin with a record of type 1"),
        (an2(tagged_print(GREY, b"few")), "pixels are missing"),
        (an2(tagged_print(GREY, b""), binary_print(GREY, b"")), "has no print in it"),
        (an2(tagged_print(GREY, b"text", compression=b"WSQ20")), "cannot be read .WSQ20."),
        (an2(binary_print(GREY, compression=9)), "unknown compression"),
        (an2(binary_print(GREY, PNG[:200], compression=6)), "damaged PNG image"),
        (an2((14, with_fields(14, [(6, b"60"), (18, b"1\x1fXX")]))), "has no print in it"),
        (an2((14, with_fields(14, [(6, b"wide"), (999, b"few")]))), "text where a number"),
        (an2(*[tagged_print(GREY[:1, :1])] * 2001), "more than 2000 records"),
    ],
)
def test_bad_transactions_say_what_is_wrong(data, reason):
    with pytest.raises(ImageReadError, match=reason):
        decoded(data)


def test_absurd_sizes_are_refused_before_anything_is_made():
    huge = np.broadcast_to(np.uint8(0), (9_000, 9_000))
    for data in (an2(tagged_print(huge, b"few")), an2(binary_print(huge, b"few"))):
        with pytest.raises(ImageError, match="more than 16 megapixels at 500 dpi"):
            decoded(data)
