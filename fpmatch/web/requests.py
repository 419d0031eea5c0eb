"""Parts of a request, as the routes declare them."""

from __future__ import annotations

import hashlib
from typing import Annotated, Any, Final, Literal, cast

from fastapi import Depends, File, Form, Request, Response, Security, UploadFile, params
from fastapi.security import HTTPBearer

from fpmatch.matching.matchers import DEFAULT_MATCHER
from fpmatch.pair import PairOptions
from fpmatch.web.access import Client, Role
from fpmatch.web.errors import ForbiddenError, TooLargeError
from fpmatch.web.guard import CLIENT
from fpmatch.web.models import Error
from fpmatch.web.observer import AUDITED
from fpmatch.web.pool import Pool
from fpmatch.web.prints import PrintOptions, Upload, shown_name
from fpmatch.web.settings import Settings

# Errors of any route.
ERRORS: dict[int | str, dict[str, Any]] = {
    401: {"model": Error, "description": "The token is missing or wrong"},
    403: {"model": Error, "description": "The role of the token does not permit this"},
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


# Declares the token in the description of the API; `fpmatch.web.guard.Guard` checks it.
_BEARER: Final = HTTPBearer(auto_error=False, description="Token of the server or of a client")


def needs(role: Role) -> params.Depends:
    """Return the dependency that refuses clients without a role."""

    async def check(request: Request, _: Annotated[Any, Security(_BEARER)]) -> None:
        client = cast("Client", request.scope[CLIENT])
        if client.role < role:
            raise ForbiddenError(
                f"this needs the role {role.name.lower()}, and the token has "
                f"{client.role.name.lower()}",
                code="role",
            )

    return cast("params.Depends", Depends(check))


def audit(request: Request, **details: Any) -> None:
    """Add values to what the audit log states about a request."""
    request.scope.setdefault(AUDITED, {}).update(details)


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


async def read_upload(request: Request, file: UploadFile, role: str) -> Upload:
    """Return the bytes of an uploaded file; `role` is its name if it has none to show.

    The audit log states the SHA-256 of the file, not its name.

    Raises
    ------
    TooLargeError
        If there are more than the server accepts.
    """
    settings = await _settings(request)
    name, most = shown_name(file.filename, role), settings.limits.file_megabytes
    if (file.size or 0) > most * 1e6:
        raise TooLargeError(f"larger than {most:g} MB", path=name)
    data = await file.read()
    audit(request, **{role: hashlib.sha256(data).hexdigest()})
    return Upload(name, data)


async def _both_uploads(
    request: Request, probe: UploadedFile, reference: UploadedFile
) -> tuple[Upload, Upload]:
    return (
        await read_upload(request, probe, "probe"),
        await read_upload(request, reference, "reference"),
    )


BothUploads = Annotated[tuple[Upload, Upload], Depends(_both_uploads)]


def download(content: bytes, name: str, media: str) -> Response:
    """Return a response with a file, under a name that no client has chosen."""
    headers = {"content-disposition": f'attachment; filename="{name}"'}
    return Response(content, media_type=media, headers=headers)
