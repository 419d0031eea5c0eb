"""Client of a server that `fpmatch serve` started: its requests as methods.

It needs httpx: ``pip install 'fpmatch[client]'``.
"""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch.base.output import reason
from fpmatch.errors import FpmatchError, unknown_name
from fpmatch.formats.files import decode_record

if TYPE_CHECKING:
    import os
    from types import TracebackType
    from typing import Self

    import httpx

    from fpmatch.templates.minutiae import Template

    Print = str | os.PathLike[str] | bytes

_READING: Final = ("dpi", "enhance")
_DECISION: Final = ("matcher", "fmr", "threshold")
_PAIR: Final = (*_READING, "probe_dpi", "reference_dpi", *_DECISION)
_OPTIONS: Final = {  # that a request takes, besides prints and labels
    "/verify": _PAIR,
    "/overlay": (*_PAIR, "format", "side_by_side", "ridges"),
    "/extract": (*_READING, "format"),
    "/identify": ("dpi", "matcher", "candidates", "threshold"),
    "/gallery/verify": (*_READING, *_DECISION),
}
_BUSY: Final = 503
_LEAST_ERROR: Final = 400


class ServerError(FpmatchError):
    """A request was refused, or the server could not be reached.

    `status` is the HTTP status, 0 where there was no answer or nothing was sent.
    """

    def __init__(self, message: str, status: int = 0) -> None:
        super().__init__(message, code=str(status))
        self.status = status


