"""Target: the server, as the application that a web server calls, without a network."""

from __future__ import annotations

import asyncio
import atexit
import json
import re
import shutil
from dataclasses import replace
from typing import TYPE_CHECKING, Any
from unittest.mock import patch

from fpmatch.formats.record import TemplateRecord, View
from fpmatch.formats.registry import CODECS
from fpmatch.server import app as web
from fpmatch.server.settings import Limits, Settings
from research.attacks.requests import BOUNDARY, FORM, form_of
from research.fuzzing.mutators.text import CELLS, NUMBERS, json_value
from research.fuzzing.targets.stores import PROBE, gallery_file, templates
from research.fuzzing.targets.target import Reader, Target, scratch

if TYPE_CHECKING:
    import random
    from collections.abc import Callable

_PATHS = (
    *("/verify", "/compare", "/overlay", "/views", "/case-report", "/extract", "/stages"),
    *("/identify", "/enrol", "/gallery/verify", "/gallery/1/compare", "/gallery/1/overlay"),
    *("/gallery", "/gallery/prints", "/about", "/health", "/metrics", "/%2e%2e/x", "//", "/é"),
)
_HEADERS = (
    *("host: localhost", "host: evil", "origin: http://evil", "content-length: 5", "x: \x1b[31m"),
    *(
        "content-length: -1",
        "transfer-encoding: chunked",
        "expect: 100-continue",
        "range: bytes=0-5",
    ),
    *("authorization: Bearer x", "content-type: application/json", "content-type: multipart/x"),
    *("content-type: application/x-www-form-urlencoded", "accept-encoding: gzip", "cookie: a=b"),
)


def server_targets() -> list[Target]:
    """Return the targets of the server."""
    end = f"--{BOUNDARY}--".encode()
    words = (b"multipart/form-data", b"\r\n\r\n", end, b'name="probe"', b"%00", b"%ff")
    return [Target("http", _http, (request_line, request_header, form_value, form_value), words)]


def request_line(rng: random.Random, data: bytes) -> bytes:
    """Change method, path or query of a request."""
    first, newline, rest = data.partition(b"\r\n")
    method, path, *_ = first.decode("latin-1").split(" ")
    way = rng.randrange(4)
    if way == 0:
        method = rng.choice(("GET", "POST", "DELETE", "HEAD", "OPTIONS", "PUT", "PATCH", "X", ""))
    elif way == 1:
        path = rng.choice(_PATHS)
    elif way == 2:
        path = re.sub(r"\d+", lambda _: rng.choice(NUMBERS)[:50], path)
    else:
        cell = rng.choice(CELLS).encode("utf-8", "surrogatepass")
        quoted = "".join(f"%{octet:02x}" for octet in cell[:300])
        path = f"{path.partition('?')[0]}?{rng.choice(('subject', 'limit', 'a'))}={quoted}"
    return f"{method} {path}".encode("latin-1", "replace") + newline + rest


def request_header(rng: random.Random, data: bytes) -> bytes:
    """Add, remove or exchange a header of a request."""
    head, blank, body = data.partition(b"\r\n\r\n")
    lines = head.split(b"\r\n")
    at = rng.randrange(1, len(lines) + 1)
    if rng.random() < 0.3:
        del lines[at:][:1]
    lines.insert(at, rng.choice(_HEADERS).encode("latin-1"))
    return b"\r\n".join(lines) + blank + body


def form_value(rng: random.Random, data: bytes) -> bytes:
    """Exchange, add, double or rename a field of a form."""
    head, blank, body = data.partition(b"\r\n\r\n")
    mark = f"--{BOUNDARY}".encode()
    parts = body.split(mark)
    at = rng.randrange(1, len(parts) - 1)
    heading, separator, value = parts[at].partition(b"\r\n\r\n")
    way = rng.randrange(6)
    cell = rng.choice(CELLS).encode("utf-8", "surrogatepass")
    if way <= 1:
        document = value.removesuffix(b"\r\n")
        value = (json_value(rng, document) if document[:1] in {b"{", b"["} else cell) + b"\r\n"
    elif way == 2:
        heading = re.sub(rb'name="[^"]*"', b'name="' + cell[:200] + b'"', heading)
    elif way == 3:
        heading = heading.replace(b'filename="', b'filename="' + cell[:200])
    elif way == 4:
        parts.insert(at, parts[at])
    else:
        del parts[at]
    if way <= 3:
        parts[at] = heading + separator + value
    return head + blank + mark.join(parts)


class _InThisProcess:
    """Stand for `fpmatch.server.pool.Pool`, and do the work of requests at once."""

    def __init__(self, *_: object) -> None:
        pass

    async def run(self, _: object, work: Callable[..., Any], *args: Any) -> Any:
        """Return ``work(*args)``."""
        return work(*args)

    async def answer(self) -> None:
        """Return at once."""


