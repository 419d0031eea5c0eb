"""Tables of minutiae of other programs: their names, angles, separators; arrays of numpy."""

import io
import pickle
import struct
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_records import columns, only_view

from fpmatch.base.npy import decode_npy
from fpmatch.errors import FpmatchError, TemplateError
from fpmatch.formats.angles import AngleConvention
from fpmatch.formats.files import decode_record, load_record
from fpmatch.formats.record import ReadingOptions
from fpmatch.formats.registry import recognise
from fpmatch.templates.minutiae import Minutiae

ROWS = [[10.0, 20.0, 0.5], [30.5, 40.0, 1.5], [50.0, 6.0, 3.0], [7.0, 8.0, 6.0]]
RADIANS = AngleConvention("rad")


def decoded(data, angles=None):
    convention = None if angles is None else AngleConvention.parse(angles)
    return decode_record(data, "table", options=ReadingOptions(angles=convention))


def npy(array):
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def npy_with_header(header, data=b""):
    padded = header.encode() + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(padded)) + padded + data


@pytest.mark.parametrize(
    "text",
    [
        "x,y,angle\n{}",
        "X,Y,Angle\r\n{}",
        "Y_is_not,x,y,direction,note\n#c\n{}",
        "# x,y,orientation\n{}",
        "\n\nCol,Row,phi\n{}",
        "x;y;dir\n{;}",
        "x\ty\tori\n{\t}",
        "x y angle\n{ }",
        "x_px,y_px,θ\n{}",
    ],
    ids=repr,
)
def test_every_form_of_the_same_table_is_read_with_a_convention(text):
    delimiter = next((sign for sign in ";\t " if "{" + sign + "}" in text), ",")
    rows = [[str(value) for value in row] for row in ROWS]
    if "note" in text:
        rows = [["?", *row, "a b"] for row in rows]
    table = "\n".join(delimiter.join(row) for row in rows)
    data = text.replace("{" + delimiter.replace(",", "") + "}", table).encode()
    assert recognise(data[:4096]).name == "minutiae-csv"
    x, y, angle = np.array(ROWS).T
    assert decoded(data, "rad").views[0].template.minutiae == Minutiae(x, y, angle)
    with pytest.raises(TemplateError, match="--angles of verify"):
        decoded(data)


@pytest.mark.parametrize("name", ["angle_deg", "Angle (deg)", "direction[degrees]", "theta_deg"])
def test_a_unit_in_the_name_of_the_column_is_taken_with_a_note(name):
    record = decoded(f"x,y,{name}\n1,2,90\n".encode())
    assert record.views[0].template.minutiae.angle.tolist() == pytest.approx([np.pi / 2])
    assert record.notes == (
        "angles taken for degrees, counter-clockwise on screen from +x, as in ISO/IEC 19794-2 "
        "(--angles sets it)",
    )
    stated = decoded(f"x,y,{name}\n1,2,90\n".encode(), "deg,clockwise")
    assert stated.views[0].template.minutiae.angle.tolist() == pytest.approx([3 * np.pi / 2])
    assert not stated.notes


def test_a_unit_of_radians_and_kinds_in_words_are_known():
    record = decoded(b"x,y,angle_rad,kind\n1,2,3,ending\n1,2,3,2\n1,2,3,U\n")
    minutiae = record.views[0].template.minutiae
    assert minutiae.angle.tolist() == pytest.approx([3.0] * 3)
    assert minutiae.kind.tolist() == [1, 2, 0]


def test_angles_out_of_the_range_of_their_unit_are_noted():
    table = "x,y,theta\n" + "".join(f"{x},{y},{angle}\n" for x, y, angle in ROWS)
    assert "--angles rad" in decoded(table.encode()).notes[0]
    assert "--angles deg" in decoded(b"x,y,theta\n1,2,270\n", "rad").notes[0]
    assert not decoded(b"x,y,theta\n1,2,270\n").notes


