"""The file of settings of a server: clients, what each role may request, and limits."""

import hashlib
from dataclasses import fields, replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.server.settings import Limits, Role, SettingsError, digest_of, load_settings

from .conftest import served_gallery

TOKENS = {role: f"the-token-of-{role.name.lower()}" for role in Role}


def write(folder, text):
    path = folder / "server.toml"
    path.write_text(text, encoding="utf-8")
    path.chmod(0o640)
    return path


def test_a_file_with_tokens_that_all_may_read_is_refused(tmp_path):
    path = write(tmp_path, '[office]\nrole = "admin"\ntoken = "a-long-enough-token"\n')
    path.chmod(0o644)
    with pytest.raises(SettingsError, match=r"other users may read the tokens; first: chmod o-rwx"):
        load_settings(path)
    digest = hashlib.sha256(b"another-long-token").hexdigest()
    write(tmp_path, f'[office]\nrole = "admin"\nsha256 = "{digest}"\n').chmod(0o644)
    assert load_settings(path).clients


def test_a_file_names_clients_roles_and_tokens(tmp_path):
    digest = hashlib.sha256(b"another-long-token").hexdigest()
    path = write(
        tmp_path,
        f'["front desk"]\nrole = "verify"\ntoken = "a-long-enough-token"\n'
        f'[office]\nrole = "admin"\nsha256 = "{digest}"\n',
    )
    clients = load_settings(path).clients
    assert clients[digest_of("a-long-enough-token")].name == "front desk"
    assert clients[digest_of("another-long-token")].role is Role.ADMIN


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("", "neither clients nor limits"),
        ("[a", "TOML"),
        ("a = 1", "table"),
        ('[a]\nrole = "king"\ntoken = "a-long-enough-token"', "role"),
        ('[a]\nrole = ["read"]\ntoken = "a-long-enough-token"', "role"),
        ('[a]\nrole = "read"', "either"),
        ('[a]\nrole = "read"\ntoken = "short"', "16"),
        ('[a]\nrole = "read"\ntoken = 5', "64"),
        ('[a]\nrole = "read"\nsha256 = "zz"', "64"),
        ('[a]\nrole = "read"\nsha256 = "' + "z" * 64 + '"', "64"),
        ('[a]\nrole = "read"\ntoken = "a-long-enough-token"\nname = "x"', "name"),
        ("a." * 20_000 + "b = 1", "a"),
        ("limits = 5", "limits: must be a table"),
        ("[limits]\nreqests = 5", "unknown limit .* Did you mean 'requests'"),
        ("[limits]\nrequests = 0", "requests must be a whole number from 1 to"),
        ("[limits]\nrequests = 5.0", "requests must be a whole number"),
        ("[limits]\nrequests = true", "requests must be a whole number"),
        ("[limits]\nwait_seconds = -1", "wait_seconds must be a number from 0 to"),
        ("[limits]\nseconds = 0", "seconds must be a number from 0.001 to 1000000"),
        ("[limits]\nseconds = nan", "seconds must be a number"),
        ("[limits]\nseconds = inf", "seconds must be a number"),
        ("[limits]\nseconds = 1" + "0" * 400, "seconds must be a number"),
        ('[limits]\nseconds = "5"', "seconds must be a number"),
        ('[limits]\nrole = "read"\ntoken = "a-long-enough-token"', "unknown limit 'role'"),
    ],
)
def test_bad_files_are_refused_in_one_line(tmp_path, text, word):
    path = write(tmp_path, text)
    with pytest.raises(SettingsError, match=word) as caught:
        load_settings(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@given(
    st.fixed_dictionaries(
        {},
        optional={
            each.name: st.integers(1, 1000) if each.type == "int" else st.floats(0.01, 1000)
            for each in fields(Limits)
        },
    )
)
def test_each_limit_can_be_set(tmp_path_factory, limits):
    lines = [f"{name} = {value!r}" for name, value in limits.items()]
    path = write(tmp_path_factory.getbasetemp(), "\n".join(["[limits]", *lines]))
    assert load_settings(path).limits == replace(Limits(), **limits)


def test_two_clients_with_one_token_are_refused(tmp_path):
    client = 'role = "read"\ntoken = "a-long-enough-token"\n'
    with pytest.raises(SettingsError, match="a and b"):
        load_settings(write(tmp_path, f"[a]\n{client}[b]\n{client}"))


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    folder = tmp_path_factory.mktemp("served")
    tables = (
        f'[{role.name}]\nrole = "{role.name.lower()}"\ntoken = "{TOKENS[role]}"' for role in Role
    )
    clients = load_settings(write(folder, "\n".join(tables))).clients
    gallery = folder / "prints.db"
    with served_gallery(gallery, clients=clients) as client:
        yield client


@pytest.mark.parametrize(
    ("method", "path", "least"),
    [
        ("GET", "/about", Role.READ),
        ("GET", "/gallery", Role.READ),
        ("GET", "/gallery/prints?subject=ada", Role.READ),
        ("GET", "/metrics", Role.READ),
        ("POST", "/verify", Role.VERIFY),
        ("POST", "/compare", Role.VERIFY),
        ("POST", "/overlay", Role.VERIFY),
        ("POST", "/views", Role.VERIFY),
        ("POST", "/gallery/1/views", Role.VERIFY),
        ("POST", "/extract", Role.VERIFY),
        ("POST", "/stages", Role.VERIFY),
        ("POST", "/case-report", Role.VERIFY),
        ("POST", "/identify", Role.VERIFY),
        ("POST", "/gallery/verify", Role.VERIFY),
        ("POST", "/gallery/1/compare", Role.VERIFY),
        ("POST", "/gallery/1/overlay", Role.VERIFY),
        ("POST", "/enrol", Role.ENROL),
        ("DELETE", "/gallery/1", Role.ADMIN),
        ("DELETE", "/gallery/prints?subject=ada", Role.ADMIN),
    ],
)
def test_a_role_may_request_what_it_includes_and_no_more(client, method, path, least):
    assert client.request(method, path).status_code == 401
    for role in Role:
        headers = {"authorization": f"Bearer {TOKENS[role]}"}
        response = client.request(method, path, headers=headers)
        assert (response.status_code == 403) == (role < least), (role, response.text)


def test_every_address_states_who_may_request_it(client):
    """An address without a role is one of those that need no token."""
    headers = {"authorization": f"Bearer {TOKENS[Role.READ]}"}
    description = client.get("/openapi.json", headers=headers).json()
    assert "HTTPBearer" in description["components"]["securitySchemes"]
    open_to_all = {
        path
        for path, methods in description["paths"].items()
        for method in methods.values()
        if not method.get("security")
    }
    assert open_to_all == {"/health", "/ready"}
