"""Settings: the file of clients and limits, and the address, names and token of a bound server."""

import hashlib
import socket

import pytest

from fpmatch.server.server import bind_server
from fpmatch.server.settings import (
    Client,
    Limits,
    Role,
    Settings,
    SettingsError,
    digest_of,
    load_settings,
)

TOKEN = "sixteen-letters-"


def write(folder, text):
    path = folder / "server.toml"
    path.write_text(text, encoding="utf-8")
    path.chmod(0o640)
    return path


def test_a_file_names_clients_roles_and_tokens_and_is_private(tmp_path):
    digest = hashlib.sha256(b"another-long-token").hexdigest()
    office = f'[office]\nrole = "admin"\nsha256 = "{digest}"\n'
    desk = f'["front desk"]\nrole = "verify"\ntoken = "{TOKEN}"\n'
    path = write(tmp_path, f"{desk}{office}[limits]\nrequests = 5\nseconds = 60\n")
    assert load_settings(path).limits == Limits(requests=5, seconds=60.0)
    clients = load_settings(path).clients
    assert clients[digest_of(TOKEN)] == Client("front desk", Role.VERIFY)
    assert clients[digest_of("another-long-token")].role is Role.ADMIN
    path.chmod(0o644)
    with pytest.raises(SettingsError, match=r"other users may read the tokens; first: chmod o-rwx"):
        load_settings(path)
    write(tmp_path, office).chmod(0o644)
    assert load_settings(path).clients


CLIENT = f'role = "read"\ntoken = "{TOKEN}"\n'


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("", "neither clients nor limits"),
        ("[a", "TOML"),
        ('[a]\nrole = "king"\ntoken = "a-long-enough-token"', "role"),
        ('[a]\nrole = "read"', "either"),
        ('[a]\nrole = "read"\ntoken = "short"', "16"),
        ('[a]\nrole = "read"\ntoken = 5', "a: token: input should be a valid string"),
        ('[a]\nrole = "read"\nsha256 = "' + "z" * 64 + '"', "64"),
        ('[a]\nrole = "read"\ntoken = "a-long-enough-token"\nname = "x"', "name"),
        (f"[a]\n{CLIENT}[b]\n{CLIENT}", "clients a and b have the same token"),
        ("a." * 20_000 + "b = 1", "a"),
        ("limits = 5", "limits: must be a table"),
        ("[limits]\nreqests = 5", "unknown key .* Did you mean 'requests'"),
        ("[limits]\nrequests = 0", "limits: requests: input should be greater than or equal to 1"),
        ("[limits]\nrequests = 5.0", "requests: input should be a valid integer"),
        ("[limits]\nwait_seconds = -1", "wait_seconds: input should be greater than or equal to 0"),
        ("[limits]\nseconds = 0", "seconds: input should be greater than or equal to 0.001"),
        ("[limits]\nseconds = nan", "seconds: input should be"),
        ("[limits]\nseconds = 1" + "0" * 400, "seconds: input should be a valid number"),
        ('[limits]\nseconds = "5"', "seconds: input should be a valid number"),
    ],
)
def test_bad_files_are_refused_in_one_line(tmp_path, text, word):
    path = write(tmp_path, text)
    with pytest.raises(SettingsError, match=word) as caught:
        load_settings(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("host", "token", "clients", "made"),
    [
        ("127.0.0.1", None, {}, None),
        ("localhost", TOKEN, {}, "owner"),
        ("0.0.0.0", None, {digest_of(TOKEN): Client("ada", Role.READ)}, None),
        ("0.0.0.0", None, {}, "owner"),  # other machines can connect: a random token
    ],
)
def test_a_server_is_bound_with_names_and_perhaps_a_token(host, token, clients, made):
    settings, names = Settings(clients=clients), {"localhost", "prints.example"}
    bound, second = (
        bind_server(host, 0, settings, token=token, allowed_hosts=["Prints.Example"])
        for _ in range(2)
    )
    for one in (bound, second):
        one.listener.close()
    local = host != "0.0.0.0"
    names |= {"127.0.0.1", "[::1]"} if local else {socket.gethostname().lower()}
    assert names <= set(bound.settings.hosts)
    address, _, shown = bound.address.partition("#token=")
    assert address.startswith(f"http://{host if local else socket.gethostname().lower()}:")
    owner = bound.settings.clients.get(digest_of(shown))
    assert owner == (None if made is None else Client(made, Role.ADMIN))
    assert shown == (token or shown)
    assert (bound.settings.clients == second.settings.clients) == (made is None or bool(token))
    assert "clients" not in repr(bound.settings)


@pytest.mark.parametrize(
    ("host", "port", "token", "code"),
    [
        ("127.0.0.1", 0, "short", "token"),
        ("127.0.0.1", 0, "größer-als-sechzehn", "token"),
        ("127.0.0.1", 99_999, None, "port"),
        ("127.0.0.1", "taken", None, "listen"),
        ("no.such.host.invalid", 0, None, "listen"),
    ],
)
def test_what_cannot_be_served_is_refused(host, port, token, code):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        if port == "taken":
            port = taken.getsockname()[1]
        with pytest.raises(SettingsError) as caught:
            bind_server(host, port, Settings(), token=token)
    assert caught.value.code == code
