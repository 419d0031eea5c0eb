"""The addresses under which prints are compared, drawn and looked into."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Form, Request, Response

from fpmatch._version import __version__
from fpmatch.matching.matchers import matcher_names
from fpmatch.web import models, pair, single
from fpmatch.web.requests import (
    ERRORS,
    Dpi,
    Enhance,
    Options,
    PrintFile,
    ServerSettings,
    Workers,
    read_upload,
)
from fpmatch.web.search import short_name

router = APIRouter(tags=["Prints"], responses=ERRORS)

_MEDIA = {"png": "image/png", "svg": "image/svg+xml"}
_FILE: dict[int | str, dict[str, Any]] = {200: {"content": {"application/octet-stream": {}}}}
_PICTURE: dict[int | str, dict[str, Any]] = {
    200: {"content": {media: {} for media in _MEDIA.values()}}
}


@router.get("/about", summary="What this server is and takes")
async def about(settings: ServerSettings) -> models.About:
    """Return version, matchers and limits."""
    return models.About(
        version=__version__,
        gallery=None if settings.gallery is None else short_name(settings.gallery),
        matchers=matcher_names(),
        file_megabytes=settings.limits.file_megabytes,
        seconds=settings.limits.seconds,
    )


@router.post("/verify", summary="Decide whether two prints are of the same finger")
async def verify(
    request: Request,
    pool: Workers,
    settings: ServerSettings,
    probe: PrintFile,
    reference: PrintFile,
    options: Options,
) -> models.Verified:
    """Return what `fpmatch verify --json` prints."""
    ours, theirs = await read_upload(probe, "probe"), await read_upload(reference, "reference")
    document = await pool.run(request, pair.verify_pair, ours, theirs, options, settings.limits)
    return models.Verified(**document)


@router.post("/compare", summary="Decide, and tell all that the page shows")
async def compare(
    request: Request,
    pool: Workers,
    settings: ServerSettings,
    probe: PrintFile,
    reference: PrintFile,
    options: Options,
) -> models.Shown:
    """Return the decision, both prints with their minutiae and pictures, and the pairs."""
    ours, theirs = await read_upload(probe, "probe"), await read_upload(reference, "reference")
    document = await pool.run(request, pair.show_pair, ours, theirs, options, settings.limits)
    return models.Shown(**document)


@router.post(
    "/overlay",
    summary="Draw one print, moved, over the other",
    response_class=Response,
    responses=_PICTURE,
)
async def overlay(
    request: Request,
    pool: Workers,
    settings: ServerSettings,
    probe: PrintFile,
    reference: PrintFile,
    options: Options,
    file_format: Annotated[Literal["png", "svg"], Form(alias="format")] = "png",
    side_by_side: Annotated[bool, Form(description="Set the prints beside each other")] = False,
) -> Response:
    """Return the picture that `fpmatch overlay` writes."""
    ours, theirs = await read_upload(probe, "probe"), await read_upload(reference, "reference")
    content = await pool.run(
        request,
        pair.draw_pair,
        ours,
        theirs,
        options,
        settings.limits,
        file_format,
        side_by_side,
    )
    return _download(content, f"overlay.{file_format}", _MEDIA[file_format])


@router.post(
    "/extract",
    summary="Return the template of a print",
    response_class=Response,
    responses=_FILE,
)
async def extract(
    request: Request,
    pool: Workers,
    settings: ServerSettings,
    image: PrintFile,
    dpi: Dpi = None,
    enhance: Enhance = "learned",
    file_format: Annotated[
        str, Form(alias="format", description="A format of `fpmatch convert`")
    ] = "json",
) -> Response:
    """Return the template as a file: JSON, which keeps everything, or another format."""
    upload = await read_upload(image, "image")
    content, suffix = await pool.run(
        request,
        single.extract_template,
        upload,
        dpi,
        enhance,
        file_format,
        settings.limits,
    )
    media = "application/json" if suffix == ".json" else "application/octet-stream"
    return _download(content, f"template{suffix}", media)


@router.post("/stages", summary="Show each stage of an extraction")
async def stages(
    request: Request,
    pool: Workers,
    settings: ServerSettings,
    image: PrintFile,
    dpi: Dpi = None,
    enhance: Enhance = "learned",
) -> models.Stages:
    """Return the pictures that `fpmatch stages` writes."""
    upload = await read_upload(image, "image")
    document = await pool.run(request, single.show_stages, upload, dpi, enhance, settings.limits)
    return models.Stages(**document)


def _download(content: bytes, name: str, media: str) -> Response:
    """Return a file, under a name that no client has chosen."""
    headers = {"content-disposition": f'attachment; filename="{name}"'}
    return Response(content, media_type=media, headers=headers)
