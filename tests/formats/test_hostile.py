"""Whatever the bytes, a template reader answers with a template or an error of ours."""

import base64
import io
import json
import struct
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fpmatch import verify
from fpmatch.drawing.scene.ink import print_picture
from fpmatch.errors import FpmatchError, TemplateError
from fpmatch.formats.files import decode_record, load_template
from fpmatch.formats.record import MAX_BYTES, MAX_MINUTIAE, AngleConvention, ReadingOptions
from fpmatch.formats.registry import CODECS
from fpmatch.gallery.store.stored_template import pack_template
from fpmatch.prints.reading import GivenPrint, PrintReader, decode_print
from fpmatch.templates.bounds import check_bounds
from fpmatch.templates.minutiae import Template
from tests.formats.made_records import (
    BY_HAND,
    WRITTEN,
    an2_file,
    read,
    record_of,
    sample_record,
    written,
)


def npy(array):
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def npy_of(shape):
    """Return the header of a `.npy` file of some shape, and no data."""
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}}}\n".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header


RADIANS = ReadingOptions(angles=AngleConvention("rad"))
ARRAY = np.linspace(0, 3, 12).reshape(4, 3)
FILES = {
    **BY_HAND,
    **{name: written(name, sample_record()) for name in WRITTEN},
    **{"an2": an2_file(), "numbers": b"1.5 2 3 50\n4 5 6 70\n# more\n7 8 1 9\n", "npy": npy(ARRAY)},
}


def attempt(data, file_format=None):
    """Return the record in some bytes; None where they are refused, in one line."""
    angles = RADIANS.angles if file_format in {"numbers", "npy"} else None
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return read(data, file_format=file_format, angles=angles)
        except FpmatchError as error:
            words = str(error)
    assert words
    assert "\n" not in words
    return None


@given(st.binary(max_size=300))
@settings(max_examples=300)
def test_any_bytes_are_read_or_refused(data):
    attempt(data)
    for codec in CODECS:
        attempt(data, codec.name)


@pytest.mark.parametrize("name", FILES)
@given(st.data())
def test_a_damaged_file_is_read_or_refused(name, data):
    """Some bytes are changed, cut out or put in, or the end is missing."""
    damaged = bytearray(FILES[name])
    for _ in range(data.draw(st.integers(0, 4))):
        at = data.draw(st.integers(0, len(damaged)))
        damaged[at : at + data.draw(st.integers(0, 8))] = data.draw(st.binary(max_size=8))
    end = data.draw(st.integers(0, len(damaged)) | st.none())
    for file_format in (None, name):
        attempt(bytes(damaged[:end]), file_format)


