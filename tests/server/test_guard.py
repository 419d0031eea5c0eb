"""Who may ask: hosts, origins, tokens, sizes, how many at once; and the headers of safety."""

import asyncio
from dataclasses import replace

import pytest

from fpmatch.server.guard import FORM_BYTES, Guard
from fpmatch.server.settings import Client, Limits, Role, Settings, digest_of

from .conftest import echo, served

TOKEN = "a-long-enough-token"
LIMITS = Limits(file_megabytes=0.05, upload_seconds=5.0, waiting=1)
LARGE = Limits(file_megabytes=1.0, megabytes_at_once=1.5)
MOST = 2 * 50_000 + FORM_BYTES


def guarded(**settings):
    return Guard(echo, Settings(workers=1, limits=LIMITS, **settings))


@pytest.fixture(scope="module")
def client():
    with served(guarded()) as client:
        client.headers["host"] = "localhost:8000"
        yield client


@pytest.mark.parametrize(
    "host", ["localhost", "localhost:99", "127.0.0.1:8000", "[::1]:8000", "LOCALHOST"]
)
def test_names_of_this_server_are_answered(client, host):
    assert client.get("/about", headers={"host": host}).status_code == 200


@pytest.mark.parametrize(
    "host",
    [
        *("evil.example", "localhost.evil.example", "10.0.0.7", "[::2]", "[::1].evil.example"),
        *("localhost:80@evil.example", "[::1]:80@evil.example", "localhost:evil"),
    ],
)
def test_other_names_are_refused(client, host):
    answer = client.get("/about", headers={"host": host})
    assert answer.status_code == 421
    assert "not called" in answer.json()["error"]


def test_a_header_has_its_size_and_no_more(client):
    assert client.get("/about", headers={"x": "a" * 15_000}).status_code == 200
    answer = client.get("/about", headers={"x": "a" * 17_000})
    assert answer.status_code == 400
    assert answer.json()["error"] == "the header has more than 16 kB"


def test_a_name_that_acts_on_a_terminal_is_escaped(client):
    answer = client.get("/about", headers={"host": b"\x9b31mevil"})
    assert answer.json()["error"] == r"this server is not called \u009b31mevil"


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({}, 200),
        ({"origin": "http://localhost:8000"}, 200),
        ({"origin": "https://localhost:8000", "sec-fetch-site": "same-origin"}, 200),
        ({"origin": "http://localhost:9000"}, 403),
        ({"origin": "http://evil.example"}, 403),
        ({"origin": "null"}, 403),
        ({"sec-fetch-site": "cross-site"}, 403),
        ({"sec-fetch-site": "same-site"}, 403),
    ],
)
def test_other_sites_may_not_post(client, headers, status):
    assert client.post("/verify", headers=headers, content=b"x").status_code == status


def test_every_answer_has_the_headers_of_safety(client):
    for answer in (client.get("/"), client.post("/x"), client.get("/", headers={"host": "evil"})):
        policy = answer.headers["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "script-src 'self'" in policy
        assert "unsafe" not in policy
        assert answer.headers["x-content-type-options"] == "nosniff"
        assert answer.headers["cross-origin-resource-policy"] == "same-origin"
    assert client.post("/x").headers["cache-control"] == "no-store"


def test_a_token_is_needed_for_all_but_the_page():
    with served(guarded(clients={digest_of(TOKEN): Client("ada", Role.READ)})) as client:
        assert client.get("/").status_code == 200
        assert client.get("/main.js").status_code == 200
        assert client.get("/about").status_code == 401
        assert client.post("/verify.html", content=b"x").status_code == 401
        for given in ("", "Bearer", f"Bearer {TOKEN}x", f"Bearer {TOKEN[:-1]}", "Bearer ü"):
            wrong = client.get("/about", headers={"authorization": given.encode()})
            assert wrong.status_code == 401, given
        right = client.get("/about", headers={"authorization": f"Bearer {TOKEN}"})
        assert right.status_code == 200
        # addresses of digits cannot be taken over by a stranger's name server
        bearer = {"authorization": f"Bearer {TOKEN}"}
        assert client.get("/about", headers={"host": "10.0.0.7:8000", **bearer}).status_code == 200
        assert client.get("/about", headers={"host": "evil.example", **bearer}).status_code == 421


def test_a_body_may_have_its_size_and_no_more(client):
    assert client.post("/verify", content=bytes(MOST)).text == str(MOST)
    told = client.post("/verify", content=bytes(MOST + 1))
    assert (told.status_code, told.json()["error"]) == (
        413,
        "a file may have 0.05 MB, and this is more",
    )

    def chunks():
        for _ in range(10):
            yield bytes(MOST // 5)

    assert client.post("/verify", content=chunks()).status_code == 413


class Wire:
    """Requests to an application, all at once, whose bodies come when they are let."""

    def __init__(self, limits):
        self.app = Guard(echo, Settings(workers=1, limits=limits))
        self.released = asyncio.Event()

    async def ask(self, announced=0):
        """Return status and headers of the answer to a request that announces so many bytes."""
        answers = []

        async def receive():
            await self.released.wait()
            return {"type": "http.request", "body": b"", "more_body": False}

        async def send(message):
            answers.append(message)

        headers = [(b"host", b"localhost"), (b"content-length", str(announced).encode())]
        scope = {"type": "http", "method": "POST", "path": "/verify", "headers": headers}
        await self.app(scope, receive, send)
        return answers[0]["status"], dict(answers[0]["headers"])

    async def ask_at_once(self, *announced):
        """Return the answers to requests that come at once, and to one that comes later."""
        asked = [asyncio.create_task(self.ask(size)) for size in announced]
        await asyncio.sleep(0.05)
        self.released.set()
        return [*await asyncio.gather(*asked), await self.ask()]


@pytest.mark.parametrize(
    ("limits", "sizes", "statuses"),
    [
        (replace(LIMITS, wait_seconds=0.01), (0, 0, 0, 0), [200, 200, 503, 503, 200]),
        (replace(LIMITS, queue=1), (0, 0, 0, 0), [200, 200, 200, 503, 200]),
        (LIMITS, (0, 0, 0, 0), [200, 200, 200, 200, 200]),
        (replace(LARGE, wait_seconds=0.01), (1_600_000, 1_100_000), [200, 503, 200]),
        (LARGE, (1_600_000, 1_100_000, 100_000), [200, 200, 200, 200]),
        (Limits(upload_seconds=0.01), (1,), [408, 200]),
    ],
    ids=["number", "queue", "patience", "size", "patience for size", "time"],
)
def test_requests_wait_for_their_turn_and_no_longer(limits, sizes, statuses):
    async def test():
        return await Wire(limits).ask_at_once(*sizes)

    answers = asyncio.run(test())
    assert [status for status, _ in answers] == statuses
    assert all(headers[b"retry-after"].isdigit() for status, headers in answers if status == 503)
