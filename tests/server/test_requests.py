"""Hostile requests: every address refuses what it does not take, with one sentence."""

import json
import re

import pytest

from fpmatch.server.settings import STATIC, Limits, Role

from .conftest import bearer, serving, wait_until_ready

METHODS = ("GET", "POST", "PUT", "PATCH", "DELETE", "OPTIONS")
FORM = "multipart/form-data"
CONTROLS = re.compile("[\x00-\x1f\x7f-\x9f\u2028-\u202e\ud800-\udfff]")
LEAST = {  # the role that an address needs, where it is not VERIFY
    ("GET", "/about"): Role.READ,
    ("GET", "/gallery"): Role.READ,
    ("GET", "/gallery/prints"): Role.READ,
    ("GET", "/metrics"): Role.READ,
    ("POST", "/enrol"): Role.ENROL,
    ("DELETE", "/gallery/99"): Role.ADMIN,
    ("DELETE", "/gallery/prints"): Role.ADMIN,
}


def refusal(answer, status):
    """Return the one sentence of a refusal, which no terminal obeys."""
    assert answer.status_code == status, answer.text
    assert list(answer.json()) == ["error"]
    sentence = answer.json()["error"]
    assert not CONTROLS.search(sentence)
    assert len(sentence) < 2_500
    return sentence


@pytest.fixture(scope="module")
def operations(server):
    """Return method, path, properties of the form, and whether a token is needed."""
    api = server.get("/openapi.json").json()
    listed = []
    for path, methods in api["paths"].items():
        for method, operation in methods.items():
            fields = {}
            if "requestBody" in operation:
                (reference,) = operation["requestBody"]["content"][FORM]["schema"].values()
                fields = api["components"]["schemas"][reference.split("/")[-1]]["properties"]
            address = path.replace("{number}", "99")
            listed.append((method.upper(), address, fields, bool(operation.get("security"))))
    assert len(listed) == 22
    return listed


@pytest.fixture(scope="module")
def ask(server, prints):
    """Return a function that sends a good request, but for what is given."""

    def answer(method, path, fields, data=None, headers=None, params=None, **body):
        known = {"subject": "nobody"} if path == "/gallery/prints" else {}
        if fields and "content" not in body:
            files = [name for name, field in fields.items() if "contentMediaType" in field]
            body["files"] = dict.fromkeys(files, ("1_1.png", prints["1_1.png"]))
            body["data"] = ({"subject": "1"} if "subject" in fields else {}) | (data or {})
        query = known | (params or {})
        return server.request(method, path, params=query, headers=headers, **body)

    return answer


def typed(kind):
    return {"headers": {"content-type": kind}, "content": b"{}"}


HOSTILE = [  # for which methods, what is sent, and what is answered
    ("*", {"headers": {"host": b"\x9b31mevil"}}, 421, r"not called \u009b31mevil"),
    ("*", {"headers": {"host": "localhost:80@evil.example"}}, 421, "not called localhost:80@evil"),
    ("*", {"headers": {"x": "a" * 17_000}}, 400, "the header has more than 16 kB"),
    ("POST DELETE", {"headers": {"origin": "http://evil.example"}}, 403, "only the page of this"),
    ("POST DELETE", {"headers": {"origin": "null"}}, 403, "only the page of this"),
    ("POST DELETE", {"headers": {"sec-fetch-site": "same-site"}}, 403, "only the page of this"),
    ("*", {"params": {"treshold": "1"}}, 422, "unknown query parameter 'treshold'"),
    ("POST", {"data": {"treshold": "1"}}, 422, "unknown form field 'treshold'"),
    ("POST", {"data": {"a\x1b[2J": "30"}}, 422, r"unknown form field 'a\x1b[2J'"),
    ("POST", {"data": {"x" * 3000: "30"}}, 422, "unknown form field 'xxx"),
    ("POST", {"data": {"dpi": ["500", "1"]}}, 422, "dpi: given 2 times, must be given once"),
    ("POST", typed("Application/JSON; charset=utf-8"), 415, "sends it, not application/json"),
    ("POST", typed("application/x-www-form-urlencoded"), 415, f"a form, {FORM}, as curl -F"),
    ("POST", {"content": b"x"}, 415, "the type of this body is not stated"),
    ("GET DELETE", {"content": b"x"}, 415, "this address takes no body"),
    ("POST", {"content": bytes(5_000_000)}, 413, "a file may have 2 MB, and this is more"),
]


@pytest.mark.parametrize(("methods", "parts", "status", "words"), HOSTILE)
def test_every_address_refuses(operations, ask, server, methods, parts, status, words):
    for method, path, fields, _ in operations:
        if methods == "*" or method in methods:
            assert words in refusal(ask(method, path, fields, **parts), status), (method, path)
    assert server.get("/gallery").json()["impressions"] == 0