class ServerClient:
    """Send requests to a server.

    Prints are paths of images or templates, or the bytes of such files. The documents that the
    methods return are those that the commands print with ``--json``.

    Parameters
    ----------
    address : str
        Address of the server, as ``http://127.0.0.1:8000``; a token after ``#token=`` is used.
    token : str, optional
        Token of the client.
    timeout : float
        Longest time in seconds for one request; while the server is busy, it is sent again.

    Examples
    --------
    >>> client = ServerClient("http://127.0.0.1:8000")
    >>> client.address
    'http://127.0.0.1:8000'
    >>> client.close()
    """

    def __init__(self, address: str, token: str | None = None, *, timeout: float = 120.0) -> None:
        import httpx  # noqa: PLC0415  (of an extra)

        address, _, given = address.partition("#token=")
        self.address = address.rstrip("/")
        token = token or given or None
        headers = {} if token is None else {"authorization": f"Bearer {token}"}
        self._timeout = timeout
        self._http = httpx.Client(base_url=self.address, headers=headers, timeout=timeout)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections."""
        self._http.close()

    def about(self) -> dict[str, Any]:
        """Return version, matchers and limits of the server, and the role of this client."""
        return _document(self._request("GET", "/about"))

    def verify(self, probe: Print, reference: Print, **options: Any) -> dict[str, Any]:
        """Decide whether two prints are of the same finger.

        Options are ``matcher``, ``fmr``, ``threshold``, ``dpi``, ``probe_dpi``, ``reference_dpi``
        and ``enhance``, as of the command. Raises ServerError if there is no such option, the
        server refuses the request or cannot be reached.
        """
        files = {"probe": probe, "reference": reference}
        return _document(self._request("POST", "/verify", files, options=options))

    def overlay(self, probe: Print, reference: Print, **options: Any) -> bytes:
        """Return the picture of `fpmatch verify --overlay`.

        ``format`` is "png" or "svg"; ``side_by_side`` or ``ridges`` may be true; other options
        are those of `verify`.
        """
        files = {"probe": probe, "reference": reference}
        return self._request("POST", "/overlay", files, options=options).content

    def extract(self, image: Print, **options: Any) -> Template:
        """Return the template of a print; options are ``dpi``, ``enhance`` and ``format``."""
        content = self._request("POST", "/extract", {"image": image}, options=options).content
        return decode_record(content, "template.json").views[0].template

    def gallery(self) -> dict[str, Any]:
        """Return counts and sizes of the gallery."""
        return _document(self._request("GET", "/gallery"))

    def identify(self, probe: Print, **options: Any) -> dict[str, Any]:
        """Rank the enrolled fingers; ``candidates``, ``threshold`` limit the list.

        Other options are ``dpi`` and ``matcher``.
        """
        return _document(self._request("POST", "/identify", {"probe": probe}, options=options))

    def verify_claim(
        self, probe: Print, subject: str, finger: str = "", **options: Any
    ) -> dict[str, Any]:
        """Decide whether a probe comes from the claimed subject.

        Options are those of `verify` but ``probe_dpi`` and ``reference_dpi``.
        """
        files, values = {"probe": probe}, {"subject": subject, "finger": finger}
        return _document(self._request("POST", "/gallery/verify", files, values, options=options))

    def enrol(
        self, image: Print, subject: str = "", finger: str = "", impression: str = ""
    ) -> dict[str, Any]:
        """Enrol a print; without a subject the name of the file must contain it."""
        values = {"subject": subject, "finger": finger, "impression": impression}
        return _document(self._request("POST", "/enrol", {"image": image}, values))

    def prints(self, subject: str) -> list[dict[str, Any]]:
        """Return the enrolled prints of a subject."""
        response = self._request("GET", "/gallery/prints", query={"subject": subject})
        entries: list[dict[str, Any]] = _document(response)["prints"]
        return entries

    def remove(self, number: int) -> None:
        """Remove one enrolled print, by its number."""
        self._request("DELETE", f"/gallery/{number:d}")

    def remove_subject(self, subject: str) -> int:
        """Remove all enrolled prints of a subject; return how many."""
        response = self._request("DELETE", "/gallery/prints", query={"subject": subject})
        removed: int = _document(response)["removed"]
        return removed

    def _request(
        self,
        method: str,
        path: str,
        files: dict[str, Print] | None = None,
        values: dict[str, Any] | None = None,
        query: dict[str, str] | None = None,
        *,
        options: dict[str, Any] | None = None,
    ) -> httpx.Response:
        """Return the response to a request, sent again while the server is busy."""
        import httpx  # noqa: PLC0415

        values = {**(values or {}), **_checked(path, options or {})}
        parts = {role: _part(role, given) for role, given in (files or {}).items()}
        data = {name: str(value) for name, value in values.items() if value is not None}
        end = time.monotonic() + self._timeout
        while True:
            try:
                response = self._http.request(
                    method, path, files=parts or None, data=data or None, params=query
                )
            except httpx.HTTPError as error:
                raise ServerError(f"{self.address}: no answer: {error}") from error
            wait = _seconds(response.headers.get("retry-after", "1"))
            if response.status_code != _BUSY or time.monotonic() + wait > end:
                break
            time.sleep(wait)
        if response.status_code >= _LEAST_ERROR:
            raise ServerError(_error_of(response), response.status_code)
        return response


def _document(response: httpx.Response) -> dict[str, Any]:
    """Return the JSON document of a response."""
    document: dict[str, Any] = response.json()
    return document


def _checked(path: str, options: dict[str, Any]) -> dict[str, Any]:
    """Return the options of a request; ServerError for one that it does not take."""
    for name in options:
        if name not in _OPTIONS[path]:
            raise ServerError(unknown_name("option", name, _OPTIONS[path]))
    return options


def _part(role: str, given: Print) -> tuple[str, bytes]:
    """Return name and bytes of a print."""
    if isinstance(given, bytes):
        return role, given
    path = Path(given)
    try:
        return path.name, path.read_bytes()
    except OSError as error:
        raise FpmatchError(f"cannot be read: {reason(error)}", path=path) from error


def _seconds(text: str) -> float:
    return float(text) if text.isdecimal() else 1.0


def _error_of(response: httpx.Response) -> str:
    """Return the sentence of an error."""
    try:
        return str(response.json()["error"])
    except (json.JSONDecodeError, KeyError, TypeError):
        return f"status {response.status_code}"
