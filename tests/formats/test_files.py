"""`fpmatch.formats`: what is saved is what is loaded, and nothing else gets in or stays behind."""

from __future__ import annotations

import base64
import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from fpmatch.errors import OutputError, TemplateError
from fpmatch.formats.codec import Codec
from fpmatch.formats.files import (
    MAX_TEMPLATE_BYTES,
    decode_record,
    is_of_minutiae_only,
    is_template_file,
    load_record,
    load_template,
    save_record,
    save_template,
)
from fpmatch.formats.record import ReadingOptions, ReadLimits, TemplateRecord, View
from fpmatch.formats.registry import CODECS, codec_of_content, codec_of_name
from fpmatch.matching.prepare import prepare
from fpmatch.minutiae import Minutiae, RidgeField, Template

OWN = [codec_of_name(name) for name in ("csv", "json")]
SUFFIXES = [codec.suffixes[0] for codec in CODECS if codec.encode is not None]
float32s = st.floats(-1e6, 1e6, width=32)


@st.composite
def templates(draw: st.DrawFn) -> Template:
    n = draw(st.integers(0, 12))

    def column(values: st.SearchStrategy[Any]) -> list[Any]:
        return draw(st.lists(values, min_size=n, max_size=n))

    minutiae = Minutiae(
        column(float32s),
        column(float32s),
        column(st.floats(0, 6.5, width=32)),
        column(st.integers(0, 2)),
        column(st.integers(0, 100)),
    )
    shape = draw(st.tuples(st.integers(1, 9), st.integers(1, 9)))
    orientation = draw(hnp.arrays(np.float32, shape, elements=st.floats(0, 3.125, width=32)))
    mask = draw(hnp.arrays(bool, shape))
    words = st.integers(0, 2**64 - 1)
    ridges = draw(st.none() | hnp.arrays(np.uint64, shape, elements=words))
    field = RidgeField(draw(st.floats(1, 64)), orientation, mask, ridges)
    return Template(
        minutiae,
        draw(st.integers(1, 9999)),
        draw(st.integers(1, 9999)),
        draw(st.floats(100, 4000)),
        draw(st.sampled_from([None, field])),
    )


def encode(codec: Codec, template: Template) -> bytes:
    assert codec.encode is not None
    return codec.encode(TemplateRecord("", (View(template),))).data


def decode(data: bytes) -> Template:
    return codec_of_content(data).decode(data, ReadingOptions()).views[0].template


@given(templates())
@pytest.mark.parametrize("codec", OWN, ids=lambda codec: codec.name)
def test_minutiae_and_frame_come_back_to_the_last_bit(codec: Codec, template: Template) -> None:
    again = decode(encode(codec, template))
    assert replace(again, field=None) == replace(template, field=None)
    assert encode(codec, again) == encode(codec, replace(template, field=again.field))


@given(templates())
def test_json_keeps_the_field_to_the_last_bit(template: Template) -> None:
    once = decode(encode(codec_of_name("json"), template))
    if template.field is None:
        assert once.field is None
        return
    assert once.field is not None
    mask = template.field.mask
    assert np.array_equal(once.field.mask, mask)
    assert np.array_equal(once.field.orientation[mask], template.field.orientation[mask])
    assert not once.field.orientation[~mask].any()
    assert (once.field.ridges is None) == (template.field.ridges is None)
    assert np.array_equal(once.field.ridges, template.field.ridges)


def test_json_wraps_an_orientation_beyond_half_a_turn() -> None:
    angles = np.array(
        [[0.0, -0.5, 3.5, np.nextafter(np.float32(np.pi), np.float32(0))]], np.float32
    )
    field = RidgeField(16.0, angles, np.ones(angles.shape, bool), None)
    again = decode(encode(codec_of_name("json"), Template(Minutiae.empty(), 9, 9, field=field)))
    assert again.field is not None
    found = again.field.orientation[0]
    assert found[[0, 3]].tolist() == angles[0, [0, 3]].tolist()
    assert found[1:3] == pytest.approx([np.pi - 0.5, 3.5 - np.pi], abs=1e-6)


