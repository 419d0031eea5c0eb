"""Points from CSV: every form that people write, and for all else the line and the reason."""

import csv
import io
import os

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from pointset_strategies import any_finite_points

from fpmatch.errors import PointSetError
from fpmatch.lab.points import points_csv
from fpmatch.lab.points.points_csv import DELIMITERS, decode_points, load_points
from fpmatch.printable import printable

TWO = [[1.5, 2.0], [-3.0, 400.0]]

names = st.text(max_size=5).filter(lambda name: name.strip().casefold() not in {"x", "y"})


@given(
    points=any_finite_points,
    delimiter=st.sampled_from(DELIMITERS),
    newline=st.sampled_from(["\n", "\r\n", "\r"]),
    encoding=st.sampled_from(["utf-8", "utf-8-sig"]),
    quoting=st.sampled_from([csv.QUOTE_ALL, csv.QUOTE_MINIMAL]),
    header=st.permutations(["X", " y "]),
    others=st.lists(names, max_size=2),
    text=st.text(max_size=5),
)
def test_what_is_written_is_read_to_the_last_bit(
    points, delimiter, newline, encoding, quoting, header, others, text
):
    stream = io.StringIO(newline="")
    writer = csv.writer(stream, delimiter=delimiter, lineterminator=newline, quoting=quoting)
    stream.write(f"# made by a test{newline}{newline}")
    columns = [*others, *header]
    columns[0] = columns[0].lstrip().removeprefix("#") or "name"  # else a comment, or blank
    writer.writerow(columns)
    for x, y in points.tolist():
        value = {"x": repr(x), "y": repr(y)}
        row = [*["a" + text] * len(others), *(value[name.strip().lower()] for name in header)]
        writer.writerow(row)
    read = decode_points(_encodable(stream.getvalue()).encode(encoding))
    assert read.shape == points.shape
    assert read.dtype == np.float64
    assert read.tobytes() == points.tobytes()


def _encodable(text):
    """Return text without NUL and lone surrogates, which no UTF-8 text file holds."""
    return text.encode("utf-8", "replace").decode().replace("\0", "0")


@given(any_finite_points.filter(len), st.sampled_from(DELIMITERS))
def test_two_columns_need_no_header(points, delimiter):
    lines = (f"{x!r}{delimiter}{y!r}\n" for x, y in points.tolist())
    assert decode_points("".join(lines).encode()).tobytes() == points.tobytes()


@pytest.mark.parametrize(
    "text",
    [
        "1.5,2\n-3,4e2",
        "x,y\n1.5,2\n-3,4e2\n",
        "﻿x,y\n1.5,2\n-3,4e2\n",
        "Y;X\n2;1.5\n4e2;-3\n",
        "name\tx\ty\nVega\t1.5\t2\n\t-3\t400\n",
        '"x","y"\r\n"1.5","2"\r\n"-3","4e2"\r\n',
        " x , y \n 1.5 , 2 \n -3 , 4e2 \n",
        "# made by hand\n\nx,y\n1.5,2\n  # between\n \t\n-3,4e2\n\n",
        "x,y,note\n1.5,2\n-3,400,\n",
        "x,y,,\n1.5,2,,\n,,,\n-3,400,,,,\n",
        'x,y,note\n1.5,2,"a; b, and\n\n# c, ""d"""\n-3,400,5 "\n',
        "+1.5,2.\n-3.0,4E+02\n",
        "x;y;note\n1.5;2;1,5\n-3;400;\n",
        "x;y\n1,5;2,0\n-3;4,0e2\n",
        "1,50\t2\n-3\t400,0\n",
        "1,5 2\n-3 400\n",
        "1.500e+00 2.000e+00\n-3.000e+00 4.000e+02\n",
        "# x y\n  1.5   2\n -3  400 \n",
        "x y\n1.5 2\n-3 400\n",
    ],
    ids=repr,
)
def test_every_form_of_the_same_points(text):
    assert decode_points(text.encode()).tolist() == TWO