def test_the_page_of_this_server_may_ask_also_behind_a_proxy(server):
    for origin, status in (("https://localhost:8000", 404), ("http://localhost:9000", 403)):
        headers = {"host": "localhost:8000", "origin": origin, "sec-fetch-site": "same-origin"}
        refusal(server.delete("/gallery/99", headers=headers), status)


def test_a_body_of_unknown_size_is_refused_once_it_is_too_large(server):
    kind = {"content-type": f"{FORM}; boundary=b"}
    start = b'--b\r\nContent-Disposition: form-data; name="probe"; filename="a"\r\n\r\n'
    body = (start if k == 0 else bytes(1_000_000) for k in range(10))
    answer = server.post("/verify", content=body, headers=kind)
    assert "a file may have 2 MB" in refusal(answer, 413)


def test_every_address_is_for_clients_of_its_role(operations, ask):
    for method, path, fields, secured in operations:
        least = LEAST.get((method, path), Role.VERIFY)
        for given in ("", "Bearer", "Bearer ü", f"{bearer(least)['authorization']}x"):
            answer = ask(method, path, fields, headers={"authorization": given.encode()})
            assert (answer.status_code == 401) == secured, (method, path)
        assert secured or path in {"/health", "/ready"}
        for role in filter(lambda one: secured and one < least, Role):
            answer = ask(method, path, fields, headers=bearer(role), params={"a": "1"})
            words = f"this needs the role {least.name.lower()}, and the token has "
            assert refusal(answer, 403).startswith(words)
        if secured:
            answer = ask(method, path, fields, headers=bearer(least), params={"a": "1"})
            assert answer.status_code == 422, (method, path)


def test_other_methods_are_answered_with_those_of_the_address(server, operations):
    files = [f"/{file.name}" for file in STATIC.iterdir()]
    taken = {page: {"GET"} for page in ("/", "/openapi.json", *files)}
    for method, path, *_ in operations:
        taken.setdefault(path, set()).add(method)
    assert taken["/gallery/prints"] == {"GET", "DELETE"}
    for path, methods in taken.items():
        allowed = methods | ({"HEAD"} if "GET" in methods else set())
        for method in set(METHODS) - methods - ({"DELETE"} if path == "/gallery/verify" else set()):
            answer = server.request(method, path)
            stated = answer.headers["allow"]
            assert set(stated.split(", ")) == allowed, (method, path)
            assert refusal(answer, 405) == f"this address takes {stated}, not {method}"
    assert server.delete("/gallery/verify").status_code == 422  # of an entry of this name
    for path in ("/", "/health", "/ready", "/about", "/gallery", "/gallery/prints?subject=1"):
        head, get = server.head(path), server.get(path)
        assert (head.status_code, head.content) == (200, b"")
        assert head.headers["content-type"] == get.headers["content-type"]
    for path in ("/nothing", "/%2e%2e/app.py"):
        assert server.get(path).status_code == server.post(path).status_code == 404, path
    assert refusal(server.get("/nothing"), 404) == "there is nothing at this address"


def test_without_a_gallery_there_are_no_addresses_of_one():
    with serving(limits=Limits(seconds=1e-3)) as client:
        assert client.post("/identify").status_code == 404
        paths = client.get("/openapi.json").json()["paths"]
        assert len(paths) == 11
        assert "gallery" not in str(list(paths))
        image = {"image": ("a.png", b"x")}
        stopped = client.post("/extract", files=image)
        assert "was stopped" in refusal(stopped, 504)
        assert client.get("/about").json()["gallery"] is None
        wait_until_ready(client)  # the process in its place has started


TEXTS = ("a\0b", "\x1b[2J", "a\nb", "a\x9bb", "\u202eb", "a\u2028b", "x" * 5_000)
NUMBERS = ("nan", "inf", "-inf", "-1", "1e999", "5e-324", "9" * 400, *TEXTS[:2])
PLACE = "fpmatch.matching.matchers.paper:MATCHER"
BAD = {
    **dict.fromkeys(("subject", "finger", "impression", "enhance", "format"), TEXTS),
    **dict.fromkeys(("dpi", "probe_dpi", "reference_dpi", "fmr", "candidates"), NUMBERS),
    "matcher": (*TEXTS, "antigravity:fly", "unit-circl", PLACE, "../../etc"),
    "side_by_side": TEXTS,
    "case_number": ("7" * 61,),
    "notes": ("x" * 200_001,),
    "marks": (
        *("{", "{}", '[{"side": "left", "x": 0, "y": 0}]', '[{"side": "probe", "x": NaN}]'),
        '[{"side": "probe", "x": 1e300, "y": 0}]',
    ),
}


