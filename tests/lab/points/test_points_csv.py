"""Points from tables: what is written is read, and for all else the line and the reason."""

import csv
import io
import os

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from pointset_strategies import any_finite_points

from fpmatch.errors import FpmatchError, PointSetError
from fpmatch.lab.points import points_csv
from fpmatch.lab.points.points_csv import decode_table, load_table

TWO = [[1.5, 2.0], [-3.0, 400.0]]


@given(
    points=any_finite_points,
    delimiter=st.sampled_from(",\t "),
    newline=st.sampled_from(["\n", "\r\n", "\r"]),
    encoding=st.sampled_from(["utf-8", "utf-8-sig"]),
    header=st.permutations(["X", "y", "name"]),
)
def test_what_is_written_is_read_to_the_last_bit(points, delimiter, newline, encoding, header):
    stream = io.StringIO(newline="")
    writer = csv.writer(stream, delimiter=delimiter, lineterminator=newline)
    stream.write(f"# made by a test{newline}{newline}")
    writer.writerow(header)
    for k, (x, y) in enumerate(points.tolist()):
        value = {"X": repr(x), "y": repr(y), "name": f"star{k}"}
        writer.writerow([value[name] for name in header])
    table = decode_table(stream.getvalue().encode(encoding))
    assert table.points.shape == points.shape
    assert table.points.tobytes() == points.tobytes()
    assert table.names == [f"star{k}" for k in range(len(points))]


@given(any_finite_points.filter(len))
def test_what_numpy_writes_is_read_to_the_last_bit(points):
    text, array = io.BytesIO(), io.BytesIO()
    np.savetxt(text, points)
    np.save(array, np.asfortranarray(points))
    for stream in (text, array):
        table = decode_table(stream.getvalue())
        assert table.points.tobytes() == points.tobytes()
        assert not table.names


def test_quoted_cells_are_read():
    assert decode_table(b'"x","y",note\r\n"1.5",2,"a, ""b"""\r\n-3,"4e2",').points.tolist() == TWO


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"x,y\n1,2\n\n# c\n3,abc\n", "line 5: expected finite numbers for x and y"),
        (b"1,2\n3,nan\n", "line 2: expected finite numbers"),
        (b"1,2\n3,1e999\n", "line 2: expected finite numbers"),
        (b"x,y\n1_0,2\n", "line 2: expected finite numbers"),
        (b"x,y\n1,2,3\n", "line 2: expected 2 values, found 3"),
        (b"x,y\n1\n", "line 2: expected 2 values, found 1"),
        (b'x,y\n"3,4\n', "line 2: malformed row"),
        (b"x,y,X\n1,2,3\n", "line 1: expected a header with columns x and y or two numbers, sep"),
        (b"x;y\n1,5;2,5\n", "line 1: expected a header"),
        (b"1,2,3\n", "line 1: expected a header"),
        (b"\n# a\n\n", "no points"),
        ("x,y\n1,2\n".encode("utf-16"), "not a text in UTF-8"),
        (b"\x93NUMPY\x01", "a damaged .npy file"),
    ],
)
def test_what_is_wrong_and_where(tmp_path, data, reason):
    (tmp_path / "points").write_bytes(data)
    with pytest.raises(PointSetError) as caught:
        load_table(tmp_path / "points")
    assert str(caught.value).startswith(f"{tmp_path / 'points'}: {reason}")


@given(
    st.binary(max_size=60)
    | st.text("xyXY,;\t \"'#\n\r0123456789.+-einfa_\x0b\x85﻿", max_size=60).map(str.encode)
)
@example(b"x,y\n1,\xef\xbb\xbf2")
def test_any_bytes_are_points_or_refused_in_words(data):
    try:
        points = decode_table(data).points
    except FpmatchError as error:
        assert "\n" not in str(error)  # noqa: PT017
    else:
        assert points.shape[1:] == (2,)
        assert np.isfinite(points).all()


def test_pipes_are_read_and_what_is_no_file_is_refused_by_name(tmp_path, monkeypatch):
    read_end, write_end = os.pipe()
    os.write(write_end, b"1.5,2\n-3,4e2\n")
    os.close(write_end)
    assert load_table(f"/dev/fd/{read_end}").points.tolist() == TWO
    os.close(read_end)
    (tmp_path / "two.csv").write_text("1,2\n3,4\n")
    for name, reason in {
        "": "cannot be read: is a directory",
        "gone.csv": "cannot be read: no such file or directory",
        "two.csv/x": "cannot be read: not a directory",
    }.items():
        with pytest.raises(PointSetError) as caught:
            load_table(tmp_path / name)
        assert str(caught.value) == f"{tmp_path / name}: {reason}"
    monkeypatch.setattr(points_csv, "MAX_BYTES", 7)
    with pytest.raises(PointSetError, match="more than"):
        load_table(tmp_path / "two.csv")
