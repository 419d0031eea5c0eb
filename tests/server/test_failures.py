"""A gallery or database that fails while it is served: answers lead nowhere, the log has why."""

import shutil
import socket

import pytest

from fpmatch.server.settings import Client, Role, digest_of

from .conftest import served_gallery, serving, wait_until_ready

TOKEN = "a-long-enough-token"
BEARER = {"authorization": f"Bearer {TOKEN}"}
ADMIN = {digest_of(TOKEN): Client("ada", Role.ADMIN)}
LIBRARIES = ("sqlite", "psycopg", "traceback", "sqlalchemy", "errno", ".py", "connection refused")


def requests(prints):
    probe = {"probe": ("1_1.png", prints["1_1.png"])}
    image = {"image": ("1_1.png", prints["1_1.png"])}
    yield "GET", "/ready", {}
    yield "GET", "/gallery", {}
    yield "GET", "/gallery/prints?subject=1", {}
    yield "POST", "/identify", {"files": probe}
    yield "POST", "/gallery/verify", {"files": probe, "data": {"subject": "1"}}
    yield "POST", "/gallery/1/compare", {"files": probe}
    yield "POST", "/gallery/1/overlay", {"files": probe}
    yield "POST", "/enrol", {"files": image}
    yield "DELETE", "/gallery/1", {}
    yield "DELETE", "/gallery/prints?subject=1", {}
    yield "GET", "/about", {}
    yield "GET", "/metrics", {}


def check_answers(http, prints, secrets, log):
    """Request everything: no answer contains a secret, and the log has each failure."""
    failures = 0
    for method, path, parts in requests(prints):
        response = http.request(method, path, headers=BEARER, **parts)
        text = str(response.headers).lower()
        kind = response.headers.get("content-type", "")
        if not kind.startswith("image/"):  # pixels may read as words
            text += response.text.lower()
        for secret in (*secrets, *LIBRARIES):
            assert secret.lower() not in text, (path, text)
        if response.status_code >= 500:
            failures += 1
            number = response.json()["id"]
            assert number in response.json()["error"]
            assert number in log.text
    assert failures >= 8


def remove(gallery):
    gallery.unlink()


def replace_by_folder(gallery):
    gallery.unlink()
    gallery.mkdir()


def damage_header(gallery):
    gallery.write_bytes(b"SQLite format 3\0" + bytes(4096))


def overwrite_end(gallery):
    content = bytearray(gallery.read_bytes())
    content[100:] = b"\xa5" * (len(content) - 100)
    gallery.write_bytes(content)


def make_unreadable(gallery):
    gallery.chmod(0)
    if gallery.stat().st_uid == 0:  # root reads it nevertheless
        gallery.unlink()
        gallery.symlink_to(gallery)


@pytest.fixture(scope="module")
def running(tmp_path_factory, prints):
    gallery = tmp_path_factory.mktemp("a_secret_folder") / "prints.db"
    with served_gallery(gallery, clients=ADMIN) as http:
        files = {"image": ("1_1.png", prints["1_1.png"])}
        assert http.post("/enrol", headers=BEARER, files=files).status_code == 201
        shutil.copytree(gallery.parent, gallery.parent.with_name("copy"))
        yield http, gallery


@pytest.mark.parametrize(
    "break_it", [remove, replace_by_folder, damage_header, overwrite_end, make_unreadable]
)
def test_no_answer_says_where_a_gallery_is_or_how_it_failed(running, break_it, prints, caplog):
    http, gallery = running
    break_it(gallery)
    try:
        check_answers(http, prints, ("a_secret_folder", str(gallery.parent)), caplog)
    finally:
        shutil.rmtree(gallery) if gallery.is_dir() else gallery.unlink(missing_ok=True)
        shutil.rmtree(gallery.parent)
        shutil.copytree(gallery.parent.with_name("copy"), gallery.parent)
    wait_until_ready(http)


def test_no_answer_contains_the_place_of_a_database(prints, caplog):
    pytest.importorskip("psycopg", reason="the extra `postgres` is not installed")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    url = f"postgresql://olga:hidden-word@127.0.0.1:{port}/prints?application_name=inner"
    with serving(gallery=url, clients=ADMIN) as http:
        http.headers["host"] = "localhost"
        # no word of hexadecimal digits, which an id may contain
        secrets = (f":{port}", str(port), "127.0.0.1", "olga", "hidden-word", "inner")
        check_answers(http, prints, secrets, caplog)
    assert "hidden-word" not in caplog.text
