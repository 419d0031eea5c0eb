"""Sealed templates: read back everywhere with the key, nowhere without it."""

import pytest

from fpmatch.base.encryption.key_text import add_key, make_keys, remove_key
from fpmatch.base.encryption.keys import load_keys
from fpmatch.base.encryption.records import seal
from fpmatch.errors import TemplateError
from fpmatch.formats.files import load_record, load_template, save_template
from fpmatch.formats.record import ReadingOptions
from fpmatch.gallery.listing.folders import prints_in
from fpmatch.prints.reading import PrintReader, content_of, decode_print


@pytest.fixture
def source(tmp_path, monkeypatch):
    source = f"file:{tmp_path / 'keys'}"
    make_keys(source)
    monkeypatch.setenv("FPMATCH_KEY", source)
    return source


@pytest.fixture
def sealed(tmp_path, source, template):
    path = tmp_path / "101_1.sealed"
    save_template(path, template)
    return path


def test_a_sealed_template_is_read_back_to_the_last_bit(sealed, template):
    assert load_template(sealed) == template
    assert load_record(sealed).format == "sealed"
    assert content_of(sealed) == "template"
    assert PrintReader()(sealed).views[0].template == template
    assert prints_in(sealed.parent) == [sealed]


def test_nothing_of_the_template_is_readable(sealed, tmp_path, template):
    save_template(tmp_path / "plain.json", template)
    plain, data = (tmp_path / "plain.json").read_bytes(), sealed.read_bytes()
    assert not any(plain[k : k + 12] in data for k in range(0, len(plain) - 12, 4))


def test_without_its_key_the_error_names_the_key(sealed, source, monkeypatch):
    first = load_keys().current.id
    add_key(source)
    assert load_template(sealed) is not None
    remove_key(source, first)
    with pytest.raises(TemplateError, match=rf"101_1\.sealed: .*{first}"):
        load_template(sealed)
    monkeypatch.delenv("FPMATCH_KEY")
    with pytest.raises(TemplateError, match=rf"{first}.*--key"):
        load_template(sealed)
    with pytest.raises(TemplateError, match="--key"):
        save_template(sealed.with_name("other.sealed"), None or load_empty())


def load_empty():
    from fpmatch.templates.minutiae import Minutiae, Template

    return Template(Minutiae(x=[1], y=[1], angle=[0]), 10, 10)


def test_every_flipped_byte_and_every_cut_is_one_error(sealed):
    data = sealed.read_bytes()
    step = 7  # a prime, so that each part is met
    for k in [*range(64), *range(64, len(data) - 64, step), *range(len(data) - 64, len(data))]:
        changed = bytearray(data)
        changed[k] ^= 1 + k % 255
        sealed.write_bytes(changed)
        with pytest.raises(TemplateError):
            load_template(sealed)
        sealed.write_bytes(data[:k])
        with pytest.raises(TemplateError):
            load_template(sealed)


def test_uploads_are_not_opened(sealed):
    with pytest.raises(TemplateError, match="not opened here"):
        decode_print(sealed.read_bytes(), "upload")


@pytest.mark.parametrize("content", [b"", b"[]", b'{"format": "x"}', b"\x89FPS\r\n\x1a\x01" * 9])
def test_what_is_sealed_must_be_a_template(tmp_path, source, content):
    path = tmp_path / "odd.sealed"
    path.write_bytes(seal(load_keys().current, content, purpose=b"template"))
    with pytest.raises(TemplateError):
        load_record(path, options=ReadingOptions())
