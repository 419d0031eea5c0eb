"""The audit of a server: an answer is sent when its event is stored, and only then."""

import pytest

from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.store.audit import audit_lines, check_audit, turn_on
from fpmatch.gallery.store.audit_chain import AuditError
from fpmatch.gallery.store.audit_log import AuditLog, check_audit_log
from fpmatch.server.settings import Client, Role, digest_of

from .conftest import served_gallery

TOKEN = "a-long-enough-token"


@pytest.fixture(scope="module")
def places(tmp_path_factory):
    """Return a log, and a gallery that keeps an audit."""
    folder = tmp_path_factory.mktemp("audit")
    with open_gallery(folder / "prints.db", create=True) as gallery:
        turn_on(gallery)
    return folder / "audit.jsonl", folder / "prints.db"


@pytest.fixture(scope="module")
def http(places):
    log, gallery = places
    clients = {digest_of(TOKEN): Client("ada", Role.ADMIN)}
    with served_gallery(gallery, audit_log=str(log), clients=clients) as client:
        client.headers["authorization"] = f"Bearer {TOKEN}"
        yield client


def enrol(http, picture, subject):
    files, data = {"image": ("a.png", picture)}, {"subject": subject, "impression": "1"}
    return http.post("/enrol", files=files, data=data)


def test_the_gallery_states_what_its_clients_did(http, prints, places):
    assert enrol(http, prints["1_1.png"], "ada").status_code == 201
    probe = {"probe": ("b.png", prints["1_2.png"])}
    assert http.post("/identify", files=probe).status_code == 200
    assert http.post("/gallery/verify", files=probe, data={"subject": "ada"}).status_code == 200
    assert http.post("/gallery/1/compare", files=probe).status_code == 200
    assert http.get("/gallery/prints", params={"subject": "ada"}).status_code == 200
    assert http.delete("/gallery/1").status_code == 200
    with open_gallery(places[1]) as gallery:
        text = b"".join(audit_lines(gallery)).decode()
        assert check_audit(gallery).events == 7
    actions = ["enrol", "identify", "verify", "compare", "list", "remove"]
    assert [text.count(f'"action": "{action}"') for action in actions] == [1] * 6
    assert text.count('"client": "ada"') == 6
    assert "score" not in text


def fail(*_):
    raise AuditError("cannot be written: no space left on device", path="/var/log/audit.jsonl")


def test_what_cannot_be_stored_is_not_done_nor_shown(http, prints, places, monkeypatch):
    enrolled = http.get("/gallery").json()["impressions"]
    with monkeypatch.context() as patched:
        patched.setattr(AuditLog, "append", fail)
        answers = [
            enrol(http, prints["2_1.png"], "eve"),
            http.delete("/gallery/2"),
            http.delete("/gallery/prints", params={"subject": "grace"}),
            http.post("/identify", files={"probe": ("b.png", prints["1_2.png"])}),
        ]
        assert http.get("/health").status_code == 200
    for answer in answers:
        assert answer.status_code == 503
        assert answer.json() == {"error": "the audit log cannot be written"}
        assert answer.headers["cache-control"] == "no-store"
    assert http.get("/gallery").json()["impressions"] == enrolled
    with open_gallery(places[1]) as gallery:
        check_audit(gallery)
    check_audit_log(places[0])
