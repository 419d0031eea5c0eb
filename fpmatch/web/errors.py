"""What goes wrong with a request that no room of the package knows of, and its HTTP status."""

from __future__ import annotations

from typing import ClassVar

from fpmatch.errors import FpmatchError, GalleryError


class RequestError(FpmatchError):
    """A request asks for something that is not there, or contradicts itself."""

    status: ClassVar[int] = 422


class NotFoundError(RequestError):
    """What a request is about does not exist."""

    status = 404


class ConflictError(RequestError):
    """Something else stands where a request would put something."""

    status = 409


class TooLargeError(RequestError):
    """A file is larger than the server takes."""

    status = 413


class TooLongError(RequestError):
    """The work took longer than a request may."""

    status = 504


class WorkerError(RequestError):
    """A worker process ended before its work was done."""

    status = 500


class ClientGoneError(Exception):
    """Nobody waits for the answer any more."""


def status_of(error: FpmatchError) -> int:
    """Return the HTTP status that goes with an error.

    Examples
    --------
    >>> from fpmatch.errors import ImageReadError
    >>> status_of(ImageReadError("print.tif: the file is empty")), status_of(TooLongError("?"))
    (422, 504)
    """
    if isinstance(error, RequestError):
        return error.status
    return 500 if isinstance(error, GalleryError) else 422