def test_columns_of_other_names():
    table = b"x;RA ;y;dec\n0;1,5;0;2\n0;-3;0;400\n"
    assert decode_points(table, columns=("ra", "Dec")).tolist() == TWO
    for text, reason in (
        ("ra,x,y\n1,2,3\n", "line 1: expected a header with columns 'ra' and 'dec', separated"),
        ("1,2\n3,4\n", "line 1: expected a header with columns 'ra' and 'dec', separated"),
        ("ra,dec,ra\n1,2,3\n", "line 1: more than one column ra"),
        ("ra,dec\n1,b\n", "line 2: expected a number for dec, not 'b'"),
    ):
        with pytest.raises(PointSetError, match=reason):
            decode_points(text.encode(), columns=("ra", "dec"))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("x,y\n1,2\n\n# c\n3,abc\n", ", line 5: expected a number for y, not 'abc'"),
        ("x,y\rabc,1\r", ", line 2: expected a number for x, not 'abc'"),
        ("x,y\n1\n", ", line 2: expected a number for y, found nothing"),
        ("x,y\n1, \n", ", line 2: expected a number for y, found nothing"),
        ("y,name,x\n1,a\n", ", line 2: expected a number for x, found nothing"),
        ("x,y\n1,2,3\n", ", line 2: expected 2 values, found 3"),
        ("1,2\n3,4,5\n", ", line 2: expected 2 values, found 3"),
        ("1,2\n3,nan\n", ", line 2: expected a finite number for y, not 'nan'"),
        ("-inf,2\n3,4\n", ", line 1: expected a finite number for x, not '-inf'"),
        ("1,2\n3,1e999\n", ", line 2: expected a finite number for y, not '1e999'"),
        ('x,y\n"1,5",2\n', ", line 2: expected a number for x, not '1,5'; where commas separate"),
        ("x;y\n1,5;2.5\n", ", line 2: decimal commas and decimal points in one table"),
        ("x;y\n1,5;2\n3.5;2\n", ", line 3: decimal commas and decimal points in one table"),
        ("x;y\n1,500,2;2\n", ", line 2: expected a number for x, not '1,500,2'"),
        ("x,y\n1_0,2\n", ", line 2: expected a number for x, not '1_0'"),
        (f"x,y\n1,{'a' * 99}\n", f", line 2: expected a number for y, not '{'a' * 20}…'"),
        ('x,y,n\n1,2,"a\nb"\n3,d\n', ", line 4: expected a number for y, not 'd'"),
        ('x,y\n1,2\n"3,4\n5,6\n', ", line 3: malformed row"),
        ('x,y\n1,"2"3\n', ", line 2: malformed row"),
        (f'x,y\n1,2\n3,"{"4" * 200_000}"\n', ", line 3: malformed row"),
        ('"1,2\n', ", line 1: malformed row"),
        ("x,y,X\n1,2,3\n", ", line 1: more than one column x"),
        ("x,y,Y \n1,2,3\n", ", line 1: more than one column y"),
        ("\nlon,lat\n1,2\n", ", line 2: expected a header with columns x and y, or two numbers"),
        ("x,z\n1,2\n", "found 'x', 'z'"),
        ("1,2,3,4,5,6\n", "found '1', '2', '3', '4', '5', …"),
        ("1.0|2.0\n", "separated by comma, semicolon, tab or spaces; found '1.0|2.0'"),
        ("1;2,3.5\n", ", line 1: expected a header"),
        ("", ": the file is empty"),
        ("\n# a\n\n", ": no points, only blank lines and comments"),
    ],
)
def test_what_is_wrong_and_where(text, reason):
    with pytest.raises(PointSetError) as caught:
        decode_points(text.encode(), "stars.csv")
    assert str(caught.value).startswith("stars.csv")
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"x,y\r\n1,2\r\n\xe4,3\r\n", "stars.csv, line 3: not UTF-8 text (byte 0xe4)"),
        (b"x,y\n1,2\n\xc3", "stars.csv, line 3: not UTF-8 text (byte 0xc3)"),
        ("x,y\n1,2\n".encode("utf-16"), "stars.csv: text in UTF-16, not UTF-8"),
        (bytes(range(256)), "stars.csv: not a text file"),
        (b"\x89PNG\r\n\x1a\n\0\0", "stars.csv: not a text file"),
    ],
)
def test_what_is_no_text(data, reason):
    with pytest.raises(PointSetError) as caught:
        decode_points(data, "stars.csv")
    assert str(caught.value) == reason


@given(
    st.binary(max_size=60)
    | st.text("xyXY,;\t \"'#\n\r0123456789.+-einfa_\x0b\x85﻿", max_size=60).map(str.encode)
)
@example(b"x,y\n1,\xef\xbb\xbf2")
@example(b'"')
def test_any_bytes_are_points_or_refused_in_words(data):
    try:
        points = decode_points(data, "it")
    except PointSetError as error:
        assert str(error).startswith(("it: ", "it, line "))  # noqa: PT017
        assert "\n" not in str(error)  # noqa: PT017
    else:
        assert points.ndim == 2
        assert points.shape[1] == 2
        assert np.isfinite(points).all()


def test_files_and_pipes_are_read(tmp_path):
    path = tmp_path / "stars.csv"
    path.write_text("x,y\n1.5,2\n-3,4e2\n")
    assert load_points(path).tolist() == TWO
    assert load_points(str(path)).tolist() == TWO
    read_end, write_end = os.pipe()
    os.write(write_end, b"1.5,2\n-3,4e2\n")
    os.close(write_end)
    try:
        assert load_points(f"/dev/fd/{read_end}").tolist() == TWO
    finally:
        os.close(read_end)


def test_files_that_cannot_be_read(tmp_path):
    (tmp_path / "bad.csv").write_text("1,2\n3\n")
    for name, reason in {
        "": ": is a folder, not a file of points",
        "gone.csv": ": no such file",
        "bad.csv": ", line 2: expected a number for y, found nothing",
        "bad.csv/x": ": cannot be read: not a directory",
        "nul\0": ": cannot be read: embedded null byte",
    }.items():
        with pytest.raises(PointSetError) as caught:
            load_points(tmp_path / name)
        assert str(caught.value) == printable(f"{tmp_path / name}{reason}")


def test_absurdly_large_files_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(points_csv, "MAX_BYTES", 2**20)
    path = tmp_path / "large.csv"
    path.write_bytes(b"1,2\n" * 2**18 + b"\n")
    with pytest.raises(PointSetError, match="more than 1 MiB"):
        load_points(path)


@given(any_finite_points, st.sampled_from("CF"))
def test_an_array_of_numpy_is_read_to_the_last_bit(points, order):
    stream = io.BytesIO()
    np.save(stream, np.array(points, order=order))
    assert decode_points(stream.getvalue()).tobytes() == points.tobytes()


@given(any_finite_points.filter(len))
def test_a_text_of_numpy_is_read_to_the_last_bit(points):
    stream = io.BytesIO()
    np.savetxt(stream, points)
    assert decode_points(stream.getvalue()).tobytes() == points.tobytes()
