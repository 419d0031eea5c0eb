"""Errors of requests, and their HTTP statuses."""

from __future__ import annotations

from typing import ClassVar

from fpmatch.errors import FpmatchError, GalleryError


class RequestError(FpmatchError):
    """A request is contradictory or incomplete."""

    status: ClassVar[int] = 422


class ForbiddenError(RequestError):
    """The role of the client does not permit the request."""

    status = 403


class NotFoundError(RequestError):
    """The object of a request does not exist."""

    status = 404


class ConflictError(RequestError):
    """A request conflicts with what is enrolled."""

    status = 409


class TooLargeError(RequestError):
    """A file is larger than the server accepts."""

    status = 413


class TooLongError(RequestError):
    """The work took longer than a request may."""

    status = 504


class NotReadyError(RequestError):
    """The server cannot do work."""

    status = 503


class WorkerError(RequestError):
    """A worker process ended before its work was done."""

    status = 500


class ClientGoneError(Exception):
    """The client has closed the connection."""


def status_of(error: FpmatchError) -> int:
    """Return the HTTP status of an error.

    Examples
    --------
    >>> from fpmatch.errors import ImageReadError
    >>> status_of(ImageReadError("print.tif: the file is empty")), status_of(TooLongError("?"))
    (422, 504)
    """
    if isinstance(error, RequestError):
        return error.status
    return 500 if isinstance(error, GalleryError) else 422
