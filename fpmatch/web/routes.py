"""The addresses of the API: those of any server, and those of one with a gallery."""

from __future__ import annotations

from typing import Annotated, Any, Final

from fastapi import APIRouter, Form, Response

from fpmatch._version import __version__
from fpmatch.gallery.entry import Label
from fpmatch.matching.matchers import DEFAULT_MATCHER, matcher_names
from fpmatch.web import gallery as gallery_work
from fpmatch.web import models, pair, single
from fpmatch.web.errors import RequestError
from fpmatch.web.prints import PrintOptions
from fpmatch.web.requests import (
    Dpi,
    Drawing,
    EnrolledPair,
    Matcher,
    OneReading,
    Run,
    ServerSettings,
    UploadedFile,
    UploadedPair,
    read_upload,
)

_ERRORS: dict[int | str, dict[str, Any]] = {
    401: {"model": models.Error, "description": "The token is missing or wrong"},
    413: {"model": models.Error, "description": "A file is too large"},
    422: {"model": models.Error, "description": "A print cannot be read or used"},
    503: {"model": models.Error, "description": "Too many requests at once; see Retry-After"},
    504: {"model": models.Error, "description": "The work took too long and was stopped"},
}
_MEDIA: Final = {"png": "image/png", "svg": "image/svg+xml"}


def _content_of(*media: str) -> dict[str, Any]:
    """Return what a route declares that returns a file of one of these media types."""
    content: dict[str, Any] = {name: {} for name in media}
    return {"response_class": Response, "responses": {200: {"content": content}}}


_FILE: Final = _content_of("application/octet-stream")
_PICTURE: Final = _content_of(*_MEDIA.values())

LabelPart = Annotated[str, Form(max_length=200)]

router = APIRouter(tags=["Prints"], responses=_ERRORS)
gallery_router = APIRouter(tags=["Gallery"], responses=_ERRORS)


def _download(content: bytes, name: str, media: str) -> Response:
    """Return a response with a file, under a name that no client has chosen."""
    headers = {"content-disposition": f'attachment; filename="{name}"'}
    return Response(content, media_type=media, headers=headers)


@router.get("/about", summary="Version and limits of this server")
async def about(settings: ServerSettings) -> models.About:
    """Return version, matchers and limits."""
    return models.About(
        version=__version__,
        gallery=None if settings.gallery is None else gallery_work.short_name(settings.gallery),
        matchers=matcher_names(),
        file_megabytes=settings.limits.file_megabytes,
        seconds=settings.limits.seconds,
    )


@router.post("/verify", summary="Decide whether two prints are of the same finger")
async def verify(run: Run, prints: UploadedPair) -> models.Verified:
    """Return what `fpmatch verify --json` prints."""
    return models.Verified(**await run(pair.verify_pair, prints))


@router.post("/compare", summary="Decide, and return all that the web interface shows")
async def compare(run: Run, prints: UploadedPair) -> models.Shown:
    """Return the decision, both prints with their minutiae and pictures, and the pairs."""
    return models.Shown(**await run(pair.show_pair, prints))


@gallery_router.post("/gallery/{number}/compare", summary="Compare a probe with one enrolled print")
async def compare_enrolled(run: Run, prints: EnrolledPair) -> models.Shown:
    """Return what `/compare` does; of the enrolled print, what its template contains."""
    return models.Shown(**await run(pair.show_pair, prints))


@router.post("/overlay", summary="Draw one print, moved, over the other", **_PICTURE)
async def overlay(run: Run, prints: UploadedPair, drawing: Drawing) -> Response:
    """Return the picture that `fpmatch overlay` writes."""
    file_format, side_by_side = drawing
    content = await run(pair.draw_pair, prints, file_format, side_by_side)
    return _download(content, f"overlay.{file_format}", _MEDIA[file_format])


@gallery_router.post(
    "/gallery/{number}/overlay", summary="Draw a probe, moved, over one enrolled print", **_PICTURE
)
async def overlay_enrolled(run: Run, prints: EnrolledPair, drawing: Drawing) -> Response:
    """Return the picture that `/overlay` returns."""
    return await overlay(run, prints, drawing)


@router.post("/extract", summary="Return the template of a print", **_FILE)
async def extract(
    run: Run,
    settings: ServerSettings,
    image: UploadedFile,
    reading: OneReading,
    file_format: Annotated[
        str, Form(alias="format", description="A format of `fpmatch convert`")
    ] = "json",
) -> Response:
    """Return the template as a file: JSON, which is complete, or another format."""
    upload = await read_upload(image, "image", settings)
    content, suffix = await run(single.extract_template, upload, reading, file_format)
    media = "application/json" if suffix == ".json" else "application/octet-stream"
    return _download(content, f"template{suffix}", media)


@router.post("/stages", summary="Show each stage of an extraction")
async def stages(
    run: Run, settings: ServerSettings, image: UploadedFile, reading: OneReading
) -> models.Stages:
    """Return the pictures that `fpmatch stages` writes."""
    upload = await read_upload(image, "image", settings)
    return models.Stages(**await run(single.show_stages, upload, reading))


@gallery_router.get("/gallery", summary="Counts and sizes of the gallery")
async def gallery(run: Run, settings: ServerSettings) -> models.GalleryInfo:
    """Return what `fpmatch gallery info --json` prints."""
    return models.GalleryInfo(**await run(gallery_work.describe_gallery, settings.gallery))


@gallery_router.post(
    "/identify", summary="Rank the enrolled fingers by how well they match a probe"
)
async def identify(
    run: Run,
    settings: ServerSettings,
    probe: UploadedFile,
    dpi: Dpi = None,
    matcher: Matcher = DEFAULT_MATCHER,
    candidates: Annotated[int, Form(ge=1, description="Largest number of candidates")] = 10,
    threshold: Annotated[float, Form(description="Smallest score of a candidate")] = 0.0,
) -> models.Identified:
    """Return what `fpmatch identify --transform --json` prints of one probe."""
    upload = await read_upload(probe, "probe", settings)
    reading, where = PrintOptions(settings.limits, dpi), settings.gallery
    arguments = (upload, reading, where, matcher, candidates, threshold)
    return models.Identified(**await run(gallery_work.identify_print, *arguments))


@gallery_router.post("/enrol", summary="Enrol one print", status_code=201)
async def enrol(
    response: Response,
    run: Run,
    settings: ServerSettings,
    image: UploadedFile,
    subject: LabelPart = "",
    finger: LabelPart = "",
    impression: LabelPart = "",
    dpi: Dpi = None,
) -> models.Enrolled:
    """Keep the template of a print, but no image; 201 if it is new, 200 if it is known.

    Without a subject, the name of the file must contain it.
    """
    upload = await read_upload(image, "image", settings)
    if not subject and (finger or impression):
        raise RequestError("subject: required with finger or impression")
    label = Label(subject.strip(), finger.strip(), impression.strip()) if subject else None
    reading = PrintOptions(settings.limits, dpi)
    arguments = (upload, reading, settings.gallery, label, settings.pattern)
    document = await run(gallery_work.enrol_print, *arguments)
    if not document["enrolled"]:
        response.status_code = 200
    return models.Enrolled(**document)
