"""The addresses that are there where a gallery was given: search it, enrol in it."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Form, Request, Response

from fpmatch.gallery.entry import Label
from fpmatch.matching.matchers import DEFAULT_MATCHER
from fpmatch.web import models, pair, search
from fpmatch.web.errors import RequestError
from fpmatch.web.requests import (
    ERRORS,
    MEDIA,
    PICTURE,
    Dpi,
    Matcher,
    Options,
    PictureFormat,
    PrintFile,
    ServerSettings,
    SideBySide,
    Workers,
    download,
    read_upload,
)

router = APIRouter(tags=["Gallery"], responses=ERRORS)

LabelPart = Annotated[str, Form(max_length=200)]


@router.get("/gallery", summary="The gallery in figures")
async def gallery(request: Request, pool: Workers, settings: ServerSettings) -> models.GalleryInfo:
    """Return what `fpmatch gallery info --json` prints."""
    document = await pool.run(request, search.describe_gallery, settings.gallery)
    return models.GalleryInfo(**document)


@router.post("/identify", summary="Rank the enrolled prints by how well they match a probe")
async def identify(
    request: Request,
    pool: Workers,
    settings: ServerSettings,
    probe: PrintFile,
    dpi: Dpi = None,
    matcher: Matcher = DEFAULT_MATCHER,
    candidates: Annotated[int, Form(ge=1, description="How many, at most")] = 10,
    threshold: Annotated[float, Form(description="Score that they must reach")] = 0.0,
) -> models.Identified:
    """Return what `fpmatch identify --transform --json` prints of one probe."""
    upload = await read_upload(probe, "probe", settings)
    document = await pool.run(
        request,
        search.identify_print,
        upload,
        settings.gallery,
        matcher,
        candidates,
        threshold,
        dpi,
        settings.limits,
    )
    return models.Identified(**document)


@router.post("/gallery/{number}/compare", summary="Compare a probe with one enrolled print")
async def compare_enrolled(
    request: Request,
    pool: Workers,
    settings: ServerSettings,
    number: int,
    probe: PrintFile,
    options: Options,
) -> models.Shown:
    """Return what `/compare` does; of the enrolled print there is what its template keeps."""
    upload = await read_upload(probe, "probe", settings)
    enrolled = pair.Enrolled(str(settings.gallery), number)
    document = await pool.run(request, pair.show_pair, upload, enrolled, options, settings.limits)
    return models.Shown(**document)


@router.post(
    "/gallery/{number}/overlay",
    summary="Draw a probe, moved, over one enrolled print",
    response_class=Response,
    responses=PICTURE,
)
async def overlay_enrolled(
    request: Request,
    pool: Workers,
    settings: ServerSettings,
    number: int,
    probe: PrintFile,
    options: Options,
    file_format: PictureFormat = "png",
    side_by_side: SideBySide = False,
) -> Response:
    """Return the picture that `/overlay` returns."""
    upload = await read_upload(probe, "probe", settings)
    enrolled = pair.Enrolled(str(settings.gallery), number)
    content = await pool.run(
        request,
        pair.draw_pair,
        upload,
        enrolled,
        options,
        settings.limits,
        file_format,
        side_by_side,
    )
    return download(content, f"overlay.{file_format}", MEDIA[file_format])


@router.post("/enrol", summary="Enrol one print", status_code=201)
async def enrol(
    request: Request,
    response: Response,
    pool: Workers,
    settings: ServerSettings,
    image: PrintFile,
    subject: LabelPart = "",
    finger: LabelPart = "",
    impression: LabelPart = "",
    dpi: Dpi = None,
) -> models.Enrolled:
    """Keep the template of a print, and no picture; 201 where it is new, 200 where it is known.

    Without a subject, the name of the file must tell whose it is.
    """
    upload = await read_upload(image, "image", settings)
    if not subject and (finger or impression):
        raise RequestError("subject: say whose print it is, or leave out finger and impression")
    label = Label(subject.strip(), finger.strip(), impression.strip()) if subject else None
    document = await pool.run(
        request,
        search.enrol_print,
        upload,
        settings.gallery,
        label,
        settings.pattern,
        dpi,
        settings.limits,
    )
    if not document["enrolled"]:
        response.status_code = 200
    return models.Enrolled(**document)
