"""`fpmatch.formats`: what is saved is what is loaded, and nothing else gets in or stays behind."""

import base64
import json
import os
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given

from fpmatch.errors import OutputError, TemplateError
from fpmatch.formats.files import (
    decode_record,
    load_record,
    load_template,
    save_record,
    save_template,
)
from fpmatch.formats.registry import codec_of_name
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.prints.reading import content_of
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template
from tests.formats.made_records import WRITTEN, only_view, record_of, written
from tests.matching.matching_prints import templates

SUFFIXES = [codec_of_name(name).suffixes[0] for name in WRITTEN]


# a field of no cells is not written
templates_with_cells = templates().filter(lambda one: one.field is None or one.field.mask.size)


def field_template(orientation, mask, ridges=None):
    field = RidgeField(16.0, np.array(orientation, np.float32), np.array(mask, bool), ridges)
    return Template(Minutiae.empty(), 9, 9, field=field)


@given(templates_with_cells)
@pytest.mark.parametrize("name", ["csv", "json"])
def test_a_template_comes_back_to_the_last_bit(name, template):
    """Also that nothing states its resolution; the field, which JSON keeps, inside its mask."""
    unstated = replace(template, dpi_known=False)
    known, unknown = (written(name, record_of(one)) for one in (template, unstated))
    assert [b"dpi_known" in data for data in (known, unknown)] == [False, True]
    assert [only_view(data).dpi_known for data in (known, unknown)] == [True, False]
    assert only_view(unknown).at(500).dpi_known
    once = only_view(known).template
    assert replace(once, field=None) == replace(template, field=None)
    assert (once.field is None) == (name == "csv" or template.field is None)
    if once.field is not None:
        assert MATCHER.prepare(once).key == MATCHER.prepare(template).key
        mask = template.field.mask
        assert np.array_equal(once.field.orientation[mask], template.field.orientation[mask])
        assert not once.field.orientation[~mask].any()
        assert once.field == template.field


def test_json_wraps_an_orientation_beyond_half_a_turn():
    angles = [0.0, -0.5, 3.5, np.nextafter(np.float32(np.pi), np.float32(0))]
    again = only_view(written("json", record_of(field_template([angles], [[1] * 4]))))
    assert again.template.field.orientation[0] == pytest.approx(
        [0.0, np.pi - 0.5, 3.5 - np.pi, angles[3]], abs=1e-6
    )


def test_json_shows_the_rows_of_a_picture_one_after_the_other(template):
    """Of the cells inside the mask alone, the leftmost bit the lowest."""
    ridges = np.array([[0x0807060504030201, 99, 1 << 63]], np.uint64)
    made = field_template([[0, 0, 0]], [[True, False, True]], ridges)
    data = written("json", record_of(made))
    stored = base64.b64decode(json.loads(data)["ridge_field"]["ridges"])
    assert stored == bytes([1, 2, 3, 4, 5, 6, 7, 8, 0, 0, 0, 0, 0, 0, 0, 128])
    assert only_view(data).template.field == made.field
    assert b"ridges" not in written("json", record_of(template))  # which has none


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_saved_file_is_found_by_content_under_any_name(tmp_path, template, suffix):
    saved = tmp_path / f"print{suffix.upper()}"
    save_template(saved, template)
    renamed = saved.rename(tmp_path / "no-suffix")
    assert content_of(renamed) == "template"
    assert len(load_template(renamed).minutiae) == len(template.minutiae)
    assert decode_record(renamed.read_bytes(), "sent").views == load_record(renamed).views
    assert content_of(renamed.read_bytes()) == "template"


def test_csv_survives_a_spreadsheet(tmp_path, template):
    path = tmp_path / "print.csv"
    save_template(path, template)
    first, *rest = path.read_text().splitlines()
    path.write_bytes(("\ufeff" + "\r\n".join([first + ",,,,", *rest, ""])).encode())
    assert load_template(path) == replace(template, field=None)


def test_saving_leaves_one_file_and_replaces_it_whole(tmp_path, template):
    path = tmp_path / "print.json"
    path.write_text("an older file")
    assert save_template(path, template) == ()
    assert [entry.name for entry in tmp_path.iterdir()] == ["print.json"]
    assert load_template(path).minutiae == template.minutiae
    assert save_template(tmp_path / "print.csv", template) == ("the ridge field dropped",)


def test_what_cannot_be_saved_leaves_nothing_behind(tmp_path, template):
    (tmp_path / "folder.json").mkdir()
    with pytest.raises(OutputError, match="cannot be written"):
        save_template(tmp_path / "folder.json", template)
    with pytest.raises(OutputError, match=r"null/print\.csv: "):
        save_template("/dev/null/print.csv", template)
    with pytest.raises(TemplateError, match=r"'\.doc' \(known: \.csv, "):
        save_template(tmp_path / "print.doc", template)
    with pytest.raises(TemplateError, match="'iso'; known: "):
        save_template(tmp_path / "print.dat", template, file_format="iso")
    for name in ("an2", "iso2011"):
        with pytest.raises(TemplateError, match="only read"):
            save_template(tmp_path / f"print.{name}", template, file_format=name)
    two = record_of(*[Template(Minutiae.empty(), 9, 9)] * 2)
    with pytest.raises(TemplateError, match=r"print\.csv: .*one print"):
        save_record(tmp_path / "print.csv", two)
    assert [entry.name for entry in tmp_path.iterdir()] == ["folder.json"]


def test_a_format_may_be_named(tmp_path, template):
    path = tmp_path / "print.dat"
    save_template(path, template, file_format="ansi2004")
    assert load_record(path).format == "ansi2004"
    with pytest.raises(TemplateError, match=r"print\.dat: "):
        load_record(path, file_format="iso2005")


def test_what_is_no_template_is_named(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    reasons = {"": "is a folder", "pipe": "not a regular file", "gone": "no such file"}
    for name, reason in reasons.items():
        with pytest.raises(TemplateError, match=reason):
            load_template(tmp_path / name)
        assert content_of(tmp_path / name) in {"", "image"}
    for content in (b"", b"\x89PNG\r\n\x1a\n", b"II*\x00", b"P5 9 9 255\n", b"hello"):
        assert content_of(content) in {"", "image"}
    assert content_of(b"FMR\x00 99\x00" + bytes(30)) == "template"  # of an unknown version
