"""`fpmatch.formats`: what is saved is what is loaded, and nothing else gets in or stays behind."""

from __future__ import annotations

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
from fpmatch.formats.files import MAX_TEMPLATE_BYTES, load_template, save_template
from fpmatch.formats.registry import CODECS, codec_of_content
from fpmatch.minutiae import Minutiae, RidgeField, Template

SUFFIXES = [codec.suffix for codec in CODECS]
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
    field = RidgeField(draw(st.floats(1, 64)), orientation, draw(hnp.arrays(bool, shape)))
    return Template(
        minutiae,
        draw(st.integers(1, 9999)),
        draw(st.integers(1, 9999)),
        draw(st.floats(100, 4000)),
        draw(st.sampled_from([None, field])),
    )


@given(templates())
@pytest.mark.parametrize("codec", CODECS, ids=lambda codec: codec.name)
def test_minutiae_and_frame_come_back_to_the_last_bit(codec: Any, template: Template) -> None:
    again = codec_of_content(codec.encode(template)).decode(codec.encode(template))
    assert replace(again, field=None) == replace(template, field=None)
    assert codec.encode(again) == codec.encode(replace(template, field=again.field))


@given(templates())
def test_json_keeps_the_field_to_a_quantum_and_then_exactly(template: Template) -> None:
    codec = next(codec for codec in CODECS if codec.name == "json")
    once = codec.decode(codec.encode(template))
    assert codec.decode(codec.encode(once)) == once
    if template.field is None:
        assert once.field is None
        return
    assert once.field is not None
    assert np.array_equal(once.field.mask, template.field.mask)
    turn = 2 * (once.field.orientation - template.field.orientation)[template.field.mask]
    error = np.abs(np.angle(np.exp(1j * turn.astype(float)))) / 2
    assert (error <= np.pi / 512 + 1e-6).all()


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_saved_file_is_found_by_content_under_any_name(
    tmp_path: Path, template: Template, suffix: str
) -> None:
    saved = tmp_path / f"print{suffix.upper()}"
    save_template(saved, template)
    renamed = saved.rename(tmp_path / "no-suffix")
    assert load_template(renamed).minutiae == template.minutiae


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
    with pytest.raises(TemplateError, match=r"suffix '\.doc' \(known: \.csv, \.json\)"):
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
        ({"ridge_field.rows": 99}, "orientation has 552 bytes, expected 2376"),
        ({"ridge_field.mask": "////"}, "mask has 3 bytes, expected 69"),
        ({"ridge_field.mask": "no!"}, "mask is not base64"),
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


@given(st.binary(max_size=300), st.sampled_from([b"", b"{", b"# fpmatch-template 1 "]))
def test_arbitrary_bytes_are_refused_in_words(data: bytes, start: bytes) -> None:
    with pytest.raises(TemplateError):
        codec_of_content(start + data).decode(start + data)