CSV = b"# fpmatch-template 1 width=9 height=9 dpi=500\n"
ROW = CSV + b"x,y,angle_deg,kind,quality\n"
MANY = MAX_MINUTIAE + 1


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "the file is empty"),
        (b"hello\n", "not a template file of a known format"),
        (b"x,y,theta," + b"a," * 1_000_000, "line 1: expected the columns"),
        (b" " * (MAX_BYTES + 1), "too large"),
        (b"{", "not JSON"),
        (b'{"a": NaN}', "NaN is not a number"),
        (b'{"a": ' + b"[" * 100_000, "not JSON"),
        (b"[1]", "not a template file of a known format"),
        (b"{}", "expected the member"),
        (b'{"format": "fpmatch-template", "version": 9}', "unknown version"),
        (b"# fpmatch-template 9 width=9 height=9 dpi=500", "line 1: unknown version"),
        (b"# fpmatch-template 1 width=9 dpi=500", "line 1: expected width="),
        (CSV, "line 1: expected the columns"),
        (CSV + b"\xff\xfe", "not UTF-8"),
        (ROW + b"1,2,3,ending", "line 3: expected 5 values, found 4"),
        (ROW + b"1,2,3,loop,50", "line 3: unknown kind of minutia 'loop'"),
        (ROW + b"1,2,three,ending,50", "line 3, column angle: expected a number"),
        (ROW + b"nan,2,3,ending,50", "line 3, column x: nan is not finite"),
        (ROW + b"1,2,3,ending,101", "line 3, column quality: 101 is not in 0..100"),
        (ROW + b"1,2,3,ending,50\n" * MANY, "more than 10000 minutiae"),
        (ROW + b"3e36,2,3,ending,50\n", "beyond 32767 pixels"),
        (b"x,y,theta,\xff\n1,2,3,4\n", "not UTF-8 text"),
        (b'x,y,theta\n1,2,"3\x00', "line 2"),
        (b"x,y,angle,theta\n1,2,3,4\n", "line 1: a column is there twice: x, y, angle, theta"),
        (b"x;y;theta\n1,5;2;3\n", "line 2, column x: expected a number, found '1,5'"),
        (b"x,y,theta\n1,2,\n", "line 2, column angle: expected a number, found nothing"),
        (b"\nx,y,theta\n\n1,2\n", "line 4: expected 3 values, found 2"),
        (b"FMR\x00 20\x00\x00\x00\x00\x18" + bytes(11), "cut short"),
        (b"FMR\x00 20\x00\x00\x00\x00\x18" + bytes(12), "holds no print"),
        (BY_HAND["iso2005"][:20] + b"\x00\x62" + BY_HAND["iso2005"][22:], "resolution differ"),
        (b"1.001:99\x1d1.003:1\x1f1\x1e9\x1f01\x1c", "cut short"),
        (b"1.001:26\x1d1.003:1\x1f1\x1e9\x1f01\x1c99", "no record of type 9"),
        (an2_file("none"), "no minutiae in the file"),
        (an2_file().replace(b"10000500090", b"1000x500090"), "field 9.012 is malformed"),
        (an2_file("efs", f300="wide\x1f2000"), "field 9.300 is malformed"),
        (b"1 2 3\n1.5 2 3\n", "expected whole numbers"),
        (b"1 2 999 4\n", "an angle of 999"),
        (b"0 -40000 20 5\n", "beyond 32767 pixels"),
        (b"1.5 2 3\n1 2 3\n", "the file does not define how its angles are measured"),
    ],
    ids=lambda value: repr(value[-30:]) if isinstance(value, bytes) else None,
)
def test_a_bad_file_is_named_with_its_reason(tmp_path, data, reason):
    path = tmp_path / "bad"
    path.write_bytes(data)
    with pytest.raises(TemplateError) as caught:
        load_template(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"1.5 2 3\n1 2 3 4\n", "line 2: expected 3 values, found 4"),
        (b"1.5 2 3\n1 x 3\n", "line 2, column y: expected a number, found 'x'"),
        (b"1.5 2 3 50\n1 2 3 101\n", "line 2, column quality: 101 is not in 0..100"),
        (npy(np.zeros((2, 2))), "expected 3 or 4 columns, x, y, angle"),
        (npy(np.zeros((2, 5))), "found 5"),
        (npy(np.zeros(3)), "found 1 dimension"),
        (npy(np.array([[1, 2, np.nan]])), "row 1, column angle: nan is not finite"),
        (npy(np.array([["1", "2", "3"]])), "found one of type 'U'"),
        (npy(np.zeros((2, 3), complex)), "found one of type 'c'"),
        (npy(np.zeros((MANY, 3))), "more than 10000 minutiae"),
        (npy(np.array([[print, 1, 2]])), "or one of Python objects"),
        (npy(np.zeros((2, 3)))[:-1], "a damaged .npy file"),
        (npy(np.zeros((2, 3))) + b"0", "more bytes than its array has"),
        *(
            (npy_of(s), "a damaged")
            for s in ("(999999999999, 3)", "(-1, 3)", "3" * 999, "(" * 5000)
        ),
        (ROW, "defines how its angles are measured: --angles excludes it"),
    ],
    ids=lambda value: repr(value[-30:]) if isinstance(value, bytes) else None,
)
def test_a_bad_table_of_numbers_is_refused_with_its_place(data, reason):
    with pytest.raises(TemplateError) as caught:
        decode_record(data, "table", options=RADIANS)
    assert str(caught.value).startswith("table: ")
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


def in_base64(number):
    """Return a number for each cell inside the mask of the template."""
    return base64.b64encode(number * 396).decode()