def _http() -> Reader:
    made = gallery_file()
    limits = Limits(file_megabytes=2.0, megapixels=1.0, wait_seconds=0.5, upload_seconds=5.0)

    settings = Settings(gallery=str(made), workers=1, limits=limits)
    with patch.object(web, "Pool", _InThisProcess):
        observer = web.make_app(settings)
    runner = asyncio.Runner()  # a check of readiness outlives its request
    atexit.register(runner.close)
    application: Any = observer
    while not hasattr(application, "state"):  # the application behind observer and guard
        application = application._app

    def read(data: bytes) -> list[str]:
        gallery = scratch() / "served.db"
        shutil.copyfile(made, gallery)
        shutil.copytree(f"{made}.prepared", f"{gallery}.prepared", dirs_exist_ok=True)
        application.state.settings = replace(settings, gallery=str(gallery))
        status, content = runner.run(_response(observer, data))
        if status >= 500 and status not in {503, 504}:
            raise AssertionError(f"status {status}: {content[:200]!r}")
        if status < 400:
            return []
        document = json.loads(content) if content else {"error": ""}
        return [document["error"]]

    corpus = _requests()
    for request in corpus:  # FastAPI prepares each route at its first request
        read(request)
    return Reader(corpus, read)


def _requests() -> list[bytes]:
    """Return good requests to every address."""
    formats = {codec.name: codec for codec in CODECS}
    record = TemplateRecord("", (View(templates()[PROBE]),))
    encoded = [formats[name].encode for name in ("json", "iso2005")]
    prints = [encode(record).data for encode in encoded if encode is not None]
    probe, reference = prints[0], prints[-1]
    pair = {"probe": probe, "reference": reference}
    marks = {"marks": '[{"side": "probe", "x": 1, "y": 2, "note": "a"}]', "notes": "one"}
    options = {"dpi": "500", "matcher": "unit-circle", "threshold": "40", "enhance": "filters"}
    return [
        *(_request("GET", path) for path in ("/", "/health", "/about", "/metrics", "/gallery")),
        _request("GET", "/gallery/prints?subject=101"),
        _request("DELETE", "/gallery/2"),
        _request("DELETE", "/gallery/prints?subject=102"),
        _request("POST", "/verify", pair, options),
        _request("POST", "/verify", pair, {"matcher": "paper:area_tolerance=0.2", "fmr": "0.001"}),
        _request("POST", "/overlay", pair, {"format": "svg", "side_by_side": "true"}),
        _request("POST", "/case-report", pair, marks),
        _request("POST", "/identify", {"probe": reference}, {"candidates": "3", "threshold": "1"}),
        _request("POST", "/enrol", {"image": reference}, {"subject": "ada", "finger": "left"}),
        _request("POST", "/gallery/verify", {"probe": reference}, {"subject": "101"}),
        _request("POST", "/gallery/1/compare", {"probe": reference}, {"fmr": "0.01"}),
        _request("POST", "/extract", {"image": probe}, {"format": "iso2011"}),
    ]


def _request(
    method: str,
    path: str,
    files: dict[str, bytes] | None = None,
    values: dict[str, str] | None = None,
) -> bytes:
    """Return a request as bytes: a line, headers, and the body of a form."""
    body = form_of({**(values or {}), **{k: (f"{k}.x", v) for k, v in (files or {}).items()}})
    head = [f"{method} {path}", "host: localhost:8000", *([FORM] if values or files else [])]
    return "\r\n".join([*head, "", ""]).encode() + (body if values or files else b"")


async def _response(application: Any, data: bytes) -> tuple[int, bytes]:
    """Send a request to an application; return status and body of the response."""
    head, _, body = data.partition(b"\r\n\r\n")
    first, *lines = head.split(b"\r\n")
    method, path = [*first.split(b" "), b"", b""][:2]
    raw_path, _, query = path.partition(b"?")
    pairs = [line.partition(b":") for line in lines]
    headers = [(name.strip().lower(), value.strip()) for name, _, value in pairs if name.strip()]
    names = {name for name, _ in headers}
    if body and not names & {b"content-length", b"transfer-encoding"}:
        headers.append((b"content-length", str(len(body)).encode()))
    scope = {
        "type": "http", "asgi": {"version": "3.0"}, "http_version": "1.1", "scheme": "http",
        "method": method.decode("latin-1").upper(), "root_path": "", "headers": headers,
        "path": re.sub("%([0-9a-fA-F]{2})", _octet, raw_path.decode("latin-1")) or "/",
        "raw_path": raw_path, "query_string": query, "client": ("127.0.0.1", 5), "state": {},
        "server": ("127.0.0.1", 8000),
    }  # fmt: skip
    messages = [{"type": "http.request", "body": body, "more_body": False}]
    sent: list[dict[str, Any]] = []

    async def receive() -> dict[str, Any]:
        if messages:
            return messages.pop()
        return {"type": "http.disconnect"}

    async def send(message: dict[str, Any]) -> None:
        sent.append(message)

    await application(scope, receive, send)
    status = next((one["status"] for one in sent if one["type"] == "http.response.start"), 0)
    return status, b"".join(one.get("body", b"") for one in sent)


def _octet(match: re.Match[str]) -> str:
    return chr(int(match[1], 16))
