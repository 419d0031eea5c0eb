"""Connections that keep the server waiting: closed in time, and never at the cost of others."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager, suppress
from dataclasses import replace

import pytest
from prometheus_client import CollectorRegistry

from fpmatch.server.guard import Guard
from fpmatch.server.running import make_server
from fpmatch.server.settings import Limits, Settings

from .conftest import echo

QUICK = Limits(header_seconds=0.6, stalled_seconds=0.6, upload_seconds=1.5, waiting=1)
HEAD = b"GET /health HTTP/1.1\r\nhost: localhost\r\n"
POST = b"POST /verify HTTP/1.1\r\nhost: localhost\r\ncontent-length: %d\r\n\r\n"


class App:
    def __init__(self, limits):
        self.registry = CollectorRegistry()
        self.guard = Guard(echo, Settings(workers=1, limits=limits))

    async def __call__(self, scope, receive, send):
        await self.guard(scope, receive, send)

    def closed(self, reason):
        return (
            self.registry.get_sample_value("fpmatch_connections_closed_total", {"reason": reason})
            or 0
        )


class Served:
    """A server in a thread, and connections to it."""

    def __init__(self, limits):
        self.app = App(limits)
        self._listener = socket.create_server(("0.0.0.0", 0))
        self.port = self._listener.getsockname()[1]
        settings = Settings(workers=1, limits=limits)
        self.server = make_server(self.app, settings)
        self.server.config.lifespan = "off"
        self._opened = []
        self._thread = threading.Thread(
            target=self.server.run, kwargs={"sockets": [self._listener]}
        )
        self._thread.start()
        while not self.server.started:
            time.sleep(0.01)

    def connect(self, data=b"", source="127.0.0.1"):
        one = socket.create_connection(("127.0.0.1", self.port), 10, source_address=(source, 0))
        one.sendall(data)
        self._opened.append(one)
        return one

    def status(self, source="127.0.0.1", data=HEAD + b"\r\n"):
        """Return the status of the answer to another client."""
        return int(self.connect(data, source).recv(20).split()[1])

    @property
    def number(self):
        return int(self.app.registry.get_sample_value("fpmatch_connections") or 0)

    def end(self):
        for one in self._opened:
            one.close()
        self.server.should_exit = True
        self._thread.join()


@contextmanager
def serving(**limits):
    served = Served(replace(QUICK, **limits))
    try:
        yield served
    finally:
        served.end()


def rest(one):
    """Return all that comes until the server closes the connection."""
    data = b""
    with suppress(ConnectionResetError):
        while more := one.recv(65_536):
            data += more
    return data


def send_until_closed(one, data):
    """Send the same again and again until the server has closed the connection."""
    end = time.monotonic() + 10
    with suppress(ConnectionError):
        while time.monotonic() < end:
            one.sendall(data)
            time.sleep(0.05)
    assert time.monotonic() < end


@pytest.mark.slow
def test_a_header_that_does_not_come_is_waited_for_no_longer_than_the_limit():
    with serving() as served:
        silent, half = served.connect(), served.connect(HEAD + b"x-a: ")
        assert rest(silent) == b""
        assert rest(half).startswith(b"HTTP/1.1 408 ")
        dripping = served.connect(HEAD)
        send_until_closed(dripping, b"x-a: b\r\n")
        assert served.app.closed("header too late") == 3
        assert served.number == 0
        assert served.status() == 200


@pytest.mark.slow
def test_slow_bodies_take_no_place_from_others_and_end():
    with serving() as served:
        slow = [served.connect(POST % 1000 + b"x") for _ in range(20)]
        chunked = POST.replace(b"content-length: %d", b"transfer-encoding: chunked")
        slow += [served.connect(chunked + b"1\r\nx\r\n") for _ in range(1)]
        large = [served.connect(POST % 60_000_000 + b"x") for _ in range(20)]
        start = time.monotonic()
        for _ in range(5):
            assert served.status(data=POST % 4 + b"body") == 200
        assert time.monotonic() - start < 0.5
        assert all(rest(one).startswith(b"HTTP/1.1 408 ") for one in slow)
        for one in large:
            one.close()


def large_answer(served):
    one = socket.socket()
    one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    one.connect(("127.0.0.1", served.port))
    one.sendall(HEAD.replace(b"/health", b"/large") + b"\r\n")
    served._opened.append(one)
    return one


def wait_until(condition):
    end = time.monotonic() + 10
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)


@pytest.mark.slow
def test_answers_that_are_not_read_are_dropped():
    with serving(stalled_seconds=1.0) as served:
        for _ in range(5):
            large_answer(served)
        wait_until(lambda: served.app.closed("answer not read") == 5)
        assert served.number == 0


def test_one_client_has_no_more_connections_than_its_limit_and_others_have_theirs():
    with serving(header_seconds=30.0, connections_per_client=5) as served:
        if sys.platform != "linux":
            pytest.skip("only 127.0.0.1 is an address of this computer")
        for _ in range(30):
            served.connect(HEAD, "127.0.0.2")
        wait_until(lambda: served.app.closed("too many, the slowest") == 25)
        assert served.number == 5
        assert served.status("127.0.0.2") == 200  # in place of a slower one
        assert served.status("127.0.0.3") == 200
        for _ in range(30):  # a proxy on this computer stands for many clients
            served.connect(HEAD)
        assert served.status() == 200
        assert served.number > 30


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
    with serving() as served:
        opened = {name: served.connect() for name in ODD}
        for name, one in opened.items():
            with suppress(OSError):
                one.sendall(ODD[name])
        for name, one in opened.items():
            answer = rest(one)
            assert answer == b"" or answer.startswith(b"HTTP/1.1 "), name
            assert b"Traceback" not in answer, name
        assert served.status() == 200


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
