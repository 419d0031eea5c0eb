"""Tables of minutiae of other programs: their names, angles, separators; arrays of numpy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.base.npy import decode_npy
from fpmatch.errors import TemplateError
from fpmatch.formats.files import decode_record
from fpmatch.formats.record import AngleConvention, ReadingOptions
from fpmatch.formats.registry import recognise
from fpmatch.templates.minutiae import STANDARD_DPI, Minutiae
from tests.formats.made_records import columns, sample_record, written
from tests.formats.test_hostile import npy

ROWS = [[10.0, 20.0, 0.5], [30.5, 40.0, 1.5], [50.0, 6.0, 3.0], [7.0, 8.0, 6.0]]


def decoded(data, angles=None, **options):
    convention = None if angles is None else AngleConvention.parse(angles)
    return decode_record(data, "table", options=ReadingOptions(angles=convention, **options))


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("delimiter", [",", ";", "\t", " ", " ;  "])
@pytest.mark.parametrize("start", ["", "# ", "\ufeff", "\n\n"])
@pytest.mark.parametrize("names", ["x,y,angle", "X,Y,Direction", "No,x,y,orientation,note"])
def test_every_form_of_the_same_table_is_read_with_a_convention(names, start, delimiter, end):
    rows = [["?", *row, "ab"] if "note" in names else row for row in ROWS]
    lines = [names.split(","), *rows, ["#c"]]
    text = start + end.join(delimiter.join(map(str, line)) for line in lines)
    assert recognise(text.encode()[:4096]).name == "minutiae-csv"
    x, y, angle = np.array(ROWS).T
    view = decoded(text.encode(), "rad").views[0]
    assert view.template.minutiae == Minutiae(x, y, angle)
    assert (view.template.width, view.template.height, view.template.dpi) == (51, 41, STANDARD_DPI)
    assert not any([view.size_known, view.dpi_known, view.quality_known])
    with pytest.raises(TemplateError, match="--angles of verify"):
        decoded(text.encode())


@pytest.mark.parametrize("name", ["angle_deg", "Angle (deg)", "direction[degrees]", "theta_deg"])
def test_a_unit_in_the_name_of_the_column_is_taken_with_a_note(name):
    record = decoded(f"x,y,{name},\n1,2,90,\n".encode())
    assert record.views[0].template.minutiae.angle.tolist() == pytest.approx([np.pi / 2])
    assert record.notes == (
        "angles taken for degrees, counter-clockwise on screen from +x, as in ISO/IEC 19794-2 "
        "(--angles sets it)",
    )
    stated = decoded(f"x,y,{name}\n1,2,90\n".encode(), "deg,clockwise")
    assert stated.views[0].template.minutiae.angle.tolist() == pytest.approx([3 * np.pi / 2])
    assert not stated.notes


def test_columns_have_any_order_and_kinds_and_quality_are_read():
    data = b"quality,Kind,angle_rad,y,x\n5,ending,3,20,10\n60,2,3,4,3\n7,U,3,1,1\n"
    view = decoded(data).views[0]
    minutiae = view.template.minutiae
    assert minutiae == Minutiae([10, 3, 1], [20, 4, 1], [3.0] * 3, [1, 2, 0], [5, 60, 7])
    assert view.quality_known


@pytest.mark.parametrize(
    ("words", "kind"),
    [
        (("Termination", "Ridge Ending", "ridge-ending", "END", "E", "1"), 1),
        (("Bifurcation", "bif", "fork", "Ridge bifurcation", "B", "2", "3"), 2),
        (("unknown", "Crossover", "other", "u", "none", "0"), 0),
    ],
)
def test_the_words_of_other_programs_for_kinds(words, kind):
    text = "x,y,theta,type\n" + "".join(f"10,20,30,{word}\n" for word in words)
    view = decoded(text.encode()).views[0]
    assert view.template.minutiae.kind.tolist() == [kind] * len(words)
    with pytest.raises(TemplateError, match="line 2: unknown kind of minutia 'whorl'"):
        decoded(b"x,y,theta,type\n10,20,30,whorl\n")


def test_angles_out_of_the_range_of_their_unit_are_noted():
    table = "x,y,theta\n" + "".join(f"{x},{y},{angle}\n" for x, y, angle in ROWS)
    assert "--angles rad" in decoded(table.encode()).notes[0]
    assert "--angles deg" in decoded(b"x,y,theta\n1,2,270\n", "rad").notes[0]
    assert not decoded(b"x,y,theta\n1,2,270\n").notes


@given(st.integers(0, 12).flatmap(lambda n: columns(n, st.floats(0, 500), st.floats(0, 500))))
def test_conventions_are_undone(drawn):
    x, y, angle, _, _ = drawn
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


@pytest.mark.parametrize("text", ["", "turns", "deg,deg", "deg,up", "clockwise", "rad clockwise"])
def test_other_conventions_are_refused(text):
    with pytest.raises(TemplateError, match="deg or rad"):
        AngleConvention.parse(text)


@pytest.mark.parametrize("dtype", ["<f8", ">f4", "<i4", "<u2"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_arrays_of_every_type_and_order_are_read(dtype, order):
    array = np.array([[10, 20, 1, 50], [30, 40, 2, 100]], dtype, order=order)
    record = decoded(npy(array), "rad")
    minutiae = record.views[0].template.minutiae
    assert minutiae == Minutiae([10, 30], [20, 40], [1, 2], quality=[50, 100])
    assert (record.format, record.views[0].quality_known) == ("npy", True)
    np.testing.assert_array_equal(decode_npy(npy(array)), array)


@pytest.mark.parametrize("options", [{}, {"delimiter": ","}, {"fmt": "%.3f", "header": "made"}])
def test_what_savetxt_writes_is_read(options, tmp_path):
    path = tmp_path / "minutiae.txt"
    np.savetxt(path, np.array(ROWS), **options)
    record = decoded(path.read_bytes(), "rad", size=(60, 50))
    assert record.format == "numbers"
    template = record.views[0].template
    assert template.minutiae == Minutiae(*np.array(ROWS).T)
    assert (template.width, template.height) == (60, 50)


def test_whole_numbers_are_xyt_unless_a_convention_is_given():
    data = b"10 20 90\n30 40 200\n"
    assert decoded(data).format == "xyt"
    record = decoded(data, "deg")
    assert record.format == "numbers"
    assert record.views[0].template.minutiae.y.tolist() == [20, 40]


def test_plain_csv_is_a_table_with_one_header():
    record = sample_record(3)
    first, *lines = written("minutiae-csv", record).decode().splitlines()
    assert first == "x,y,theta,type,quality"
    minutiae = record.views[0].template.minutiae
    x, _, theta, kind, _ = zip(*(line.split(",") for line in lines), strict=True)
    assert [float(value) for value in x] == minutiae.x.tolist()
    degrees = np.degrees(minutiae.angle.astype(float)).tolist()
    assert [float(value) for value in theta] == pytest.approx(degrees, abs=1e-6)
    assert [*kind] == ["UEB"[kind] for kind in minutiae.kind.tolist()]
