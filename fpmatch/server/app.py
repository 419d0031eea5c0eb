"""The server as an ASGI application."""

from __future__ import annotations

import asyncio
import logging
import secrets
from contextlib import asynccontextmanager
from functools import partial
from typing import TYPE_CHECKING, Final

import anyio
from anyio import to_thread
from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from fastapi.staticfiles import StaticFiles
from starlette.exceptions import HTTPException

from fpmatch._version import __version__
from fpmatch.errors import FpmatchError, GalleryError
from fpmatch.printable import printable
from fpmatch.server.access import Access
from fpmatch.server.errors import RETRY, ClientGoneError, NotReadyError, RequestError, status_of
from fpmatch.server.gallery import check_gallery, make_index
from fpmatch.server.pool import Pool
from fpmatch.server.routes import gallery_router, operations_router, router
from fpmatch.server.settings import STATIC
from fpmatch.server.watch import Check, Observer, route_of

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Mapping

    from starlette.types import Scope

    from fpmatch.server.settings import Settings

_DESCRIPTION: Final = (
    "Two images of fingerprints in; a decision, its certainty and the recovered transform out. "
    'Errors are `{"error": "one sentence"}`.'
)
_FAULTS: Final = {  # of the server, by the code of the error
    "missing key": "the gallery is encrypted, and the server has not its key",
    "plug-in": "a matcher or format of another package cannot be loaded",
}
_UNKNOWN: Final = "internal error"
_QUICK_S: Final = 2.0  # that an index may take without a word
_log: Final = logging.getLogger(__name__)


class _Page(StaticFiles):
    """The files of the web interface, where no route has the address of a request."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """Return a file; status 404 where there is none, 405 where it is not to be read."""
        response = await super().get_response(path, {**scope, "method": "GET"})
        if scope["method"] != "GET":
            raise HTTPException(405, headers={"Allow": "GET, HEAD"})
        return response


def make_app(settings: Settings, ready: Callable[[], None] = lambda: None) -> Observer:
    """Return the server as an ASGI application; `ready` is called when its processes answer."""
    pool = Pool(settings)
    checks = [Check("a worker process", pool.answer)]

    @asynccontextmanager
    async def started(app: FastAPI) -> AsyncIterator[None]:
        async with pool.running(), anyio.create_task_group() as group:
            if settings.gallery is not None:
                group.start_soon(_make_index, pool, settings.gallery, app.state.indexed)
            ready()
            yield
            group.cancel_scope.cancel()

    app = FastAPI(
        title="fpmatch",
        version=__version__,
        description=_DESCRIPTION,
        lifespan=started,
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
    )
    app.state.pool, app.state.settings, app.state.checks = pool, settings, checks
    app.state.indexed = asyncio.Event()
    app.include_router(operations_router)
    app.include_router(router)
    gallery = None
    if settings.gallery is not None:
        app.include_router(gallery_router)
        gallery = Check("the gallery", partial(to_thread.run_sync, check_gallery, settings.gallery))
        checks.append(gallery)
    app.state.gallery = gallery
    app.router.default = _Page(directory=STATIC, html=True)
    for kind in (FpmatchError, RequestValidationError, HTTPException, ClientGoneError, Exception):
        app.add_exception_handler(kind, _on_error)
    return Observer(Access(app, settings))


async def _make_index(pool: Pool, gallery: str, made: asyncio.Event) -> None:
    """Make the index of a gallery where it lacks one, and prepare a worker for searches."""
    making = asyncio.create_task(pool.prepare(make_index, gallery))
    try:
        if not (await asyncio.wait([making], timeout=_QUICK_S))[0]:
            _log.warning("the index of the gallery is being made: searches wait, or are refused")
        await making
    except FpmatchError as error:  # each search meets it, too
        _log.warning("the gallery cannot be searched: %s", error)
    finally:
        making.cancel()
        made.set()


async def _on_error(request: Request, error: Exception) -> Response:
    """Return the response to an error: its status and one sentence.

    What is wrong with the server, such as its gallery, is only in its log: it names files and
    hosts. The response contains the identifier under which the log has it.
    """
    headers: Mapping[str, str] | None = None
    match error:
        case NotReadyError():
            why = "the gallery cannot be opened, or no worker answers"
            return _incident(request, why, str(error), 503)
        case RequestError():
            status, text = error.status, str(error)
            if status == 503:
                headers = RETRY
        case FpmatchError() if status_of(error) == 500:
            other = "the gallery cannot be used" if isinstance(error, GalleryError) else _UNKNOWN
            why = _FAULTS.get(error.code, other)
            return _incident(request, why, str(error), 500)
        case FpmatchError():
            status, text = status_of(error), str(error)
        case RequestValidationError():
            first = error.errors()[0]
            where = ".".join(map(str, first["loc"][1:])) or "request"
            status, text = 422, f"{where}: {first['msg'][:1].lower()}{first['msg'][1:]}"
            if first["type"] == "extra_forbidden":
                text = f"unknown form field {first['loc'][-1]!r:.80}"
            elif "UploadFile" in text:
                text = f"{where}: must be a file, as curl -F {where}=@FILE sends it"
        case HTTPException() if error.status_code == 405:
            return _no_method(request, error)
        case HTTPException():
            status, text, headers = error.status_code, str(error.detail), error.headers
            text = "there is nothing at this address" if status == 404 else text
        case ClientGoneError():
            return Response(status_code=499)  # nobody reads it
        case _:
            kind = type(error).__name__
            return _incident(request, _UNKNOWN, kind, 500, error)
    return JSONResponse({"error": printable(" ".join(text.split()))}, status, headers)


def _no_method(request: Request, error: HTTPException) -> Response:
    """Return the response to a method that an address does not take: it names those that it does.

    Several routes may have the address.
    """
    described = request.app.openapi()["paths"].get(route_of(request.scope))
    stated = (error.headers or {})["Allow"].split(", ")
    methods = {method.upper() for method in described or stated}
    allowed = ", ".join(sorted(methods | ({"HEAD"} if "GET" in methods else set())))
    text = f"this address takes {allowed}, not {printable(request.method)}"
    return JSONResponse({"error": text}, 405, headers={"Allow": allowed})


def _incident(
    request: Request, sentence: str, reason: str, status: int, error: Exception | None = None
) -> Response:
    """Log why a request failed; return the response that contains the identifier of the reason."""
    number, why = secrets.token_hex(4), " ".join(reason.split())
    where = f"{request.method} {route_of(request.scope)}"
    _log.error("%s: %s: %s", number, where, why, exc_info=error)
    text = f"{sentence}: the log of the server has the reason under {number}"
    return JSONResponse({"error": text, "id": number}, status)
