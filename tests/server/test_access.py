"""Who may ask: hosts, origins, tokens, sizes, how many at once; and the headers of safety."""

import asyncio

import pytest
from fastapi import HTTPException
from starlette.middleware.exceptions import ExceptionMiddleware
from starlette.responses import JSONResponse

from fpmatch.server.access import FORM_BYTES, Access
from fpmatch.server.settings import Client, Limits, Role, Settings, digest_of

from .conftest import echo, served

TOKEN = "a-long-enough-token"
LIMITS = Limits(file_megabytes=0.05, slow_seconds=5.0)
MOST = 2 * 50_000 + FORM_BYTES


def with_errors(app):
    """Answer with the status of an error, as the application does."""

    async def answer(_, error):
        return JSONResponse({"error": error.detail}, error.status_code, error.headers)

    return ExceptionMiddleware(app, {HTTPException: answer})


def guarded(**settings):
    return Access(with_errors(echo), Settings(workers=1, limits=LIMITS, **settings))


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


async def ask(access, released, size):
    """Return status and headers of the answer to a request whose body comes when it is let."""
    answers = []

    async def receive():
        await released.wait()
        return {"type": "http.request", "body": bytes(size), "more_body": False}

    async def send(message):
        answers.append(message)

    headers = [(b"host", b"localhost"), (b"content-length", str(size).encode())]
    scope = {"type": "http", "method": "POST", "path": "/verify", "headers": headers}
    await access(scope, receive, send)
    return answers[0]["status"], dict(answers[0]["headers"])


@pytest.mark.parametrize(
    ("limits", "sizes", "statuses"),
    [
        ({"requests": 2}, (9, 9, 9), [200, 200, 503]),
        ({"megabytes_at_once": 1.5}, (2_000_000, 9), [200, 503]),
        ({"megabytes_at_once": 1.5}, (1_000_000, 400_000, 400_000), [200, 200, 503]),
        ({"slow_seconds": 0.01}, (9, 9), [408, 408]),
    ],
)
def test_requests_beyond_a_limit_are_refused_and_leave_room(limits, sizes, statuses):
    let_in, late = asyncio.Event(), "slow_seconds" in limits

    async def slow_echo(scope, receive, send):
        await receive()
        await asyncio.sleep(0.1)
        await echo({**scope, "method": "GET"}, receive, send)

    async def test():
        settings = Settings(workers=1, limits=Limits(**limits))
        access = Access(with_errors(slow_echo), settings)
        asked = [asyncio.create_task(ask(access, let_in, size)) for size in sizes]
        await asyncio.sleep(0.1)
        let_in.set()
        answers = await asyncio.gather(*asked)
        later, _ = await ask(access, let_in, 9)
        assert access.inside == 0
        return answers, later

    answers, later = asyncio.run(test())
    assert [status for status, _ in answers] == statuses
    assert later == 200
    if not late:
        assert answers[-1][1][b"retry-after"].isdigit()
