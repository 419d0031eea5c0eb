"""Readiness, and a gallery that does not answer: whoever needs none of it does not notice."""

import asyncio
import sqlite3
import threading
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
from anyio import to_thread
from pool_work import wait_for_sign

from fpmatch.errors import GalleryError
from fpmatch.server import app
from fpmatch.server import watch as readiness
from fpmatch.server.settings import Limits
from fpmatch.server.watch import Check

from .conftest import served_gallery, wait_until, wait_until_ready

READY_S = 3.0  # in which readiness is told, whatever hangs: two, and one for a busy machine
CLIENTS = 50


def codes(faults):
    return Counter("" if fault is None else fault.code for fault in faults)


class Looks:
    """What a check looks at: it hangs while `open` is not set, and fails with `fault` then."""

    def __init__(self):
        self.begun, self.open = 0, threading.Event()
        self.fault = None

    def __call__(self):
        self.begun += 1
        self.open.wait()
        if self.fault is not None:
            raise self.fault


def test_one_look_answers_all_who_ask_within_a_second(monkeypatch):
    looks = Looks()
    looks.open.set()
    check = Check("the gallery", lambda: to_thread.run_sync(looks))

    async def ask(times):
        return codes(await asyncio.gather(*(check.fault() for _ in range(times))))

    async def test():
        assert await ask(CLIENTS) == {"": CLIENTS}
        looks.fault = GalleryError("gone", code="missing")
        assert await ask(CLIENTS) == {"": CLIENTS}
        assert looks.begun == 1
        monkeypatch.setattr(readiness, "KEPT_S", 0.0)
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
def test_a_gallery_that_does_not_answer_holds_up_no_other_request(gallery, prints, monkeypatch):
    first, second = (("a.png", prints[name]) for name in ("1_1.png", "1_2.png"))
    with served_gallery(gallery) as http, ThreadPoolExecutor(CLIENTS) as clients:

        def verify():
            return http.post("/verify", files={"probe": first, "reference": second})

        def identify():
            return http.post("/identify", files={"probe": first})

        def ready():
            return http.get("/ready")

        assert [ask().status_code for ask in (identify, verify, ready)] == [200, 200, 200]
        monkeypatch.setattr(readiness, "KEPT_S", 60.0)  # the gallery is believed to answer
        with held(gallery):
            under_way = clients.submit(identify)
            assert timed(verify)[0] == 200
            assert not under_way.done()
            monkeypatch.undo()
            time.sleep(readiness.KEPT_S)
            asked = [clients.submit(timed, ready) for _ in range(CLIENTS - 1)]
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
    gallery, prints, monkeypatch, caplog
):
    monkeypatch.setattr(app, "make_index", wait_for_sign)
    monkeypatch.setattr(app, "_QUICK_S", 0.01)
    limits = Limits(wait_seconds=0.3)
    with served_gallery(gallery, workers=2, limits=limits) as http:

        def identify():
            return http.post("/identify", files={"probe": ("a.png", prints["1_1.png"])})

        refused = identify()
        assert refused.status_code == 503
        assert refused.json()["error"].startswith("the index of the gallery is being made")
        assert http.get("/gallery").status_code == 200
        assert "the index of the gallery is being made" in caplog.text
        Path(f"{gallery}.sign").touch()
        wait_until(lambda: identify().status_code == 200)
