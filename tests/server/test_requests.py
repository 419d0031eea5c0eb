"""What a route does not take is refused with one line that names it: fields, methods, bodies."""

import io
import re

import numpy as np
import pytest
from PIL import Image

from fpmatch.server.settings import STATIC, Client, Role, digest_of

from .conftest import served_gallery

TOKEN, READER = "a-long-enough-token", "another-long-enough-token"
METHODS = ("GET", "POST", "PUT", "PATCH", "DELETE", "OPTIONS")
FORM = "multipart/form-data"


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    """Serve an empty gallery, to a client that may request everything."""
    gallery = tmp_path_factory.mktemp("gallery") / "prints.db"
    clients = {digest_of(TOKEN): Client("ada", Role.ADMIN)}
    clients |= {digest_of(READER): Client("grace", Role.READ)}
    with served_gallery(gallery, clients=clients) as client:
        client.headers["authorization"] = f"Bearer {TOKEN}"
        yield client


@pytest.fixture(scope="module")
def operations(server):
    api = server.get("/openapi.json").json()
    found = []
    for path, methods in api["paths"].items():
        for method, operation in methods.items():
            fields = {}
            if "requestBody" in operation:
                (reference,) = operation["requestBody"]["content"][FORM]["schema"].values()
                fields = api["components"]["schemas"][reference.split("/")[-1]]["properties"]
            found.append((method.upper(), path.replace("{number}", "1"), fields))
    return found


def refusal(response, status):
    assert response.status_code == status, response.text
    error = response.json()["error"]
    assert "\n" not in error
    return error


def test_no_route_takes_an_unknown_parameter_or_field(server, operations, image):
    assert len(operations) == 22
    for method, path, fields in operations:
        files = {
            name: ("1_1.png", image)
            for name, schema in fields.items()
            if "contentMediaType" in schema
        }
        in_query = server.request(method, path, params={"treshold": "1"}, files=files)
        assert refusal(in_query, 422).startswith("unknown query parameter 'treshold'"), path
        in_form = server.request(method, path, files=files, data={"treshold": "1"})
        error = refusal(in_form, 422 if method == "POST" else 415)
        needed = "subject: " if path == "/gallery/verify" else "unknown form field 'treshold'"
        assert error.startswith(needed if method == "POST" else "this address takes no body"), path
    assert server.get("/gallery").json()["impressions"] == 0


@pytest.fixture(scope="module")
def image(prints):
    return prints["1_1.png"]


@pytest.mark.parametrize(
    ("path", "data", "why"),
    [
        ("/verify", {"treshold": "30"}, "unknown form field 'treshold'"),
        ("/verify", {"": "30"}, "unknown form field ''"),
        ("/verify", {"a\x1b[2J": "30"}, r"unknown form field 'a\x1b[2J'"),
        ("/verify", {"x" * 3000: "30"}, "unknown form field 'xxx"),
        ("/verify", {"threshold": ["30", "10"]}, "threshold: given 2 times, must be given once"),
        ("/verify?threshold=30", {}, "unknown query parameter 'threshold': this address takes"),
        ("/case-report", {"marks": '[{"side": "probe", "x": 1, "y": 1, "nte": "a"}]'}, "'note'?"),
    ],
)
def test_a_field_of_a_pair_is_named(server, image, path, data, why):
    files = {"probe": ("1_1.png", image), "reference": ("1_2.png", image)}
    error = refusal(server.post(path, files=files, data=data), 422)
    assert why in error
    assert len(error) <= 2000


def test_files_are_given_once_and_where_they_belong(server, image):
    probe, file = ("probe", ("1_1.png", image)), ("1_2.png", image)
    twice = server.post("/verify", files=[probe, ("reference", file), ("reference", file)])
    assert refusal(twice, 422) == "reference: given 2 times, must be given once"
    misplaced = server.post("/verify", files=[probe, ("reference", file), ("threshold", file)])
    assert refusal(misplaced, 422).startswith("threshold: input should be a valid number")
    text = server.post("/verify", files=[probe], data={"reference": "1_2.png"})
    assert refusal(text, 422) == "reference: must be a file, as curl -F reference=@FILE sends it"


def test_parameters_of_the_query_are_known_and_given_once(server):
    def ask(method, query):
        return refusal(server.request(method, f"/gallery/prints?{query}"), 422)

    for method in ("GET", "DELETE"):
        assert (
            ask(method, "subject=1&finger=2") == "unknown query parameter 'finger'; known: subject"
        )
        assert "Did you mean 'subject'?" in ask(method, "subjct=1")
        assert ask(method, "subject=1&subject=2") == "subject: given 2 times, must be given once"
    answer = server.request("DELETE", "/gallery/prints", data={"subject": "1"})
    assert refusal(answer, 415) == "this address takes no body"


