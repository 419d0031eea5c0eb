"""Running a server: health, readiness, metrics, logs, and each request once."""

import io
import json
import logging
import re

import pytest

from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.store.audit import check_audit, events_of, switch
from fpmatch.server.settings import Client, Role, digest_of
from fpmatch.server.watch import set_up_logging

from .conftest import served_gallery, serving, wait_until

TOKEN = "a-long-enough-token"
GUEST = "another-long-enough-token"


@pytest.fixture(scope="module")
def gallery_place(tmp_path_factory):
    """Return a gallery that keeps an audit."""
    place = tmp_path_factory.mktemp("gallery") / "prints.db"
    with open_gallery(place, create=True) as gallery:
        switch(gallery, on=True)
    return place


@pytest.fixture(scope="module")
def http(gallery_place):
    clients = {digest_of(TOKEN): Client("ada", Role.ADMIN)}
    clients |= {digest_of(GUEST): Client("guest", Role.READ)}
    with served_gallery(gallery_place, clients=clients) as client:
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
    assert "fpmatch_requests_inside 1.0" in text


def test_a_print_is_enrolled_identified_claimed_listed_and_removed(http, prints, gallery_place):
    bearer = {"authorization": f"Bearer {TOKEN}"}

    def ask(method, path, picture=None, **data):
        files = {} if picture is None else {picture[0]: ("a.png", prints[picture[1]])}
        answer = http.request(method, path, headers=bearer, files=files, data=data)
        assert answer.is_success, answer.text
        return answer.json()

    enrolled = ask("POST", "/enrol", ("image", "1_1.png"), subject="ada", impression="1")
    assert enrolled["enrolled"]
    assert ask("GET", "/gallery")["impressions"] == 1
    identified = ask("POST", "/identify", ("probe", "1_2.png"))
    assert identified["candidates"][0]["subject"] == "ada"
    claim = ask("POST", "/gallery/verify", ("probe", "1_2.png"), subject="ada")
    assert (claim["match"], claim["best"]["impression"]) == (True, "1")
    (entry,) = ask("GET", "/gallery/prints?subject=ada")["prints"]
    assert ask("POST", f"/gallery/{entry['id']}/compare", ("probe", "1_2.png"))["result"]["match"]
    assert ask("DELETE", f"/gallery/{entry['id']}") == {"removed": 1}
    ask("POST", "/enrol", ("image", "2_1.png"), subject="eve")
    assert ask("DELETE", "/gallery/prints?subject=eve") == {"removed": 1}
    with open_gallery(gallery_place) as gallery:
        events = [event for _, _, event in events_of(gallery)]
        assert check_audit(gallery).events == len(events)
    text = json.dumps(events)
    actions = ["enrol", "identify", "verify", "compare", "list", "remove"]
    assert [text.count(f'"action": "{action}"') for action in actions] == [2, 1, 1, 1, 1, 2]
    assert text.count('"client": "ada"') == 8
    assert "score" not in text


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


def _lines_of(stream, *routes):
    """Return the lines of the access log about some routes; others may end late."""
    lines = [line for line in stream.getvalue().splitlines() if "fpmatch.access" in line]
    return [line for line in lines if any(route in line for route in routes)]


@pytest.mark.parametrize("form", ["text", "json"])
def test_requests_are_logged(http, form):
    root = logging.getLogger()
    kept = root.handlers[:], root.level
    stream = io.StringIO()
    try:
        set_up_logging(form, stream)
        http.get("/health")
        http.get("/about")
        wait_until(lambda: len(_lines_of(stream, "/health", "other")) == 2)
    finally:
        root.handlers[:], level = kept
        root.setLevel(level)
        logging.getLogger("fpmatch.access").setLevel(logging.NOTSET)
    lines = _lines_of(stream, "/health", "other")
    if form == "json":
        first, second = map(json.loads, lines)
        assert (first["route"], first["status"]) == ("/health", 200)
        assert (second["client"], second["status"]) == ("-", 401)
    else:
        assert "GET /health 200" in lines[0]