@given(st.integers(0, 12).flatmap(lambda n: columns(n, st.floats(0, 500), st.floats(0, 500))))
def test_conventions_are_undone(found):
    x, y, angle, _, _ = found
    minutiae = Minutiae(x, y, angle)
    for convention, values in {
        "rad": np.array(angle),
        "rad,clockwise": -np.array(angle),
        "rad,opposite": np.array(angle) + np.pi,
        "deg,opposite,clockwise": -np.degrees(np.array(angle) + np.pi),
    }.items():
        array = np.column_stack([x, y, values]).reshape(-1, 3)
        read = decoded(npy(array), convention).views[0].template.minutiae
        turned = np.angle(np.exp(1j * (read.angle - minutiae.angle).astype(float)))
        assert np.abs(turned).max(initial=0) < 1e-5
        assert read.xy.tolist() == minutiae.xy.tolist()


@pytest.mark.parametrize("dtype", ["<f8", ">f4", "<i4", "<u2"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_arrays_of_every_type_and_order_are_read(dtype, order):
    array = np.array([[10, 20, 1, 50], [30, 40, 2, 100]], dtype, order=order)
    record = decoded(npy(array), "rad")
    minutiae = record.views[0].template.minutiae
    assert minutiae == Minutiae([10, 30], [20, 40], [1, 2], quality=[50, 100])
    assert (record.format, record.views[0].quality_known) == ("npy", True)
    assert (record.views[0].template.width, record.views[0].template.height) == (31, 41)
    np.testing.assert_array_equal(decode_npy(npy(array)), array)


@pytest.mark.parametrize("options", [{}, {"delimiter": ","}, {"fmt": "%.3f", "header": "made"}])
def test_what_savetxt_writes_is_read(options, tmp_path):
    path = tmp_path / "minutiae.txt"
    np.savetxt(path, np.array(ROWS), **options)
    record = load_record(path, options=ReadingOptions(angles=RADIANS, size=(60, 50)))
    assert record.format == "numbers"
    template = record.views[0].template
    assert template.minutiae == Minutiae(*np.array(ROWS).T)
    assert (template.width, template.height) == (60, 50)
    with pytest.raises(TemplateError, match="angles"):
        load_record(path)


def test_whole_numbers_are_xyt_unless_a_convention_is_given():
    data = b"10 20 90\n30 40 200\n"
    assert decoded(data).format == "xyt"
    record = decoded(data, "deg")
    assert record.format == "numbers"
    assert record.views[0].template.minutiae.y.tolist() == [20, 40]


def test_a_convention_is_refused_for_formats_that_define_theirs(template):
    data = b"# fpmatch-template 1 width=9 height=9 dpi=500\nx,y,angle_deg,kind,quality\n"
    with pytest.raises(TemplateError, match="--angles excludes it"):
        decoded(data, "deg")
    assert only_view(data).template.width == 9


@pytest.mark.parametrize("text", ["", "turns", "deg,deg", "deg,up", "clockwise", "rad clockwise"])
def test_other_conventions_are_refused(text):
    with pytest.raises(TemplateError, match="deg or rad"):
        AngleConvention.parse(text)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"x,y,angle,theta\n1,2,3,4\n", "line 1: a column is there twice: x, y, angle, theta"),
        (b"x,y,angle\n1,2,three\n", "line 2, column angle: expected a number, found 'three'"),
        (b"x;y;angle\n1,5;2;3\n", "line 2, column x: expected a number, found '1,5'"),
        (b"x,y,angle\n1,2,\n", "line 2, column angle: expected a number, found nothing"),
        (b"\nx,y,angle\n\n1,2\n", "line 4: expected 3 values, found 2"),
        (b"1.5 2 3\n1 2\n", "line 2: expected x, y, angle and perhaps quality"),
        (b"1.5 2 3\n1 2 3 4\n", "line 2: expected 3 values, found 4"),
        (b"1.5 2 3\n1 x 3\n", "line 2, column y: expected a number, found 'x'"),
        (b"1.5 2 3\n1 2 nan\n", "line 2, column angle: nan is not finite"),
        (b"1.5 2 3 50\n1 2 3 101\n", "row 2, column quality: 101 is not in 0..100"),
        (npy(np.zeros((2, 2))), "expected an array of 3 or 4 columns"),
        (npy(np.zeros((2, 5))), "found 5"),
        (npy(np.zeros(3)), "1 dimensions"),
        (npy(np.array([[1, 2, np.nan]])), "row 1, column angle: not a finite number"),
        (npy(np.array([["1", "2", "3"]])), "found one of type 'U'"),
        (npy(np.zeros((2, 3), complex)), "found one of type 'c'"),
        (npy(np.zeros((10_001, 3))), "more than 10000 minutiae"),
        (npy(np.array([[print, 1, 2]])), "Python objects"),
        (npy(np.zeros((2, 3)))[:-1], "damaged"),
        (npy(np.zeros((2, 3))) + b"1", "more bytes"),
        (npy(np.zeros((2, 3)))[:40], "damaged"),
        (b"\x93NUMPY\x09\x00", "damaged"),
        (npy_with_header("{'descr': '<f8', 'fortran_order': False, 'shape': (10**9,)}"), "damaged"),
        (
            npy_with_header("{'descr': '<f8', 'fortran_order': False, 'shape': (999999999999, 3)}"),
            "damaged",
        ),
        (npy_with_header("{'descr': '<f8', 'fortran_order': False, 'shape': (-1, 3)}"), "damaged"),
        (npy_with_header("(" * 5000), "damaged"),
    ],
    ids=lambda value: repr(value[-30:]) if isinstance(value, bytes) else None,
)
def test_a_bad_table_is_refused_with_its_place(data, reason):
    with pytest.raises(TemplateError) as caught:
        decoded(data, "rad")
    assert str(caught.value).startswith("table: ")
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


