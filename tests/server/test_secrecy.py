"""A gallery, database or plug-in that fails while it is served: only the log says where and why.

That no answer names a folder of the server, `conftest.check_answer` checks of all answers.
"""

import shutil
import socket
import sys

import pytest

from fpmatch.base.plugins import forget_plugins
from fpmatch.server import watch
from fpmatch.server.settings import Role

from .conftest import bearer, clients, serving, wait_until_ready

LIBRARIES = ("sqlite", "psycopg", "traceback", "sqlalchemy", "errno", "connection refused")


@pytest.fixture(autouse=True)
def patience(monkeypatch):
    """Let checks take long on a busy machine: here they are to fail, not to be late."""
    monkeypatch.setattr(watch, "CHECK_S", 60.0)


def check_answers(http, sent, log, *secrets):
    """Request everything of the gallery: no answer contains a secret, the log has each failure."""
    probe, image, failures = sent(probe="1_1.png"), sent(image="1_1.png"), 0
    for method, path, parts in (
        ("GET", "/ready", {}),
        ("GET", "/gallery", {}),
        ("GET", "/gallery/prints?subject=1", {}),
        ("POST", "/identify", {"files": probe}),
        ("POST", "/gallery/verify", {"files": probe, "data": {"subject": "1"}}),
        ("POST", "/gallery/1/compare", {"files": probe}),
        ("POST", "/enrol", {"files": image}),
        ("DELETE", "/gallery/1", {}),
        ("DELETE", "/gallery/prints?subject=1", {}),
        ("GET", "/about", {}),
        ("GET", "/metrics", {}),
    ):
        response = http.request(method, path, headers=bearer(Role.ADMIN), **parts)
        text = f"{response.headers}{response.text}".lower()
        for secret in (*secrets, *LIBRARIES):
            assert secret.lower() not in text, (path, text)
        if response.status_code >= 500:
            failures += 1
            number = response.json()["id"]
            assert number in response.json()["error"]
            assert number in log.text
    assert failures >= 7
    assert http.get("/health").status_code == 200


def remove(gallery):
    gallery.unlink()


def overwrite_end(gallery):
    content = bytearray(gallery.read_bytes())
    content[100:] = b"\xa5" * (len(content) - 100)
    gallery.write_bytes(content)


@pytest.fixture(scope="module")
def running(tmp_path_factory, sent):
    gallery = tmp_path_factory.mktemp("a_secret_folder") / "prints.db"
    with serving(gallery=gallery, clients=clients()) as http:
        answer = http.post("/enrol", headers=bearer(Role.ADMIN), files=sent(image="1_1.png"))
        assert answer.status_code == 201
        shutil.copytree(gallery.parent, gallery.parent.with_name("copy"))
        yield http, gallery


@pytest.mark.parametrize("break_it", [remove, overwrite_end])
def test_no_answer_says_where_a_gallery_is_or_how_it_failed(running, break_it, sent, caplog):
    http, gallery = running
    break_it(gallery)
    try:
        check_answers(http, sent, caplog, "a_secret_folder")
    finally:
        shutil.rmtree(gallery.parent)
        shutil.copytree(gallery.parent.with_name("copy"), gallery.parent)
    wait_until_ready(http)


def test_no_answer_contains_the_place_of_a_database(sent, caplog):
    pytest.importorskip("psycopg", reason="the extra `postgres` is not installed")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    url = f"postgresql://olga:hidden-word@127.0.0.1:{port}/prints?application_name=inner"
    with serving(gallery=url, clients=clients()) as http:
        http.headers["host"] = "localhost"
        # no word of hexadecimal digits, which an id may contain
        secrets = (f":{port}", str(port), "127.0.0.1", "olga", "hidden-word", "inner")
        check_answers(http, sent, caplog, *secrets)
    assert "hidden-word" not in caplog.text


def test_a_plug_in_that_cannot_be_loaded_is_named_in_the_log_only(
    tmp_path, sent, monkeypatch, caplog
):
    info = tmp_path / "broken-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: broken\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[fpmatch.matchers]\nbroken = broken:THING\n")
    (tmp_path / "broken.py").write_text("open(__file__ + '.model')\n")
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    forget_plugins()
    try:
        with serving() as http:
            pair = sent(probe="1_1.png", reference="1_1.png")
            answer = http.post("/verify", files=pair, data={"matcher": "broken"})
    finally:
        forget_plugins()
    assert answer.status_code == 500
    why = "a matcher or format of another package cannot be loaded"
    assert answer.json()["error"].startswith(why)
    assert answer.json()["id"] in caplog.text
    assert str(tmp_path) in caplog.text