@pytest.mark.parametrize(
    ("key", "value", "reason"),
    [
        ("width", 0, "size must be positive"),
        ("width", True, '"width" must be there and of type int'),
        ("dpi", 30, "outside the usable range"),
        *(("dpi", far, '"dpi" must be a finite number') for far in ("500", 3e38, 10**400)),
        *(("dpi", far, "outside the usable range") for far in (1e-50, 3e36)),
        *(("width", far, "65535") for far in (70_000, 10**30)),
        ("minutiae", [], '"minutiae" must be there and of type dict'),
        ("minutiae.x", [1], "y has 30 values where x has 1"),
        ("minutiae.x", [1] * MANY, "more than 10000 minutiae"),
        ("minutiae.x", [1e300] * 30, "x must be a list of finite numbers"),
        *(("minutiae.x", [far] * 30, "an x of ") for far in (3e36, -4e4)),
        ("minutiae.quality", [-1] * 30, "quality"),
        ("minutiae.kind", [3] * 30, "kind must be 0"),
        ("minutiae.quality", ["good"] * 30, "quality must be a list of finite numbers"),
        ("ridge_field", 3, '"ridge_field" must be there and of type dict'),
        ("ridge_field.step", 0, "step must be a positive number"),
        *(("ridge_field.step", far, "step of ") for far in (1e-50, 5e-324, 1e30)),
        ("ridge_field.rows", 1 << 21, "more than 1048576 cells"),
        ("ridge_field.mask", "////", "mask has 3 bytes, expected 69"),
        ("ridge_field.mask", "no!", "mask is not base64"),
        ("ridge_field.orientation", in_base64(b"\0\0\xc0\x7f"), "must lie from 0"),  # no number
        ("ridge_field.orientation", in_base64(b"\0\0\0\x41"), "must lie from 0"),  # 8 radians
        ("ridge_field.ridges", "", "ridges has 0 bytes, expected 3168"),
        ("ridge_field.ridges", "é", "ridges is not base64"),
        ("ridge_field.ridges", None, '"ridges" must be there and of type str'),
    ],
    ids=lambda value: str(value)[:30],
)
def test_a_bad_json_member_is_named(template, key, value, reason):
    document = json.loads(written("json", record_of(template)))
    parent, _, child = key.rpartition(".")
    (document[parent] if parent else document)[child] = value
    with pytest.raises(TemplateError) as caught:
        decode_record(json.dumps(document).encode(), "bad")
    assert reason in str(caught.value)


@pytest.mark.parametrize("separator", [b"\x1e", b"\x1f", b"\x1d"])
@pytest.mark.parametrize(("field", "kind"), [(b"9.012:", b"9.001:"), (b"1.003:", b"1.001:")])
def test_a_field_of_an2_of_nothing_but_separators_is_refused_at_once(separator, field, kind):
    data = an2_file().replace(field, field + separator * 200_000)
    start = data.index(kind) + len(kind)
    end = data.index(b"\x1d", start)
    length = b"%d" % (int(data[start:end]) + 200_000)
    with pytest.raises(TemplateError):
        read(data[:start] + length + data[end:], file_format="an2")


@pytest.mark.parametrize("name", sorted(set(WRITTEN) - {"ansi2004"}))
def test_a_template_of_too_many_pixels_is_refused_everywhere(tmp_path, name):
    one = sample_record().views[0].template
    side = 16_000 if name == "iso2005" else 32_000  # below the bounds of each format
    minutiae = np.array([[1, 1, 1.0], [side, side, 5.0]]).T
    wide = Template(type(one.minutiae)(*minutiae), side + 1, side + 1)
    path = tmp_path / "wide"
    path.write_bytes(written(name, record_of(wide)))
    for door in (load_template, PrintReader(), lambda path: decode_print(path.read_bytes(), "a")):
        with pytest.raises(TemplateError, match="is too large: more than 16 megapixels"):
            door(path)


def test_a_template_in_memory_of_too_many_pixels_is_not_drawn_nor_enrolled():
    wide = Template(sample_record().views[0].template.minutiae, 65_535, 65_535)
    drawn = verify(wide, wide)
    given = GivenPrint("a", wide)
    for step in (drawn.overlay, lambda: pack_template(wide), lambda: print_picture(given)):
        with pytest.raises(TemplateError, match="is too large: more than 16 megapixels"):
            step()
    check_bounds(Template(wide.minutiae, 7990, 7990, 1000))
    with pytest.raises(TemplateError, match="64 megapixels"):
        check_bounds(Template(wide.minutiae, 8010, 8010, 4000))
