"""Limits of time, size and number: slow or odd clients are closed, and hold up no other."""

import asyncio
import socket
import time
from contextlib import contextmanager, suppress

import pytest
from fastapi import HTTPException
from starlette.middleware.exceptions import ExceptionMiddleware
from starlette.responses import JSONResponse

from fpmatch.server.access import Access
from fpmatch.server.settings import Limits, Settings

from .conftest import LARGE_BYTES, echo, listening, serving

QUICK = Limits(slow_seconds=1.0, kilobytes_per_second=5000, seconds=1.0, wait_seconds=1.0)
HEAD = b"GET /health HTTP/1.1\r\nhost: localhost\r\n"
POST = b"POST /verify HTTP/1.1\r\nhost: localhost\r\ncontent-length: %d\r\n\r\n"
CHUNKED = POST.replace(b"content-length: %d", b"transfer-encoding: chunked")


def guarded(app, limits):
    """Return an application behind `Access`, which answers with the status of an error."""

    async def answer(_, error):
        return JSONResponse({"error": error.detail}, error.status_code, error.headers)

    inner = ExceptionMiddleware(app, {HTTPException: answer})
    return Access(inner, Settings(workers=1, limits=limits))


@contextmanager
def connections():
    """Yield a function that opens a connection and sends the first bytes."""
    opened = []

    def connect(data=b"", receive_bytes=None):
        one = socket.socket()
        one.settimeout(20)
        if receive_bytes is not None:
            one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_bytes)
        one.connect(("127.0.0.1", port))
        one.sendall(data)
        opened.append(one)
        return one

    with listening(guarded(echo, QUICK), QUICK) as port:
        try:
            yield connect
        finally:
            for one in opened:
                one.close()


def rest(one):
    """Return all that comes until the server closes the connection."""
    data = b""
    with suppress(ConnectionResetError):
        while more := one.recv(65_536):
            data += more
    return data


def status(connect, data=HEAD + b"\r\n"):
    """Return the status of the answer to another client."""
    return int(connect(data).recv(20).split()[1])


def send_until_closed(one, data):
    """Send the same again and again until the server has closed the connection."""
    end = time.monotonic() + 10
    with suppress(ConnectionError):
        while time.monotonic() < end:
            one.sendall(data)
            time.sleep(0.05)
    assert time.monotonic() < end


@pytest.mark.slow
def test_slow_clients_are_closed_in_time_and_hold_up_no_other():
    with connections() as connect:
        beginnings = (b"", HEAD + b"x-a: ", POST % 1000 + b"x", CHUNKED + b"1\r\nx\r\n")
        slow = {data: [connect(data) for _ in range(50)] for data in beginnings}
        start = time.monotonic()
        for _ in range(5):
            assert status(connect) == 200
            assert status(connect, POST % 4 + b"body") == 200
        assert time.monotonic() - start < 3.0
        for data, waiting in slow.items():
            answers = [rest(one) for one in waiting]
            late = b"HTTP/1.1 408 " if data.startswith(b"POST") else b""
            assert all(answer.startswith(late) for answer in answers)
        assert time.monotonic() - start < 10.0
        send_until_closed(connect(HEAD), b"x-a: b\r\n")
        send_until_closed(connect(POST % 1000), b"x")


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(socket, "TCP_USER_TIMEOUT"), reason="of Linux")
def test_an_answer_that_is_not_read_is_dropped():
    with connections() as connect:
        one = connect(HEAD.replace(b"/health", b"/large") + b"\r\n", receive_bytes=4096)
        time.sleep(4.0)
        assert len(rest(one)) < LARGE_BYTES
        quick = connect(HEAD.replace(b"/health", b"/large") + b"connection: close\r\n\r\n")
        assert len(rest(quick)) > LARGE_BYTES


ODD = {
    "zeros": b"\x00" * 100 + b"\r\n\r\n",
    "long": HEAD + b"x: " + b"a" * 100_000,
    "version": b"GET / HTTP/9.9\r\n\r\n",
    "length": POST.replace(b"%d", b"-1"),
    "chunk": CHUNKED + b"zz\r\n",
    "upgrade": b"GET http://localhost/%00 HTTP/1.1\r\nhost: localhost\r\nconnection: upgrade\r\n"
    b"upgrade: websocket\r\n\r\n",
    "pipelined": 200 * (HEAD + b"\r\n"),
}


def test_odd_requests_are_answered_or_refused_and_end():
    with connections() as connect:
        opened = {name: connect() for name in ODD}
        for name, one in opened.items():
            with suppress(OSError):
                one.sendall(ODD[name])
        for name, one in opened.items():
            answer = rest(one)
            assert answer == b"" or answer.startswith(b"HTTP/1.1 "), name
            assert b"Traceback" not in answer, name
        assert status(connect) == 200


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
    ],
)
def test_requests_beyond_a_limit_are_refused_and_leave_room(limits, sizes, statuses):
    let_in = asyncio.Event()

    async def slow_echo(scope, receive, send):
        await receive()
        await asyncio.sleep(0.1)
        await echo({**scope, "method": "GET"}, receive, send)

    async def test():
        access = guarded(slow_echo, Limits(**limits))
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
    assert answers[-1][1][b"retry-after"].isdigit()


def test_hosts_are_names_of_this_server_or_with_a_token_addresses(server):
    ours = ("localhost:99", "127.0.0.1:8000", "[::1]:8000", "LOCALHOST")
    addresses = ("10.0.0.7", "[::2]")  # no stranger's name server takes them over
    others = (
        "localhost.evil.example",
        "[::1].evil.example",
        "[::1]:80@evil.example",
        "localhost:e",
    )
    with serving() as local:
        for host in (*ours, *addresses, *others):
            answers = [http.get("/about", headers={"host": host}) for http in (local, server)]
            known = [200 if host in names else 421 for names in (ours, (*ours, *addresses))]
            assert [one.status_code for one in answers] == known, host
