"""Connections that keep the server waiting: closed in time, and never at the cost of others."""

import os
import signal
import socket
import subprocess
import sys
import time
from contextlib import contextmanager, suppress

import pytest

from fpmatch.server.access import Access
from fpmatch.server.settings import Limits, Settings

from .conftest import LARGE_BYTES, echo, listening
from .test_access import with_errors

QUICK = Limits(slow_seconds=1.0, kilobytes_per_second=5000, seconds=1.0, wait_seconds=1.0)
HEAD = b"GET /health HTTP/1.1\r\nhost: localhost\r\n"
POST = b"POST /verify HTTP/1.1\r\nhost: localhost\r\ncontent-length: %d\r\n\r\n"


@contextmanager
def serving():
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

    access = Access(with_errors(echo), Settings(workers=1, limits=QUICK))
    with listening(access, QUICK) as port:
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
    with serving() as connect:
        chunked = POST.replace(b"content-length: %d", b"transfer-encoding: chunked")
        beginnings = (b"", HEAD + b"x-a: ", POST % 1000 + b"x", chunked + b"1\r\nx\r\n")
        slow = {data: [connect(data) for _ in range(50)] for data in beginnings}
        start = time.monotonic()
        for _ in range(5):
            assert status(connect) == 200
            assert status(connect, POST % 4 + b"body") == 200
        assert time.monotonic() - start < 3.0
        for data, connections in slow.items():
            answers = [rest(one) for one in connections]
            late = b"HTTP/1.1 408 " if data.startswith(b"POST") else b""
            assert all(answer.startswith(late) for answer in answers)
        assert time.monotonic() - start < 10.0
        send_until_closed(connect(HEAD), b"x-a: b\r\n")
        send_until_closed(connect(POST % 1000), b"x")


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(socket, "TCP_USER_TIMEOUT"), reason="of Linux")
def test_an_answer_that_is_not_read_is_dropped():
    with serving() as connect:
        one = connect(HEAD.replace(b"/health", b"/large") + b"\r\n", receive_bytes=4096)
        time.sleep(4.0)
        assert len(rest(one)) < LARGE_BYTES
        quick = connect(HEAD.replace(b"/health", b"/large") + b"connection: close\r\n\r\n")
        assert len(rest(quick)) > LARGE_BYTES


ODD = {
    "zeros": b"\x00" * 100 + b"\r\n\r\n",
    "long": HEAD + b"x: " + b"a" * 100_000,
    "many": HEAD + b"".join(b"x-%d: a\r\n" % k for k in range(20_000)),
    "version": b"GET / HTTP/9.9\r\n\r\n",
    "length": POST.replace(b"%d", b"-1"),
    "chunk": POST.replace(b"content-length: %d", b"transfer-encoding: chunked") + b"zz\r\n",
    "upgrade": b"GET http://localhost/%00 HTTP/1.1\r\nhost: localhost\r\nconnection: upgrade\r\n"
    b"upgrade: websocket\r\n\r\n",
    "pipelined": 200 * (HEAD + b"\r\n"),
}


def test_odd_requests_are_answered_or_refused_and_end():
    with serving() as connect:
        opened = {name: connect() for name in ODD}
        for name, one in opened.items():
            with suppress(OSError):
                one.sendall(ODD[name])
        for name, one in opened.items():
            answer = rest(one)
            assert answer == b"" or answer.startswith(b"HTTP/1.1 "), name
            assert b"Traceback" not in answer, name
        assert status(connect) == 200


SERVE = [sys.executable, "-W", "error", "-m", "fpmatch", "serve", "--port", "0", "--workers", "1"]


def start(words, **options):
    server = subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options
    )
    assert server.stdout is not None
    return server, int(server.stdout.readline().rsplit(":", 1)[1].rstrip("/\n"))


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="signals are sent otherwise")
@pytest.mark.parametrize("group", [False, True])
def test_sigterm_lets_requests_end_and_the_status_is_0(prints, group):
    httpx = pytest.importorskip("httpx")
    server, port = start(SERVE, start_new_session=True)
    with server:
        try:
            waiting = socket.create_connection(("127.0.0.1", port), 5)
            waiting.sendall(POST % 100 + b"x")  # a request that never becomes whole
            form = httpx.Request(
                "POST", "http://localhost/stages", files={"image": prints["1_1.png"]}
            )
            body = form.read()
            head = f"content-type: {form.headers['content-type']}\r\ncontent-length: {len(body)}"
            with socket.create_connection(("127.0.0.1", port), 60) as client:
                start_line = b"POST /stages HTTP/1.1\r\nhost: localhost\r\n"
                client.sendall(start_line + head.encode() + b"\r\n\r\n" + body)
                time.sleep(0.1)
                os.killpg(server.pid, signal.SIGTERM) if group else server.terminate()
                assert client.recv(20).startswith(b"HTTP/1.1 200")
                while client.recv(65_536):
                    pass
            assert server.wait(30) == 0
            waiting.close()
        finally:
            server.kill()
