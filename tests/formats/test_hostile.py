"""Whatever the bytes, a template reader answers with a template or an error of ours."""

import base64
import json
import warnings

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_records import read, sample_files

from fpmatch import verify
from fpmatch.errors import FpmatchError, TemplateError
from fpmatch.formats.files import load_template, save_template
from fpmatch.formats.record import ReadLimits
from fpmatch.formats.registry import CODECS
from fpmatch.gallery.store.stored_template import pack_template
from fpmatch.prints.reading import GivenPrint, PrintReader, decode_print
from fpmatch.templates.bounds import check_bounds
from fpmatch.templates.minutiae import Minutiae, Template

FILES = sample_files()
STARTS = [b"", *(data[:n] for data in FILES.values() for n in (8, 20, 40))]


def attempt(data, file_format=None):
    """Return the record in some bytes; None where they are refused, in one line."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return read(data, file_format=file_format)
        except FpmatchError as error:
            words = str(error)
    assert words
    assert "\n" not in words
    return None


@given(st.binary(max_size=300), st.sampled_from(STARTS))
@settings(max_examples=300)
def test_any_bytes_are_read_or_refused(data, start):
    attempt(start + data)


@pytest.mark.parametrize("codec", CODECS, ids=lambda codec: codec.name)
@given(st.binary(max_size=200))
def test_a_codec_that_is_named_refuses_what_is_not_its_own(codec, data):
    attempt(data, codec.name)


@st.composite
def damaged(draw):
    """Return a good file with some bytes changed, cut out or put in."""
    data = bytearray(draw(st.sampled_from(list(FILES.values()))))
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(data)))
        cut = draw(st.integers(0, 8))
        data[at : at + cut] = draw(st.binary(max_size=8))
    return bytes(data[: draw(st.integers(0, len(data)))]) if draw(st.booleans()) else bytes(data)


@given(damaged())
@settings(max_examples=250)
def test_a_damaged_file_is_read_or_refused(data):
    attempt(data)


@pytest.mark.parametrize("name", FILES)
def test_no_beginning_of_a_file_passes_for_more_than_it_is(name):
    most = len(read(FILES[name]).views[0].template.minutiae)
    for end in range(0, len(FILES[name]), max(1, len(FILES[name]) // 60)):
        part = attempt(FILES[name][:end])
        if part is not None:
            assert part.format in {name, "xyt", "xyt-m1", "csv"}
            assert len(part.views[0].template.minutiae) <= most


@pytest.mark.parametrize("name", FILES)
def test_limits_hold_for_every_format(name):
    with pytest.raises(TemplateError, match="more than 2 minutiae"):
        read(FILES[name], file_format=name, limits=ReadLimits(max_minutiae=2))
    with pytest.raises(TemplateError, match="more than 100 pixels"):
        read(FILES[name], file_format=name, limits=ReadLimits(max_side_px=100))


CSV = b"# fpmatch-template 1 width=9 height=9 dpi=500\n"
ROW = CSV + b"x,y,angle_deg,kind,quality\n"


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "the file is empty"),
        (b"hello\n", "not a template file of a known format"),
        (b"\x00" * 100, "not a template file of a known format"),
        (b" " * (ReadLimits().max_bytes + 1), "too large"),
        (b"{", "not JSON"),
        (b'{"a": NaN}', "NaN is not a number"),
        (b'{"a": ' + b"[" * 100_000, "not JSON"),
        (b"{}", "expected the member"),
        (b'{"format": "fpmatch-template", "version": 9}', "unknown version"),
        (b"# fpmatch-template 9 width=9 height=9 dpi=500", "line 1: unknown version"),
        (b"# fpmatch-template 1 width=9 dpi=500", "line 1: expected width="),
        (CSV, "line 1: expected the columns"),
        (CSV + b"\xff\xfe", "not UTF-8"),
        (ROW + b"1,2,3,ending", "line 3: expected 5 values, found 4"),
        (ROW + b"1,2,3,loop,50", "line 3: unknown kind of minutia 'loop'"),
        (ROW + b"1,2,three,ending,50", "line 3, column angle_deg: expected a number"),
        (ROW + b"nan,2,3,ending,50", "line 3, column x: nan is not finite"),
        (ROW + b"1e300,2,3,ending,50", "line 3, column x: 1e+300 is not finite"),
        (ROW + b"1,2,3,ending,101", "line 3, column quality: 101 is not in 0..100"),
        (b"x,y,theta\n1,nan,3\n", "line 2, column y: nan is not finite"),
        (b"x,y,theta,quality\n1,2,3,101\n", "line 2, column quality: 101 is not in 0..100"),
        (b"x,y,theta,type\n1,2,3,loop\n", "line 2: unknown type of minutia 'loop'"),
        (b"x,y,theta\n\xff,2,3\n", "not UTF-8 text"),
        (b"FMR\x00 99\x00" + bytes(40), "of version '99', which is not known"),
        (b"FMR\x00 20\x00\x00\x00\x00\x18" + bytes(11), "cut short"),
        (b"FMR\x00 20\x00\x00\x00\x00\x18" + bytes(12), "holds no print"),
        (b"1.001:99\x1d1.003:1\x1f1\x1e9\x1f01\x1c", "cut short"),
        (b"1.001:26\x1d1.003:1\x1f1\x1e9\x1f01\x1c99", "no record of type 9"),
        (b"1 2 3 4\n1 2\n", "line 2: expected x, y, angle"),
        (b"1 2 3 4\n1 2 3\n", "some lines have a quality"),
        (b"1 2 999 4\n", "line 1: an angle of 999"),
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


def in_base64(number):
    """Return a number for each cell inside the mask of the template."""
    return base64.b64encode(number * 396).decode()


@pytest.mark.parametrize(
    ("key", "value", "reason"),
    [
        ("width", 0, "size must be positive"),
        ("width", True, '"width" must be there and of type int'),
        ("height", 3.5, '"height" must be there and of type int'),
        ("dpi", 30, "outside the usable range"),
        ("dpi_known", "no", '"dpi_known" must be there and of type bool'),
        ("dpi", "500", '"dpi" must be a finite number'),
        ("dpi", 10**400, '"dpi" must be a finite number'),
        *(("dpi", far, "outside the usable range") for far in (1e-50, 3e38)),
        *(("width", far, "65535") for far in (70_000, 10**30)),
        ("minutiae", [], '"minutiae" must be there and of type dict'),
        ("minutiae.x", [1], "y has 30 values where x has 1"),
        ("minutiae.x", [1e300] * 30, "x must be a list of finite numbers"),
        *(("minutiae.x", [far] * 30, "an x of ") for far in (3e38, -4e4)),
        ("minutiae.y", [4e4] * 30, "a y of 40000"),
        ("minutiae.angle", [3e300] * 30, "angle must be a list of finite numbers"),
        ("minutiae.quality", [-1] * 30, "quality"),
        ("minutiae.kind", [3] * 30, "kind must be 0"),
        ("minutiae.quality", ["good"] * 30, "quality must be a list of finite numbers"),
        ("ridge_field", 3, '"ridge_field" must be there and of type dict'),
        ("ridge_field.step", 0, "step must be a positive number"),
        ("ridge_field.step", 10**400, "finite"),
        *(("ridge_field.step", far, "step of ") for far in (1e-50, 5e-324, 1e30)),
        ("ridge_field.rows", 1 << 21, "more than 1048576 cells"),
        ("ridge_field.rows", -1, "must be positive"),
        ("ridge_field.rows", 99, "mask has 69 bytes, expected 297"),
        ("ridge_field.mask", "////", "mask has 3 bytes, expected 69"),
        ("ridge_field.mask", "no!", "mask is not base64"),
        ("ridge_field.orientation", "AAAA", "orientation has 3 bytes, expected 1584"),
        ("ridge_field.orientation", "//8=//8=", "orientation is not base64"),
        ("ridge_field.orientation", in_base64(b"\0\0\xc0\x7f"), "must lie from 0"),  # no number
        ("ridge_field.orientation", in_base64(b"\0\0\0\x41"), "must lie from 0"),  # 8 radians
        ("ridge_field.ridges", "AAAA", "ridges has 3 bytes, expected 3168"),
        ("ridge_field.ridges", "", "ridges has 0 bytes, expected 3168"),
        ("ridge_field.ridges", "é", "ridges is not base64"),
        ("ridge_field.ridges", None, '"ridges" must be there and of type str'),
        ("ridge_field.ridges", [1], '"ridges" must be there and of type str'),
    ],
    ids=lambda value: str(value)[:30],
)
def test_a_bad_json_member_is_named(tmp_path, template, key, value, reason):
    path = tmp_path / "bad.json"
    save_template(path, template)
    document = json.loads(path.read_text())
    parent, _, child = key.rpartition(".")
    (document[parent] if parent else document)[child] = value
    path.write_text(json.dumps(document))
    with pytest.raises(TemplateError) as caught:
        load_template(path)
    assert reason in str(caught.value)


WIDE = Template(Minutiae([5, 60], [6, 70], [1.0, 2.0]), 65_535, 65_535)


def wide_file(name):
    """Return a file of a format that states 65,535 x 65,535 pixels, or whose minutiae span them."""
    if name == "xyt":
        return b"1 1 1 50\n32000 32000 200 50\n"
    if name == "minutiae-csv":
        return b"x,y,theta\n1,1,1\n32000,32000,2\n"
    if name == "iso2005":
        return FILES[name][:14] + b"\xff" * 4 + FILES[name][18:]
    return FILES[name].replace(b"300", b"65535", 1).replace(b"400", b"65535", 1)


@pytest.mark.parametrize("name", ["json", "csv", "iso2005", "xyt", "minutiae-csv"])
def test_a_template_of_too_many_pixels_is_refused_everywhere(tmp_path, name):
    path = tmp_path / "wide"
    path.write_bytes(wide_file(name))
    for door in (load_template, PrintReader(), lambda path: decode_print(path.read_bytes(), "a")):
        with pytest.raises(TemplateError, match="is too large: more than 16 megapixels") as caught:
            door(path)
        assert "\n" not in str(caught.value)


def test_a_template_in_memory_of_too_many_pixels_is_not_drawn_nor_enrolled():
    drawn = verify(WIDE, WIDE)
    for step in (drawn.overlay, lambda: pack_template(WIDE), lambda: GivenPrint("a", WIDE).pixels):
        with pytest.raises(TemplateError, match="is too large: more than 16 megapixels"):
            step()
    at_1000 = Template(WIDE.minutiae, 7990, 7990, 1000)
    check_bounds(at_1000)
    with pytest.raises(TemplateError, match="64 megapixels"):
        check_bounds(Template(WIDE.minutiae, 8010, 8010, 4000))


def test_a_header_of_very_many_columns_is_refused_at_once():
    with pytest.raises(TemplateError, match="expected the columns"):
        read(b"x,y,theta," + b"a," * 1_000_000, file_format="minutiae-csv")
