"""Running a server: health, readiness, metrics, logs, the queue, and the client."""

import io
import json
import logging
import re

import pytest

from fpmatch.errors import FpmatchError
from fpmatch.server.client import ServerClient, ServerError
from fpmatch.server.logs import set_up_logging
from fpmatch.server.settings import Client, Role, digest_of

from .conftest import served_gallery, serving

TOKEN = "a-long-enough-token"
GUEST = "another-long-enough-token"


@pytest.fixture(scope="module")
def audit_log(tmp_path_factory):
    return tmp_path_factory.mktemp("audit") / "audit.jsonl"


@pytest.fixture(scope="module")
def http(tmp_path_factory, audit_log):
    gallery = tmp_path_factory.mktemp("gallery") / "prints.db"
    clients = {digest_of(TOKEN): Client("ada", Role.ADMIN)}
    clients |= {digest_of(GUEST): Client("guest", Role.READ)}
    with served_gallery(gallery, audit_log=str(audit_log), clients=clients) as client:
        yield client


@pytest.fixture(scope="module")
def server(http):
    with ServerClient(f"{http.base_url}#token={TOKEN}") as client:
        yield client


def test_health_and_readiness_need_no_token(http):
    assert http.get("/health").json() == {"status": "ok"}
    assert http.get("/ready").json() == {"status": "ready"}


def test_a_server_whose_gallery_cannot_be_opened_is_not_ready(tmp_path):
    (tmp_path / "prints.db").write_bytes(b"no database" * 100)
    with serving(gallery=str(tmp_path / "prints.db")) as client:
        response = client.get("/ready")
        assert response.status_code == 503
        assert str(tmp_path) not in response.text
        assert client.get("/health").status_code == 200


def test_metrics_count_requests(http):
    bearer = {"authorization": f"Bearer {TOKEN}"}
    http.get("/health")
    assert http.get("/metrics").status_code == 401
    text = http.get("/metrics", headers=bearer).text
    assert 'fpmatch_requests_total{route="/health",status="200"}' in text
    assert "fpmatch_request_seconds_bucket" in text
    assert "fpmatch_requests_waiting 0.0" in text


def test_the_client_does_all_that_the_server_does(server, prints, tmp_path, audit_log):
    probe, reference = prints["1_1.png"], prints["1_2.png"]
    other = tmp_path / "2_1.png"
    other.write_bytes(prints["2_1.png"])
    assert server.about()["gallery"] == "prints.db"
    assert server.verify(probe, reference)["match"]
    assert not server.verify(probe, other)["match"]
    assert server.overlay(probe, reference).startswith(b"\x89PNG")
    assert len(server.extract(probe).minutiae) > 5

    assert server.enrol(probe, "ada", impression="1")["enrolled"]
    assert server.enrol(other)["subject"] == "2"
    assert not server.enrol(probe, "ada", impression="1")["enrolled"]
    assert server.gallery()["impressions"] == 2
    assert server.identify(reference)["candidates"][0]["subject"] == "ada"
    claim = server.verify_claim(reference, "ada")
    assert claim["match"]
    assert claim["best"]["impression"] == "1"
    assert not server.verify_claim(reference, "2")["match"]

    (enrolled,) = server.prints("ada")
    assert enrolled["minutiae"] > 5
    server.remove(enrolled["id"])
    assert server.prints("ada") == []
    assert server.remove_subject("2") == 1
    assert server.gallery()["impressions"] == 0

    events = [json.loads(line) for line in audit_log.read_bytes().splitlines()]
    assert {event["client"] for event in events} == {"ada"}
    actions = [event["action"] for event in events]
    assert actions.count("POST /verify") == 2
    found = next(event for event in events if event["action"] == "POST /identify")
    assert found["candidates"][0] == enrolled["id"]
    begun, removal = (event for event in events if event["action"] == "DELETE /gallery/{number}")
    assert begun["begun"]
    assert begun["request"] == removal["request"]
    assert (removal["status"], removal["entries"]) == (200, [enrolled["id"]])
    assert "iVBOR" not in audit_log.read_text()
    assert all(len(line) < 1000 for line in audit_log.read_text().splitlines())


def test_a_case_report_contains_notes_and_marks(http, prints):
    files = {side: (f"{side}.png", prints["1_1.png"]) for side in ("probe", "reference")}
    bearer = {"authorization": f"Bearer {TOKEN}"}
    marks = json.dumps([{"side": "probe", "x": 10, "y": 20, "note": "a scar"}] * 2)
    data = {"notes": "seen <twice>\r\nand so on", "marks": marks, "case_number": "2026-17"}
    response = http.post("/case-report", files=files, data=data, headers=bearer)
    assert response.headers["content-type"].startswith("text/html")
    assert "a scar" in response.text
    assert "seen &lt;twice&gt;\nand so on" in response.text
    assert re.findall(r"<tr><td><b>(\w)</b>", response.text) == ["A", "B"]
    assert "<title>Case 2026-17: " in response.text
    long = http.post("/case-report", files=files, data={"notes": "a\r\n" * 33_000}, headers=bearer)
    assert long.text.count("\na") >= 32_999
    for name, value in (("case_number", "7" * 61), ("notes", "x" * 200_001)):
        refused = http.post("/case-report", files=files, data={name: value}, headers=bearer)
        assert refused.status_code == 422
        assert name in refused.json()["error"]
    for bad in ("{", "{}", '[{"side": "left", "x": 0, "y": 0}]', '[{"side": "probe", "x": NaN}]'):
        refused = http.post("/case-report", files=files, data={"marks": bad}, headers=bearer)
        assert refused.status_code == 422
        assert "marks" in refused.json()["error"]
    far = '[{"side": "probe", "x": 1e300, "y": 0}]'
    refused = http.post("/case-report", files=files, data={"marks": far}, headers=bearer)
    assert refused.status_code == 422
    assert "within 1,000,000 pixels" in refused.json()["error"]


def test_files_that_are_missing_and_servers_that_are_down_are_named(tmp_path):
    with ServerClient("http://127.0.0.1:9") as client:
        with pytest.raises(ServerError, match="no answer") as caught:
            client.about()
        assert caught.value.status == 0
        with pytest.raises(FpmatchError, match=r"missing\.png"):
            client.verify(tmp_path / "missing.png", b"")


@pytest.mark.parametrize("form", ["text", "json"])
def test_requests_are_logged(http, form):
    root = logging.getLogger()
    kept = root.handlers[:], root.level
    stream = io.StringIO()
    try:
        set_up_logging(form, stream)
        http.get("/health")
        http.get("/about")
    finally:
        root.handlers[:], level = kept
        root.setLevel(level)
        logging.getLogger("fpmatch.access").setLevel(logging.NOTSET)
    lines = [line for line in stream.getvalue().splitlines() if "fpmatch.access" in line]
    assert len(lines) == 2
    if form == "json":
        first, second = map(json.loads, lines)
        assert (first["route"], first["status"]) == ("/health", 200)
        assert (second["client"], second["status"]) == ("-", 401)
    else:
        assert "GET /health 200" in lines[0]
