"""Binding a server: its address, its names, and when it needs a token."""

import socket

import pytest

from fpmatch.server.server import ServeError, bind_server
from fpmatch.server.settings import Client, Role, Settings, SettingsError, digest_of


def test_on_loopback_there_is_no_token():
    bound = bind_server("127.0.0.1", 0, Settings())
    with bound.listener as listener:
        assert bound.address == f"http://127.0.0.1:{listener.getsockname()[1]}/"
        assert not bound.settings.clients
        assert {"127.0.0.1", "localhost", "[::1]"} <= set(bound.settings.hosts)


def test_where_other_machines_can_connect_there_is_a_random_token():
    first, second = (
        bind_server("0.0.0.0", 0, Settings(), allowed_hosts=["Prints.Example"]) for _ in range(2)
    )
    names = {"localhost", "prints.example", socket.gethostname().lower()}
    for bound in (first, second):
        bound.listener.close()
        token = bound.address.partition("#token=")[2]
        assert bound.settings.clients[digest_of(token)].role is Role.ADMIN
        assert names <= set(bound.settings.hosts)
    assert first.settings.clients.keys() != second.settings.clients.keys()


def test_where_there_are_clients_no_token_is_made():
    clients = {digest_of("sixteen-letters-"): Client("ada", Role.READ)}
    bound = bind_server("0.0.0.0", 0, Settings(clients=clients))
    bound.listener.close()
    assert "token" not in bound.address
    assert bound.settings.clients == clients


def test_a_token_may_be_given():
    bound = bind_server("localhost", 0, Settings(), token="sixteen-letters-")
    bound.listener.close()
    assert bound.settings.clients[digest_of("sixteen-letters-")].name == "owner"
    assert "clients" not in repr(bound.settings)


@pytest.mark.parametrize(
    ("host", "port", "token", "code"),
    [
        ("127.0.0.1", 0, "short", "token"),
        ("127.0.0.1", 0, "sixteen letters and spaces", "token"),
        ("127.0.0.1", 0, "größer-als-sechzehn", "token"),
        ("127.0.0.1", 99_999, None, "port"),
        ("no.such.host.invalid", 0, None, "listen"),
    ],
)
def test_what_cannot_be_served_is_refused(host, port, token, code):
    with pytest.raises((ServeError, SettingsError)) as caught:
        bind_server(host, port, Settings(), token=token)
    assert caught.value.code == code


def test_a_port_in_use_is_refused():
    bound = bind_server("127.0.0.1", 0, Settings())
    with bound.listener as listener:
        port = listener.getsockname()[1]
        with pytest.raises(ServeError, match=f"cannot listen on 127.0.0.1, port {port}"):
            bind_server("127.0.0.1", port, Settings())
