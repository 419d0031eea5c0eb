"""Errors of requests, and their HTTP statuses."""

from __future__ import annotations

from typing import Final

from fpmatch.errors import FpmatchError, GalleryError

BUSY: Final = "too many requests at once: try again shortly"
RETRY: Final = {"retry-after": "5"}


class RequestError(FpmatchError):
    """A request cannot be met: by default, because it is contradictory or incomplete."""

    def __init__(self, message: str = "", *, path: object = "", status: int = 422) -> None:
        super().__init__(message, path=path)
        self.status = status


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