def test_a_role_is_checked_before_names(server):
    headers = {"authorization": f"Bearer {READER}"}
    answer = server.post("/verify?a=1", headers=headers, files={"b": b"c"})
    assert "needs the role" in refusal(answer, 403)


@pytest.mark.slow
def test_methods_that_an_address_does_not_take_are_answered_with_those_it_does(server, operations):
    taken = {}
    for method, path, _ in operations:
        taken.setdefault(path, set()).update({method, "HEAD"} if method == "GET" else {method})
    pages = ["/", "/openapi.json", *(f"/{file.name}" for file in STATIC.iterdir())]
    taken |= {page: {"GET", "HEAD"} for page in pages}
    assert taken["/gallery/prints"] == {"GET", "HEAD", "DELETE"}
    for path, methods in taken.items():
        for method in METHODS:
            if method in methods:
                continue
            answer = server.request(method, path)
            if (method, path) == ("DELETE", "/gallery/verify"):  # of an entry of this name
                assert answer.status_code == 422
                continue
            error = refusal(answer, 405)
            assert set(answer.headers["allow"].split(", ")) == methods, (method, path)
            assert error == f"this address takes {answer.headers['allow']}, not {method}"


def test_head_is_answered_as_get_without_a_body(server):
    for path in ("/", "/health", "/ready", "/about", "/gallery", "/gallery/prints?subject=1"):
        head, get = server.head(path), server.get(path)
        assert (head.status_code, head.content) == (200, b"")
        assert head.headers["content-type"] == get.headers["content-type"]
    assert server.head("/verify").status_code == 405
    assert server.head("/nothing").status_code == 404


@pytest.mark.parametrize(
    ("headers", "content"),
    [
        ({"content-type": "application/json"}, b'{"probe": "x", "reference": "y"}'),
        ({"content-type": "application/x-www-form-urlencoded"}, b"probe=x&reference=y"),
        ({"content-type": "image/png"}, b"\x89PNG"),
        ({"content-type": "Application/JSON; charset=utf-8"}, b"{}"),
        ({}, b"x"),
    ],
)
def test_a_body_that_is_no_form_with_files_is_answered_with_the_type_that_is_needed(
    server, operations, headers, content
):
    for method, path, fields in operations:
        if fields:
            answer = server.request(method, path, headers=headers, content=content)
            error = refusal(answer, 415)
            assert f"a form, {FORM}, as curl -F sends it" in error
            given = headers.get("content-type", "not stated").partition(";")[0].lower()
            assert error.endswith(f"not {given}") or "not stated" in error
    streamed = server.post("/verify", headers=headers, content=iter([content]))
    assert refusal(streamed, 415)


def test_a_matcher_by_place_is_not_offered(server, image):
    probe = {"probe": ("1_1.png", image)}
    pair = {**probe, "reference": ("1_2.png", image)}
    for path, files in (
        ("/verify", pair),
        ("/identify", probe),
        ("/gallery/verify", probe),
        ("/gallery/1/compare", probe),
    ):
        for name in ("antigravity:fly", "unit-circl", "fpmatch.matching.matchers.paper:MATCHER"):
            data = {"matcher": name} | ({"subject": "1"} if path == "/gallery/verify" else {})
            error = refusal(server.post(path, files=files, data=data), 422)
            assert error.startswith(
                f"unknown matcher '{name}'; known: paper, reference, unit-circle"
            )
            assert "OBJECT" not in error
            assert "pattern" not in error
    for path in ("/openapi.json", *(f"/{file.name}" for file in STATIC.iterdir())):
        assert not re.search(r"package\.module|OBJECT|\^\[\^:\]", server.get(path).text), path


def test_a_mirrored_print_is_named(server, prints):
    one, mirrored = np.asarray(Image.open(io.BytesIO(prints["1_1.png"]))), io.BytesIO()
    Image.fromarray(one[:, ::-1]).save(mirrored, "PNG", dpi=(500, 500))
    files = {
        "probe": ("mirrored.png", mirrored.getvalue()),
        "reference": ("1_1.png", prints["1_1.png"]),
    }
    answer = server.post("/verify", files=files).json()
    assert (answer["match"], "mirrored, the probe matches" in answer["reason"]) == (False, True)
