"""State of a server: health, readiness, metrics, logs; a gallery that does not answer."""

import asyncio
import io
import json
import logging
import sqlite3
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
from anyio import to_thread
from pool_work import wait_for_sign

from fpmatch.errors import GalleryError
from fpmatch.server import app, watch
from fpmatch.server.settings import Limits
from fpmatch.server.watch import Check, set_up_logging

from .conftest import serving, wait_until, wait_until_ready

READY_S = 3.0  # in which readiness is told, whatever hangs: two, and one for a busy machine
CLIENTS = 50


def test_health_readiness_and_metrics(server):
    assert server.get("/health", headers={"authorization": ""}).json() == {"status": "ok"}
    assert server.get("/ready", headers={"authorization": ""}).json() == {"status": "ready"}
    text = server.get("/metrics").text
    assert 'fpmatch_requests_total{route="/health",status="200"}' in text
    assert "fpmatch_request_seconds_bucket" in text
    assert "fpmatch_requests_inside 1.0" in text


def test_requests_are_logged(server):
    root = logging.getLogger()
    kept, stream = (root.handlers[:], root.level), io.StringIO()

    def lines():  # others may end late
        access = [line for line in stream.getvalue().splitlines() if "fpmatch.access" in line]
        return [line for line in access if "/health" in line or "other" in line]

    try:
        set_up_logging("json", stream)
        server.get("/health")
        server.get("/about", headers={"authorization": ""})
        wait_until(lambda: len(lines()) == 2)
    finally:
        root.handlers[:], level = kept
        root.setLevel(level)
        logging.getLogger("fpmatch.access").setLevel(logging.NOTSET)
    first, second = map(json.loads, lines())
    assert (first["route"], first["status"], first["client"]) == ("/health", 200, "admin")
    assert first["message"].startswith("127.0.0.1 admin GET /health 200 ")
    assert (second["client"], second["status"]) == ("-", 401)


def test_one_look_answers_all_who_ask_within_a_second(monkeypatch):
    begun, fault = [], []

    def look():
        begun.append(1)
        if fault:
            raise fault[0]

    check = Check("the gallery", lambda: to_thread.run_sync(look))

    async def ask(times):
        faults = await asyncio.gather(*(check.fault() for _ in range(times)))
        return Counter("" if fault is None else fault.code for fault in faults)

    async def test():
        assert await ask(CLIENTS) == {"": CLIENTS}
        fault.append(GalleryError("gone", code="missing"))
        assert await ask(CLIENTS) == {"": CLIENTS}
        assert len(begun) == 1
        monkeypatch.setattr(watch, "KEPT_S", 0.0)
        assert await ask(1) == {"missing": 1}

    asyncio.run(test())


@contextmanager
def held(gallery):
    """Hold the file of a gallery, so that nobody can read it."""
    with closing(sqlite3.connect(gallery, timeout=60, isolation_level=None)) as other:
        other.execute("BEGIN EXCLUSIVE")
        yield


def timed(request):
    start = time.monotonic()
    return request().status_code, time.monotonic() - start


@pytest.mark.slow
def test_a_gallery_that_does_not_answer_holds_up_no_other_request(gallery, sent, monkeypatch):
    with serving(gallery=gallery) as http, ThreadPoolExecutor(CLIENTS) as others:

        def verify():
            return http.post("/verify", files=sent(probe="1_1.png", reference="1_2.png"))

        def identify():
            return http.post("/identify", files=sent(probe="1_1.png"))

        def ready():
            return http.get("/ready")

        assert [ask().status_code for ask in (identify, verify, ready)] == [200, 200, 200]
        monkeypatch.setattr(watch, "KEPT_S", 60.0)  # the gallery is believed to answer
        with held(gallery):
            under_way = others.submit(identify)
            assert timed(verify)[0] == 200
            assert not under_way.done()
            monkeypatch.undo()
            time.sleep(watch.KEPT_S)
            asked = [others.submit(timed, ready) for _ in range(CLIENTS - 1)]
            assert timed(verify)[0] == 200
            outcomes = [one.result() for one in asked]
            assert {status for status, _ in outcomes} == {503}
            assert max(seconds for _, seconds in outcomes) < READY_S
            refused = identify()
            assert refused.status_code == 503
            assert refused.headers["retry-after"]
            assert refused.json() == {"error": "the gallery does not answer: try again shortly"}
        assert under_way.result().status_code in {200, 503}
        wait_until_ready(http)
        assert identify().status_code == 200


def test_a_search_waits_for_the_index_that_is_made_when_the_server_starts(
    gallery, sent, monkeypatch, caplog
):
    monkeypatch.setattr(app, "make_index", wait_for_sign)
    monkeypatch.setattr(app, "_QUICK_S", 0.01)
    with serving(gallery=gallery, workers=2, limits=Limits(wait_seconds=0.3)) as http:

        def identify():
            return http.post("/identify", files=sent(probe="1_1.png"))

        refused = identify()
        assert refused.status_code == 503
        assert refused.json()["error"].startswith("the index of the gallery is being made")
        assert http.get("/gallery").status_code == 200
        assert "the index of the gallery is being made" in caplog.text
        Path(f"{gallery}.sign").touch()
        wait_until(lambda: identify().status_code == 200)
