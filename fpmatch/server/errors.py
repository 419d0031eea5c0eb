"""Errors of requests, and their HTTP statuses."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Final

from fpmatch.errors import FpmatchError, GalleryError

if TYPE_CHECKING:
    from starlette.types import Send

BUSY: Final = "too many requests at once: try again shortly"
RETRY: Final = ((b"retry-after", b"5"),)


class RequestError(FpmatchError):
    """A request cannot be met: by default, because it is contradictory or incomplete."""

    def __init__(self, message: str = "", *, path: object = "", status: int = 422) -> None:
        super().__init__(message, path=path)
        self.status = status


class TooLongError(RequestError):
    """The work took longer than a request may."""


class WorkerError(RequestError):
    """A worker process ended before its work was done."""


class NotReadyError(GalleryError):
    """The server can do no work now, or none on its gallery."""


class ClientGoneError(Exception):
    """The client has closed the connection."""


def status_of(error: FpmatchError) -> int:
    """Return the HTTP status of an error; 500 also if it names a plug-in or file of the server."""
    if isinstance(error, RequestError):
        return error.status
    if error.code == "bounds":
        return 400
    if isinstance(error, GalleryError):
        return 422 if error.code == "label" else 500
    is_ours = error.code == "plug-in" or "/" in error.path or "\\" in error.path
    return 500 if is_ours else 422


async def send_error(send: Send, status: int, sentence: str, *headers: tuple[bytes, bytes]) -> None:
    """Send the whole response to a request that is refused."""
    content = json.dumps({"error": sentence}).encode()
    described = (
        (b"content-type", b"application/json"),
        (b"content-length", str(len(content)).encode()),
    )
    start = {"type": "http.response.start", "status": status, "headers": [*described, *headers]}
    await send(start)
    await send({"type": "http.response.body", "body": content})