def test_points_are_no_minutiae():
    with pytest.raises(TemplateError, match="known format"):
        decoded(b"x,y\n1,2\n")
    with pytest.raises(TemplateError, match=r"line 1: .*columns x, y;"):
        decode_record(b"x,y\n1,2\n", "table", file_format="minutiae-csv")


def test_nothing_is_unpickled(tmp_path):
    class Hostile:
        def __reduce__(self):
            return Path.touch, (tmp_path / "made",)

    data = npy(np.array([[Hostile(), 1, 2]]))
    for bad in (data, pickle.dumps(Hostile())):
        with pytest.raises(FpmatchError):
            decoded(bad, "rad")
    assert not (tmp_path / "made").exists()


@given(st.binary(max_size=60), st.integers(0, 140))
def test_any_damaged_array_is_read_or_refused(data, at):
    whole = np.frombuffer(npy(np.zeros((2, 3))), np.uint8)
    for bad in (whole[:at].tobytes() + data, bytes([*whole[:at], *data, *whole[at + len(data) :]])):
        with suppress(TemplateError):
            decoded(bad, "rad")


@pytest.mark.parametrize(
    ("word", "kind"),
    [
        *((word, 1) for word in ("Termination", "Ridge Ending", "ridge-ending", "END", "RIG", "1")),
        *((word, 2) for word in ("Bifurcation", "bif", "Ridge bifurcation", "B", "2")),
        *((word, 0) for word in ("unknown", "Crossover", "other", "u")),
    ],
)
def test_the_words_of_other_programs_for_kinds(word, kind):
    view = decoded(f"x,y,theta,type\n10,20,30,{word}\n".encode()).views[0]
    assert view.template.minutiae.kind.tolist() == [kind]


def test_an_unknown_word_for_a_kind_is_refused():
    with pytest.raises(TemplateError, match="line 2: unknown type of minutia 'whorl'"):
        decoded(b"x,y,theta,type\n10,20,30,whorl\n")
