"""The server as an ASGI application."""

from __future__ import annotations

import logging
from contextlib import asynccontextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from fastapi.staticfiles import StaticFiles
from starlette.exceptions import HTTPException

from fpmatch._version import __version__
from fpmatch.errors import FpmatchError
from fpmatch.web import gallery_routes, operations, routes
from fpmatch.web.errors import ClientGoneError, status_of
from fpmatch.web.guard import Guard
from fpmatch.web.observer import Observer
from fpmatch.web.pool import Pool

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from fpmatch.web.settings import Settings

STATIC: Final = Path(__file__).with_name("static")
_DESCRIPTION: Final = (
    "Two images of fingerprints in; a decision, its certainty and the recovered transform out. "
    'Errors are `{"error": "one sentence"}`.'
)
_GONE: Final = 499  # the client has closed the connection
_log: Final = logging.getLogger(__name__)


def make_app(settings: Settings) -> Observer:
    """Return the server as an ASGI application.

    Parameters
    ----------
    settings : Settings
        Limits, gallery, hosts, clients and audit log.

    Returns
    -------
    Observer
        The application behind its guard.

    Raises
    ------
    AuditError
        If the audit log cannot be written.

    Examples
    --------
    >>> from fpmatch.web.settings import Settings
    >>> type(make_app(Settings())).__name__
    'Observer'
    """
    pool = Pool(settings.workers, settings.limits.seconds)

    @asynccontextmanager
    async def started(_: FastAPI) -> AsyncIterator[None]:
        async with pool.running():
            yield

    app = FastAPI(
        title="fpmatch",
        version=__version__,
        description=_DESCRIPTION,
        lifespan=started,
        docs_url=None,
        redoc_url=None,
    )
    app.state.pool, app.state.settings = pool, settings
    app.include_router(operations.router)
    app.include_router(routes.router)
    if settings.gallery is not None:
        app.include_router(gallery_routes.router)
    app.mount("/", StaticFiles(directory=STATIC, html=True))
    app.add_exception_handler(FpmatchError, _on_bad_input)
    app.add_exception_handler(RequestValidationError, _on_malformed)
    app.add_exception_handler(HTTPException, _on_no_route)
    app.add_exception_handler(ClientGoneError, _on_client_gone)
    app.add_exception_handler(Exception, _on_mistake)
    return Observer(Guard(app, settings), settings)


def _error_response(status: int, text: str) -> JSONResponse:
    return JSONResponse({"error": " ".join(text.split())}, status)


async def _on_bad_input(_: Request, error: Exception) -> Response:
    assert isinstance(error, FpmatchError)
    return _error_response(status_of(error), str(error))


async def _on_malformed(_: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    where = ".".join(str(part) for part in first["loc"][1:]) or "request"
    return _error_response(422, f"{where}: {first['msg'][:1].lower()}{first['msg'][1:]}")


async def _on_no_route(_: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    words = {404: "there is nothing at this address", 405: "this address takes no such method"}
    return _error_response(error.status_code, words.get(error.status_code, str(error.detail)))


async def _on_client_gone(_: Request, __: Exception) -> Response:
    return Response(status_code=_GONE)


async def _on_mistake(request: Request, error: Exception) -> Response:
    _log.error("%s %s failed", request.method, request.url.path, exc_info=error)
    return _error_response(500, "internal error; see the output of the server")
