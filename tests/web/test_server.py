"""Binding a server: its address, its names, and when it needs a token."""

from __future__ import annotations

import socket

import pytest

from fpmatch.web.server import ServeError, bind_server
from fpmatch.web.settings import Settings


def test_on_loopback_there_is_no_token():
    bound = bind_server("127.0.0.1", 0, Settings())
    with bound.listener as listener:
        assert bound.address == f"http://127.0.0.1:{listener.getsockname()[1]}/"
        assert bound.settings.token is None
        assert {"127.0.0.1", "localhost", "[::1]"} <= set(bound.settings.hosts)


def test_where_other_machines_can_connect_there_is_a_random_token():
    first, second = (
        bind_server("0.0.0.0", 0, Settings(), allowed_hosts=["Prints.Example"]) for _ in range(2)
    )
    names = {"localhost", "prints.example", socket.gethostname().lower()}
    for bound in (first, second):
        bound.listener.close()
        assert bound.address.endswith(f"#token={bound.settings.token}")
        assert names <= set(bound.settings.hosts)
    assert first.settings.token != second.settings.token is not None


def test_a_token_may_be_given():
    bound = bind_server("localhost", 0, Settings(), token="sixteen-letters-")
    bound.listener.close()
    assert bound.settings.token == "sixteen-letters-"
    assert "token" not in repr(bound.settings)


@pytest.mark.parametrize("token", ["short", "sixteen letters and spaces", "größer-als-sechzehn"])
def test_bad_tokens_are_refused(token):
    with pytest.raises(ServeError) as caught:
        bind_server("127.0.0.1", 0, Settings(), token=token)
    assert caught.value.code == "token"


def test_a_port_in_use_is_refused():
    bound = bind_server("127.0.0.1", 0, Settings())
    port = bound.listener.getsockname()[1]
    with (
        bound.listener,
        pytest.raises(ServeError, match=f"cannot listen on 127.0.0.1, port {port}"),
    ):
        bind_server("127.0.0.1", port, Settings())


@pytest.mark.parametrize(
    ("host", "port", "code"), [("no.such.host.invalid", 0, "listen"), ("127.0.0.1", 99_999, "port")]
)
def test_addresses_that_do_not_exist_are_refused(host, port, code):
    with pytest.raises(ServeError) as caught:
        bind_server(host, port, Settings())
    assert caught.value.code == code
