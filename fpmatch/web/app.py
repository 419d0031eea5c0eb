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
from fpmatch.errors import FpmatchError, GalleryError
from fpmatch.web.auditor import route_of
from fpmatch.web.errors import ClientGoneError, NotReadyError, status_of
from fpmatch.web.guard import Guard
from fpmatch.web.logs import Incidents
from fpmatch.web.observer import Observer
from fpmatch.web.pool import Pool
from fpmatch.web.routes import gallery_router, operations_router, router

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from fpmatch.web.settings import Settings

STATIC: Final = Path(__file__).with_name("static")
_DESCRIPTION: Final = (
    "Two images of fingerprints in; a decision, its certainty and the recovered transform out. "
    'Errors are `{"error": "one sentence"}`.'
)
_INTERNAL: Final = 500
_GONE: Final = 499  # the client has closed the connection
_NO_ROUTE: Final = {
    404: "there is nothing at this address",
    405: "this address takes no such method",
}
_NO_KEY: Final = "the gallery is encrypted, and the server has not its key"
_log: Final = logging.getLogger(__name__)


def make_app(settings: Settings) -> Observer:
    """Return the server as an ASGI application behind its guard, with metrics and logs."""
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
    app.state.incidents = Incidents(_log)
    app.include_router(operations_router)
    app.include_router(router)
    if settings.gallery is not None:
        app.include_router(gallery_router)
    app.mount("/", StaticFiles(directory=STATIC, html=True))
    for kind in (FpmatchError, RequestValidationError, HTTPException, ClientGoneError, Exception):
        app.add_exception_handler(kind, _on_error)
    return Observer(Guard(app, settings), settings)


async def _on_error(request: Request, error: Exception) -> Response:
    """Return the response to an error: its status and one sentence.

    What is wrong with the server, such as its gallery, is only in its log: it names files and
    hosts. The response contains the identifier under which the log has it.
    """
    match error:
        case NotReadyError():
            why = "the gallery cannot be opened, or no worker answers"
            return _incident(request, why, str(error), 503)
        case GalleryError() if status_of(error) == _INTERNAL:
            keyless = error.code == "missing key"
            why = _NO_KEY if keyless else "the gallery cannot be used"
            return _incident(request, why, str(error), _INTERNAL)
        case FpmatchError():
            status, text = status_of(error), str(error)
        case RequestValidationError():
            first = error.errors()[0]
            where = ".".join(map(str, first["loc"][1:])) or "request"
            status, text = 422, f"{where}: {first['msg'][:1].lower()}{first['msg'][1:]}"
        case HTTPException():
            status, text = error.status_code, _NO_ROUTE.get(error.status_code, str(error.detail))
        case ClientGoneError():
            return Response(status_code=_GONE)
        case _:
            kind = type(error).__name__
            return _incident(request, "internal error", kind, _INTERNAL, error)
    return JSONResponse({"error": " ".join(text.split())}, status)


def _incident(
    request: Request, sentence: str, reason: str, status: int, error: Exception | None = None
) -> Response:
    """Log why a request failed; return the response that contains the identifier of the reason."""
    incidents: Incidents = request.app.state.incidents
    where = f"{request.method} {route_of(request.scope)}"
    number = incidents.report(f"{where}: {' '.join(reason.split())}", error)
    text = f"{sentence}: the log of the server has the reason under {number}"
    return JSONResponse({"error": text, "id": number}, status)
