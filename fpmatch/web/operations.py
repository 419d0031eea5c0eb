"""Routes for those who operate a server: is it alive, is it ready, what does it do."""

from __future__ import annotations

from typing import Final

from fastapi import APIRouter, Request, Response
from prometheus_client import CONTENT_TYPE_LATEST, generate_latest

from fpmatch._version import __version__
from fpmatch.errors import FpmatchError
from fpmatch.matching.matchers import matcher_names
from fpmatch.web import gallery as work
from fpmatch.web import models
from fpmatch.web.access import Role
from fpmatch.web.errors import NotReadyError
from fpmatch.web.gallery import short_name
from fpmatch.web.requests import ERRORS, ServerSettings, Workers, needs

router: Final = APIRouter(tags=["Operation"])


@router.get("/health", summary="Whether the server answers")
async def health() -> models.Health:
    """Return that the process answers; nothing is checked."""
    return models.Health(status="ok")


@router.get(
    "/ready",
    summary="Whether the server can do work",
    responses={503: {"model": models.Error, "description": "It cannot, for the reason stated"}},
)
async def ready(request: Request, pool: Workers, settings: ServerSettings) -> models.Health:
    """Return that a worker process answers and the gallery can be opened."""
    try:
        await pool.run(request, work.check_gallery, settings.gallery)
    except FpmatchError:
        raise NotReadyError("the gallery cannot be opened, or no worker answers") from None
    return models.Health(status="ready")


@router.get(
    "/metrics",
    summary="Measurements in the text format of Prometheus",
    response_class=Response,
    dependencies=[needs(Role.READ)],
    responses={200: {"content": {"text/plain": {}}}},
)
async def metrics(request: Request) -> Response:
    """Return numbers and times of requests, and CPU time and memory of the server."""
    registry = request.scope["fpmatch.observer"].registry
    return Response(generate_latest(registry), media_type=CONTENT_TYPE_LATEST)


@router.get(
    "/about",
    summary="Version and limits of this server",
    dependencies=[needs(Role.READ)],
    responses=ERRORS,
)
async def about(settings: ServerSettings) -> models.About:
    """Return version, matchers and limits."""
    return models.About(
        version=__version__,
        gallery=None if settings.gallery is None else short_name(settings.gallery),
        matchers=matcher_names(),
        file_megabytes=settings.limits.file_megabytes,
        seconds=settings.limits.seconds,
    )