def test_json_of_version_1_is_read() -> None:
    """Its orientation has a byte for every cell, 256 to half a turn."""
    mask = np.array([[True, False], [True, True]])
    field = RidgeField(16.0, np.zeros((2, 2), np.float32), mask, None)
    data = encode(codec_of_name("json"), Template(Minutiae.empty(), 9, 9, field=field))
    document = json.loads(data)
    assert document["version"] == 2
    document["version"] = 1
    document["ridge_field"]["orientation"] = base64.b64encode(bytes([0, 9, 64, 255])).decode()
    again = decode(json.dumps(document).encode()).field
    assert again is not None
    expected = np.array([0, 64, 255]) * np.pi / 256
    assert again.orientation[mask] == pytest.approx(expected, abs=1e-6)


@given(templates())
def test_what_json_keeps_is_compared_as_what_was_written(template: Template) -> None:
    again = decode(encode(codec_of_name("json"), template))
    assert prepare(again).key == prepare(template).key


def test_json_shows_the_rows_of_a_picture_one_after_the_other() -> None:
    """Of the cells inside the mask alone, the leftmost bit the lowest."""
    mask = np.array([[True, False, True]])
    ridges = np.array([[0x0807060504030201, 99, 1 << 63]], np.uint64)
    field = RidgeField(16.0, np.zeros((1, 3), np.float32), mask, ridges)
    data = encode(codec_of_name("json"), Template(Minutiae.empty(), 9, 9, field=field))
    stored = base64.b64decode(json.loads(data)["ridge_field"]["ridges"])
    assert stored == bytes([1, 2, 3, 4, 5, 6, 7, 8, 0, 0, 0, 0, 0, 0, 0, 128])
    assert decode(data).field == field


def test_json_without_ridges_does_not_mention_them(template: Template) -> None:
    assert b"ridges" not in encode(codec_of_name("json"), template)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_saved_file_is_found_by_content_under_any_name(
    tmp_path: Path, template: Template, suffix: str
) -> None:
    saved = tmp_path / f"print{suffix.upper()}"
    save_template(saved, template)
    renamed = saved.rename(tmp_path / "no-suffix")
    assert is_template_file(renamed)
    assert len(load_template(renamed).minutiae) == len(template.minutiae)


def test_bytes_are_read_as_the_file_is(tmp_path: Path, template: Template) -> None:
    path = tmp_path / "print.csv"
    save_template(path, template)
    data = path.read_bytes()
    assert decode_record(data, "sent").views == load_record(path).views
    assert is_of_minutiae_only(data)
    assert not is_of_minutiae_only(b"P5 60 50 255 ")
    with pytest.raises(TemplateError, match=r"^sent: the file is empty$"):
        decode_record(b"", "sent")


def test_csv_survives_a_spreadsheet(tmp_path: Path, template: Template) -> None:
    path = tmp_path / "print.csv"
    save_template(path, template)
    first, *rest = path.read_text().splitlines()
    path.write_bytes(("﻿" + "\r\n".join([first + ",,,,", *rest, ""])).encode())
    assert load_template(path) == replace(template, field=None)


def test_saving_leaves_one_file_and_replaces_it_whole(tmp_path: Path, template: Template) -> None:
    path = tmp_path / "print.json"
    path.write_text("an older file")
    save_template(path, template)
    assert [entry.name for entry in tmp_path.iterdir()] == ["print.json"]
    assert load_template(path).minutiae == template.minutiae


def test_saving_into_a_missing_folder_is_refused(tmp_path: Path, template: Template) -> None:
    with pytest.raises(OutputError, match=r"gone/print\.csv: cannot be written: no such file"):
        save_template(tmp_path / "gone" / "print.csv", template)


def test_saving_over_a_folder_leaves_nothing_half_written(
    tmp_path: Path, template: Template
) -> None:
    (tmp_path / "print.json").mkdir()
    with pytest.raises(OutputError, match="cannot be written"):
        save_template(tmp_path / "print.json", template)
    assert [entry.name for entry in tmp_path.iterdir()] == ["print.json"]