@pytest.mark.parametrize("field", BAD)
def test_every_address_refuses_bad_values_of_a_field(operations, ask, server, field):
    having = [one for one in operations if field in one[2]]
    assert having
    for method, path, fields, _ in having:
        for value in BAD[field]:
            answer = ask(method, path, fields, data={field: value})
            assert 400 <= answer.status_code < 500, (path, value, answer.text)
            sentence = refusal(answer, answer.status_code)
            assert "OBJECT" not in sentence
            if field in {"matcher", "notes", "case_number"}:
                assert field in sentence
    for text in TEXTS if field == "subject" else ():
        refusal(server.get("/gallery/prints", params={"subject": text}), 422)
    assert server.get("/gallery").json()["impressions"] == 0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"fmr": "5"}, "a false match rate lies"),
        ({"threshold": "101"}, "threshold must lie in"),
        ({"threshold": "40", "fmr": "0.1"}, "fmr and threshold exclude each other"),
        ({"dpi": "many"}, "dpi: input should be a valid number"),
        ({"matcher": "unit-circl"}, "unit-circle. Did you mean 'unit-circle'?"),
        ({"matcher": "paper:rho=2"}, "rho lies from 0 to 1, not 2"),
        ({"matcher": "unit-circle:rho=0.5"}, "unit-circle has no parameter 'rho'"),
        ({"matcher": "antigravity:fly:rho=0.5"}, "unknown matcher 'antigravity:fly'; known: paper"),
        ({"matcher": "paper:rho=0.5", "threshold": 30}, "rho decides without a score"),
    ],
)
def test_the_sentence_says_what_is_wrong_with_an_option(server, sent, options, words):
    files = sent(probe="1_1.png", reference="1_2.png")
    assert words in refusal(server.post("/verify", files=files, data=options), 422)


@pytest.mark.parametrize(
    ("name", "status", "words"),
    [
        ("text.png", 422, "text.png: not an image of a known format"),
        ("truncated.png", 422, "truncated.png: "),
        ("empty.png", 422, "empty.png: the file is empty"),
        ("big.tif", 413, "big.tif: larger than 2 MB"),
        ("huge.pgm", 422, "huge.pgm: image is too large: more than"),
        ("wide.png", 422, "wide.png: 2600 x 2600 pixels at 500 dpi are more than this server"),
    ],
)
def test_every_address_refuses_a_bad_file(operations, server, prints, name, status, words):
    for method, path, fields, _ in operations:
        field = {"probe", "image"} & set(fields)
        if field and "/99/" not in path:
            files = {one: ("1_1.png", prints["1_1.png"]) for one in fields if one == "reference"}
            data = {"subject": "1"} if "subject" in fields else {}
            files[field.pop()] = (name, prints[name])
            sentence = refusal(server.request(method, path, files=files, data=data), status)
            assert sentence.startswith(words), path


def test_files_are_given_once_and_where_they_belong(server, prints):
    probe, file = ("probe", ("1_1.png", prints["1_1.png"])), ("1_2.png", prints["1_2.png"])
    for files, data, words in (
        ([("reference", file)], {}, "probe: field required"),
        ([probe, ("reference", file), ("reference", file)], {}, "reference: given 2 times, must"),
        ([probe, ("reference", file), ("threshold", file)], {}, "threshold: input should be a"),
        ([probe], {"reference": "1"}, "reference: must be a file, as curl -F reference=@FILE"),
    ):
        assert refusal(server.post("/verify", files=files, data=data), 422).startswith(words)
    twice = server.get("/gallery/prints?subject=1&subject=2")
    assert refusal(twice, 422) == "subject: given 2 times, must be given once"
    marks = {"marks": '[{"side": "probe", "x": 1, "y": 1, "nte": "a"}]'}
    answer = server.post("/case-report", files=[probe, ("reference", file)], data=marks)
    assert "unknown key 'nte'" in refusal(answer, 422)
    assert "'note'?" in answer.json()["error"]


@pytest.mark.parametrize("name", [b"\xff", b"\xed\xa0\x80", b"\x1b[2J", b"a\x9bb", b"=1+1"])
def test_names_of_files_that_are_no_text(server, prints, name):
    body = (
        b'--b\r\nContent-Disposition: form-data; name="image"; filename="' + name + b'_1.png"'
        b"\r\n\r\n" + prints["truncated.png"] + b"\r\n--b--\r\n"
    )
    kind = {"content-type": f"{FORM}; boundary=b"}
    refusal(server.post("/enrol", content=body, headers=kind), 422)


def test_templates_that_would_be_damage_are_refused_and_not_stored(http, sent):
    document = http.post("/extract", files=sent(image="1_1.png")).json()
    far = json.loads(json.dumps(document)) | {"dpi": 100}
    far["minutiae"]["x"][0] = 3e38
    far = ("far.json", json.dumps(far).encode())
    for path, files in (
        ("/verify", {"probe": far, "reference": far}),
        ("/identify", {"probe": far}),
        ("/enrol", {"image": far}),
    ):
        data = {"subject": "ada"} if path == "/enrol" else {}
        answer = http.post(path, files=files, data=data)
        assert "x must be a list of finite numbers" in refusal(answer, 422)
    for step in (1e-50, 5e-324, 1e30):
        document["ridge_field"]["step"] = step
        file = ("7_1.json", json.dumps(document).encode())
        answer = http.post("/enrol", files={"image": file})
        assert "step" in refusal(answer, 400)
