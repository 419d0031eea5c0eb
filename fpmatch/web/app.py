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
from fpmatch.web.errors import ClientGoneError, status_of
from fpmatch.web.guard import Guard
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
_GONE: Final = 499  # the client has closed the connection
_NO_ROUTE: Final = {
    404: "there is nothing at this address",
    405: "this address takes no such method",
}
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
    app.include_router(operations_router)
    app.include_router(router)
    if settings.gallery is not None:
        app.include_router(gallery_router)
    app.mount("/", StaticFiles(directory=STATIC, html=True))
    for kind in (FpmatchError, RequestValidationError, HTTPException, ClientGoneError, Exception):
        app.add_exception_handler(kind, _on_error)
    return Observer(Guard(app, settings), settings)


async def _on_error(request: Request, error: Exception) -> Response:
    """Return the response to an error: its status and one sentence."""
    match error:
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
            _log.error("%s %s failed", request.method, request.url.path, exc_info=error)
            status, text = 500, "internal error; see the output of the server"
    return JSONResponse({"error": " ".join(text.split())}, status)
