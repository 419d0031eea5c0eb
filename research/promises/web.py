"""A server under attack, and requests to it as bytes of any kind."""

from __future__ import annotations

import http.client
import json
import socket
import sys
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from research.attacks.requests import FORM, PROBE, REFERENCE, form_of
from research.attacks.server import started
from research.commands import ROOT
from research.promises.program import KEY

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from research.promises.program import Place

    Form = dict[str, object]

ROLES: Final = ("read", "verify", "enrol", "admin")
_PROBE: Final[Form] = {"probe": ("a.tif", PROBE.read_bytes())}
PAIR: Final[Form] = {**_PROBE, "reference": ("b.tif", REFERENCE.read_bytes())}
IMAGE: Final[Form] = {"image": ("201_9.tif", PROBE.read_bytes() + b"\0")}
ROUTES: Final[dict[str, tuple[str, Form]]] = {  # by docs/how-to: role, and the fields of a form
    **dict.fromkeys(("GET /about", "GET /metrics", "GET /gallery"), ("read", {})),
    "GET /gallery/prints?subject=102": ("read", {}),
    **dict.fromkeys(("POST /verify", "POST /compare", "POST /views"), ("verify", PAIR)),
    **dict.fromkeys(("POST /overlay", "POST /case-report"), ("verify", PAIR)),
    **dict.fromkeys(("POST /extract", "POST /stages"), ("verify", IMAGE)),
    **dict.fromkeys(("POST /identify", "POST /gallery/2/compare"), ("verify", _PROBE)),
    **dict.fromkeys(("POST /gallery/2/views", "POST /gallery/2/overlay"), ("verify", _PROBE)),
    "POST /gallery/verify": ("verify", {**_PROBE, "subject": "102"}),
    "POST /enrol": ("enrol", IMAGE),
    "DELETE /gallery/16": ("admin", {}),
    "DELETE /gallery/prints?subject=103": ("admin", {}),
}


@dataclass(frozen=True)
class Answer:
    """Status, headers and body of an answer; status 0 where there was none."""

    status: int
    headers: Mapping[str, str]
    body: bytes

    @property
    def refused(self) -> bool | str:
        """Whether it is a refusal with one sentence; else what it is."""
        try:
            sentence = json.loads(self.body)["error"]
        except (ValueError, KeyError, TypeError):
            return str(self)
        return (400 <= self.status < 500 and sentence.isprintable()) or str(self)

    def __str__(self) -> str:
        return f"status {self.status}: {self.body[:200]!r}"


@dataclass(frozen=True)
class Web:
    """A server: its port, its process and its log."""

    port: int
    pid: int
    log: Path

    def ask(
        self,
        what: str,
        form: Mapping[str, object] | bytes | None = None,
        headers: Mapping[str, str] | None = None,
        host: str = "127.0.0.1",
    ) -> Answer:
        """Send a request, a method and an address, with the form that it takes or another body."""
        method, _, address = what.partition(" ")
        form = ROUTES.get(what, ("", {}))[1] if form is None else form
        body = form if isinstance(form, bytes) else form_of(form) if form else b""
        sent = {"content-type": FORM.partition(": ")[2]} if body else {}
        connection = http.client.HTTPConnection(host, self.port, timeout=40)
        try:
            connection.request(method, address, body or None, {**sent, **(headers or {})})
            answer = connection.getresponse()
            names = {name.lower(): value for name, value in answer.getheaders()}
            return Answer(answer.status, names, answer.read())
        except (OSError, http.client.HTTPException, UnicodeError) as error:
            return Answer(0, {}, str(error).encode())
        finally:
            connection.close()

    def connect(self, sent: bytes, source: str = "127.0.0.1") -> socket.socket:
        """Open a connection from an address of this computer, and send a part of a request."""
        opened = socket.create_connection(("127.0.0.1", self.port), 20, (source, 0))
        opened.sendall(sent)
        return opened


def descendants(pid: int) -> list[int]:
    """Return the processes below one."""
    below: list[int] = []
    with suppress(OSError):  # it ends meanwhile
        for path in Path(f"/proc/{pid}/task").glob("*/children"):
            for child in map(int, path.read_text().split()):
                below += [child, *descendants(child)]
    return below


def workers_of(pid: int) -> list[int]:
    """Return the worker processes of a server; what prepared its gallery is below it, too."""
    workers = []
    for one in descendants(pid):
        with suppress(OSError):
            workers += [one] * (b"to_process" in Path(f"/proc/{one}/cmdline").read_bytes())
    return workers


@contextmanager
def served(place: Place, *options: object) -> Iterator[Web]:
    """Serve the gallery of an attack, which is made, in its folder."""
    gallery, temporary = place.folder / "plain.db", place.folder / "tmp"
    temporary.mkdir(exist_ok=True)
    if not gallery.exists():
        place.gallery()
    settings = {"HOME": place.folder, "PYTHONPATH": ROOT, "TMPDIR": temporary, "FPMATCH_KEY": KEY}
    words = ["env", "-C", place.folder, *(f"{name}={value}" for name, value in settings.items())]
    words += [sys.executable, "-m", "fpmatch", "serve", "--port", 0, "--workers", 2]
    words += ["--gallery", gallery, *options]
    log = place.folder.parent / "log.txt"
    with started(list(map(str, words)), log) as server:
        yield Web(server.place[1], server.pid, log)
