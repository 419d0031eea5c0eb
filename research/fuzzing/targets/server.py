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
from research.fuzzing.target import Reader, Target, scratch
from research.fuzzing.targets.stores import PROBE, gallery_file, templates

if TYPE_CHECKING:
    from collections.abc import Callable

BOUNDARY = "fpmatch-fuzz"
FORM = f"content-type: multipart/form-data; boundary={BOUNDARY}"
_WORDS = (
    *(b"GET ", b"DELETE ", b"/gallery/1/overlay", b"/%2e%2e/x", b"//", b"%00", b"%ff", b"?limit="),
    *(b"\r\ncontent-length: -1", b"\r\ntransfer-encoding: chunked", b"\r\nrange: bytes=0-5"),
    *(b"\r\nauthorization: Bearer x", b"\r\nhost: evil", b"multipart/form-data", b"\r\n\r\n"),
    *(f"--{BOUNDARY}--".encode(), b'name="probe"', b'name="threshold"', b'filename="'),
)


def server_targets() -> list[Target]:
    """Return the target of the server."""
    return [Target("http", _http, _WORDS)]


def form_of(values: dict[str, str], files: dict[str, bytes]) -> bytes:
    """Return the body of a form."""
    parts = [(f'name="{name}"', value.encode()) for name, value in values.items()]
    parts += [(f'name="{name}"; filename="{name}.x"', data) for name, data in files.items()]
    body = b"".join(
        f"--{BOUNDARY}\r\ncontent-disposition: form-data; {head}\r\n\r\n".encode() + data + b"\r\n"
        for head, data in parts
    )
    return body + f"--{BOUNDARY}--\r\n".encode()


class _InThisProcess:
    """Stand for `fpmatch.server.pool.Pool`, and do the work of requests at once."""

    def __init__(self, *_: object) -> None:
        pass

    async def run(
        self, _: object, work: Callable[..., Any], *args: Any, gallery: bool = False
    ) -> Any:
        """Return ``work(*args)``."""
        return work(*args)

    async def answer(self) -> None:
        """Return at once."""


def _http() -> Reader:
    made = gallery_file()
    limits = Limits(file_megabytes=2.0, megapixels=1.0, wait_seconds=0.5, slow_seconds=5.0)

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
        _request("POST", "/extract", {"image": probe}, {"format": "iso2005"}),
    ]


def _request(
    method: str,
    path: str,
    files: dict[str, bytes] | None = None,
    values: dict[str, str] | None = None,
) -> bytes:
    """Return a request as bytes: a line, headers, and the body of a form."""
    body = form_of(values or {}, files or {})
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
