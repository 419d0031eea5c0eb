"""Parts of a request, as the routes declare them."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal, cast

from fastapi import Depends, File, Form, Request, Response, UploadFile

from fpmatch.matching.matchers import DEFAULT_MATCHER
from fpmatch.pair import PairOptions
from fpmatch.web.errors import TooLargeError
from fpmatch.web.models import Error
from fpmatch.web.pool import Pool
from fpmatch.web.prints import PrintOptions, Upload, shown_name
from fpmatch.web.settings import Settings

# Errors of any route.
ERRORS: dict[int | str, dict[str, Any]] = {
    401: {"model": Error, "description": "The token is missing or wrong"},
    413: {"model": Error, "description": "A file is too large"},
    422: {"model": Error, "description": "A print cannot be read or used"},
    503: {"model": Error, "description": "Too many requests at once; see Retry-After"},
    504: {"model": Error, "description": "The work took too long and was stopped"},
}

MEDIA: Final = {"png": "image/png", "svg": "image/svg+xml"}
FILE: dict[int | str, dict[str, Any]] = {200: {"content": {"application/octet-stream": {}}}}
PICTURE: dict[int | str, dict[str, Any]] = {
    200: {"content": {media: {} for media in MEDIA.values()}}
}

UploadedFile = Annotated[UploadFile, File(description="An image or a template, by its content")]
Dpi = Annotated[float | None, Form(description="Resolution in dpi; by default that in the file")]
Matcher = Annotated[str, Form(description="Name of the matcher")]
Enhance = Annotated[Literal["learned", "filters"], Form(description="Enhancement of ridges")]

PictureFormat = Annotated[Literal["png", "svg"], Form(alias="format")]
SideBySide = Annotated[bool, Form(description="Draw the prints beside each other")]


async def _settings(request: Request) -> Settings:
    return cast("Settings", request.app.state.settings)


async def _pool(request: Request) -> Pool:
    return cast("Pool", request.app.state.pool)


async def _pair_options(
    matcher: Matcher = DEFAULT_MATCHER,
    fmr: Annotated[float | None, Form(description="Decide at this false match rate")] = None,
    threshold: Annotated[float | None, Form(description="Decide at this score")] = None,
    rho: Annotated[
        float | None, Form(description="Matcher paper: match over this share of minutiae paired")
    ] = None,
    area_tolerance: Annotated[
        float | None,
        Form(description="Matcher paper: largest difference in area of corresponding rings"),
    ] = None,
) -> PairOptions:
    return PairOptions(matcher, fmr, threshold, None, rho, area_tolerance)


async def _print_options(
    settings: Annotated[Settings, Depends(_settings)], dpi: Dpi = None, enhance: Enhance = "learned"
) -> PrintOptions:
    return PrintOptions(settings.limits, dpi, enhance)


async def _both_options(
    settings: Annotated[Settings, Depends(_settings)],
    dpi: Dpi = None,
    probe_dpi: Dpi = None,
    reference_dpi: Dpi = None,
    enhance: Enhance = "learned",
) -> tuple[PrintOptions, PrintOptions]:
    probe, reference = (
        PrintOptions(settings.limits, dpi if own is None else own, enhance)
        for own in (probe_dpi, reference_dpi)
    )
    return probe, reference


ServerSettings = Annotated[Settings, Depends(_settings)]
Workers = Annotated[Pool, Depends(_pool)]
Options = Annotated[PairOptions, Depends(_pair_options)]
OneReading = Annotated[PrintOptions, Depends(_print_options)]
BothReadings = Annotated[tuple[PrintOptions, PrintOptions], Depends(_both_options)]


async def read_upload(file: UploadFile, role: str, settings: Settings) -> Upload:
    """Return the bytes of an uploaded file; `role` is its name if it has none to show.

    Raises
    ------
    TooLargeError
        If there are more than the server accepts.
    """
    name, most = shown_name(file.filename, role), settings.limits.file_megabytes
    if (file.size or 0) > most * 1e6:
        raise TooLargeError(f"larger than {most:g} MB", path=name)
    return Upload(name, await file.read())


async def _both_uploads(
    probe: UploadedFile, reference: UploadedFile, settings: ServerSettings
) -> tuple[Upload, Upload]:
    return (
        await read_upload(probe, "probe", settings),
        await read_upload(reference, "reference", settings),
    )


BothUploads = Annotated[tuple[Upload, Upload], Depends(_both_uploads)]


def download(content: bytes, name: str, media: str) -> Response:
    """Return a response with a file, under a name that no client has chosen."""
    headers = {"content-disposition": f'attachment; filename="{name}"'}
    return Response(content, media_type=media, headers=headers)
