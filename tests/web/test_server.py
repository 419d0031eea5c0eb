"""The door: where it listens, what it is called, and when it wants a token."""

from __future__ import annotations

import socket

import pytest

from fpmatch.web.server import ServeError, bind_server
from fpmatch.web.settings import Settings


def test_on_loopback_there_is_no_token() -> None:
    door = bind_server("127.0.0.1", 0, Settings())
    with door.listener as listener:
        assert door.address == f"http://127.0.0.1:{listener.getsockname()[1]}/"
        assert door.settings.token is None
        assert {"127.0.0.1", "localhost", "[::1]"} <= set(door.settings.hosts)


def test_where_others_can_reach_there_is_one() -> None:
    doors = [
        bind_server("0.0.0.0", 0, Settings(), allowed_hosts=["Prints.Example"]) for _ in range(2)
    ]
    for door in doors:
        door.listener.close()
        assert door.settings.token is not None
        assert door.address.endswith(f"#token={door.settings.token}")
        assert {"localhost", "prints.example", socket.gethostname().lower()} <= set(
            door.settings.hosts
        )
    assert doors[0].settings.token != doors[1].settings.token


def test_a_token_may_be_given() -> None:
    door = bind_server("localhost", 0, Settings(), token="sixteen-letters-")
    door.listener.close()
    assert door.settings.token == "sixteen-letters-"
    assert "token" not in repr(door.settings)


@pytest.mark.parametrize("token", ["short", "sixteen letters and spaces", "größer-als-sechzehn"])
def test_tokens_that_cannot_be(token: str) -> None:
    with pytest.raises(ServeError, match="a token"):
        bind_server("127.0.0.1", 0, Settings(), token=token)


def test_a_port_that_is_taken_is_told() -> None:
    door = bind_server("127.0.0.1", 0, Settings())
    port = door.listener.getsockname()[1]
    with door.listener, pytest.raises(ServeError, match=f"cannot listen on 127.0.0.1, port {port}"):
        bind_server("127.0.0.1", port, Settings())


@pytest.mark.parametrize(("host", "port"), [("no.such.host.invalid", 0), ("127.0.0.1", 99_999)])
def test_places_that_are_none(host: str, port: int) -> None:
    with pytest.raises(ServeError, match="cannot listen on"):
        bind_server(host, port, Settings())