def test_an_unknown_suffix_is_refused(tmp_path: Path, template: Template) -> None:
    with pytest.raises(TemplateError, match=r"suffix '\.doc' \(known: \.csv, \.json, \.iso, "):
        save_template(tmp_path / "print.doc", template)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "the file is empty"),
        (b"hello\n", "not a template file of a known format"),
        (b"\x00" * 100, "not a template file of a known format"),
        (b"{", "not JSON"),
        (b'{"a": NaN}', "NaN is not a number"),
        (b'{"a": ' + b"[" * 100_000, "not JSON"),
        (b"{}", "expected the member"),
        (b'{"format": "fpmatch-template", "version": 9}', "unknown version"),
        (b"# fpmatch-template 9 width=9 height=9 dpi=500", "line 1: unknown version"),
        (b"# fpmatch-template 1 width=9 dpi=500", "line 1: expected width="),
        (b"# fpmatch-template 1 width=9 height=9 dpi=500", "line 1: expected the columns"),
        (b"# fpmatch-template 1 width=9 height=9 dpi=500\n\xff\xfe", "not UTF-8"),
        (b" " * (MAX_TEMPLATE_BYTES + 1), "too large"),
    ],
    ids=lambda value: repr(value[:30]) if isinstance(value, bytes) else None,
)
def test_a_bad_file_is_named_with_its_reason(tmp_path: Path, content: bytes, reason: str) -> None:
    path = tmp_path / "bad"
    path.write_bytes(content)
    with pytest.raises(TemplateError) as caught:
        load_template(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("row", "reason"),
    [
        ("1,2,3,ending", "line 3: expected 5 values, found 4"),
        ("1,2,3,loop,50", "line 3: unknown kind of minutia 'loop'"),
        ("1,2,three,ending,50", "line 3: could not convert string to float: 'three'"),
        ("nan,2,3,ending,50", "line 3: a value is not finite"),
        ("1e300,2,3,ending,50", "line 3: a value is not finite"),
        ("1,2,3,ending,101", "line 3: a value is not finite, or a quality not in 0..100"),
    ],
)
def test_a_bad_csv_line_is_named(tmp_path: Path, row: str, reason: str) -> None:
    path = tmp_path / "bad.csv"
    head = "# fpmatch-template 1 width=9 height=9 dpi=500\nx,y,angle_deg,kind,quality\n"
    path.write_text(f"{head}{row}\n")
    with pytest.raises(TemplateError) as caught:
        load_template(path)
    assert reason in str(caught.value)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"width": 0}, "size must be positive"),
        ({"width": True}, '"width" must be there and of type int'),
        ({"height": 3.5}, '"height" must be there and of type int'),
        ({"dpi": 30}, "outside the usable range"),
        ({"dpi": "500"}, '"dpi" must be a finite number'),
        ({"dpi": 10**400}, '"dpi" must be a finite number'),
        ({"minutiae": []}, '"minutiae" must be there and of type dict'),
        ({"minutiae.x": [1]}, "y has 30 values where x has 1"),
        ({"minutiae.x": [1e300] * 30}, "x must be a list of finite numbers"),
        ({"minutiae.kind": [3] * 30}, "kind must be 0"),
        ({"minutiae.quality": ["good"] * 30}, "quality must be a list of finite numbers"),
        ({"ridge_field.rows": -1}, "must be positive"),
        ({"ridge_field.rows": 99}, "mask has 69 bytes, expected 297"),
        ({"ridge_field.orientation": "AAAA"}, "orientation has 3 bytes, expected 1528"),
        ({"ridge_field.orientation": "//8=//8="}, "orientation is not base64"),
        pytest.param(
            {"ridge_field.orientation": base64.b64encode(b"\0\0\xc0\x7f" * 382).decode()},
            "orientation must lie from 0",
            id="no number",
        ),
        pytest.param(
            {"ridge_field.orientation": base64.b64encode(b"\0\0\0\x41" * 382).decode()},
            "orientation must lie from 0",
            id="eight radians",
        ),
        ({"ridge_field.mask": "////"}, "mask has 3 bytes, expected 69"),
        ({"ridge_field.mask": "no!"}, "mask is not base64"),
        ({"ridge_field.ridges": "AAAA"}, "ridges has 3 bytes, expected 3056"),
        ({"ridge_field.ridges": ""}, "ridges has 0 bytes, expected 3056"),
        ({"ridge_field.ridges": "no!"}, "ridges is not base64"),
        ({"ridge_field.ridges": "é"}, "ridges is not base64"),
        ({"ridge_field.ridges": None}, '"ridges" must be there and of type str'),
        ({"ridge_field.ridges": [1]}, '"ridges" must be there and of type str'),
        ({"ridge_field.step": 0}, "step must be a positive number"),
        ({"ridge_field": 3}, '"ridge_field" must be there and of type dict'),
    ],
    ids=str,
)
def test_a_bad_json_member_is_named(
    tmp_path: Path, template: Template, change: dict[str, Any], reason: str
) -> None:
    path = tmp_path / "bad.json"
    save_template(path, template)
    document = json.loads(path.read_text())
    for key, value in change.items():
        parent, _, child = key.rpartition(".")
        (document[parent] if parent else document)[child] = value
    path.write_text(json.dumps(document))
    with pytest.raises(TemplateError) as caught:
        load_template(path)
    assert reason in str(caught.value)


