"""A server of an encrypted gallery: with its key as any other, without it one sentence."""

import pytest

from fpmatch.gallery.encryption.keys import load_keys, make_keys
from fpmatch.gallery.gallery import open_gallery

from .conftest import serving


@pytest.fixture
def source(tmp_path, gallery):
    source = make_keys(f"file:{tmp_path / 'secret-keys'}").source
    open_gallery(gallery, create=True, key=source, encrypt=True).close()
    return source


def test_a_server_with_the_key_enrols_and_searches(source, gallery, prints, monkeypatch):
    monkeypatch.setenv("FPMATCH_KEY", source)
    with serving(gallery=str(gallery)) as http:
        files = {"image": ("1_1.png", prints["1_1.png"])}
        assert http.post("/enrol", files=files).status_code == 201
        found = http.post("/identify", files={"probe": ("b.png", prints["1_2.png"])}).json()
        assert found["candidates"][0]["subject"] == "1"
        info = http.get("/gallery").json()
    assert info["keys"] == list(load_keys(source).ids)
    with open_gallery(gallery, key=source) as opened:
        assert len(list(opened.templates())) == 1
        ((_, template),) = opened.packed_templates()
    assert template not in gallery.read_bytes()


@pytest.mark.parametrize("given", ["", "file:/nowhere/secret-keys"])
def test_a_server_without_the_key_says_no_more_than_that(
    source, gallery, prints, monkeypatch, given
):
    with open_gallery(gallery, key=source) as opened:
        key_id = opened.sealing().key_id
    monkeypatch.setenv("FPMATCH_KEY", given)
    with serving(gallery=str(gallery)) as http:
        files = {"image": ("1_1.png", prints["1_1.png"])}
        refused = http.post("/enrol", files=files)
    assert refused.status_code == 500
    why = "the gallery is encrypted, and the server has not its key: the log"
    assert refused.json()["error"].startswith(why)
    assert not any(word in refused.text for word in (key_id, "secret-keys", "nowhere"))