def test_a_folder_a_pipe_and_a_missing_file_are_no_templates(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    reasons = {"": "is a folder", "pipe": "not a regular file", "gone": "no such file"}
    for name, reason in reasons.items():
        with pytest.raises(TemplateError, match=reason):
            load_template(tmp_path / name)
        assert not is_template_file(tmp_path / name)


@given(st.binary(max_size=300), st.sampled_from([b"", b"{", b"# fpmatch-template 1 "]))
def test_arbitrary_bytes_are_refused_in_words(data: bytes, start: bytes) -> None:
    with pytest.raises(TemplateError):
        decode(start + data)


def test_what_a_format_loses_is_told(tmp_path: Path, template: Template) -> None:
    assert save_template(tmp_path / "print.json", template) == ()
    assert save_template(tmp_path / "print.csv", template) == ("the ridge field dropped",)


def test_a_format_may_be_named(tmp_path: Path, template: Template) -> None:
    path = tmp_path / "print.dat"
    save_template(path, template, file_format="iso2011")
    assert load_record(path).format == "iso2011"
    with pytest.raises(TemplateError, match=r"print\.dat: does not begin as a record"):
        load_record(path, file_format="iso2005")
    with pytest.raises(TemplateError, match="unknown template format 'iso' "):
        save_template(path, template, file_format="iso")


def test_a_format_that_is_only_read_is_not_written(tmp_path: Path, template: Template) -> None:
    with pytest.raises(TemplateError, match="type 9 is only read, not written"):
        save_template(tmp_path / "print.an2", template, file_format="an2")
    assert not list(tmp_path.iterdir())


def test_a_print_that_a_format_cannot_hold_leaves_no_file(tmp_path: Path) -> None:
    two = TemplateRecord("", (View(Template(Minutiae.empty(), 9, 9)),) * 2)
    with pytest.raises(TemplateError, match=r"print\.csv: the format holds one print a file"):
        save_record(tmp_path / "print.csv", two)
    assert not list(tmp_path.iterdir())


def test_limits_are_parameters(tmp_path: Path, template: Template) -> None:
    path = tmp_path / "print.iso"
    save_template(path, template)
    with pytest.raises(TemplateError, match="more than 29 minutiae"):
        load_record(path, options=ReadingOptions(limits=ReadLimits(max_minutiae=29)))
    with pytest.raises(TemplateError, match="too large for a template file"):
        load_record(path, options=ReadingOptions(limits=ReadLimits(max_bytes=10)))


@pytest.mark.parametrize(
    "content", [b"", b"\x89PNG\r\n\x1a\n", b"II*\x00", b"P5 9 9 255\n", b"hello"]
)
def test_images_and_other_files_are_no_templates(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "other").write_bytes(content)
    assert not is_template_file(tmp_path / "other")


def test_a_record_of_an_unknown_version_is_a_template_still(tmp_path: Path) -> None:
    (tmp_path / "other").write_bytes(b"FMR\x00 99\x00" + bytes(30))
    assert is_template_file(tmp_path / "other")
    with pytest.raises(TemplateError, match="of version '99', which is not known"):
        load_template(tmp_path / "other")
