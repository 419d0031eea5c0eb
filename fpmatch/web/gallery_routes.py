"""Routes of a server with a gallery: search it, and enrol in it."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Form, Request, Response

from fpmatch.gallery.entry import Label
from fpmatch.matching.matchers import DEFAULT_MATCHER
from fpmatch.web import gallery as work
from fpmatch.web import models, pair
from fpmatch.web.errors import RequestError
from fpmatch.web.prints import PrintOptions
from fpmatch.web.requests import (
    ERRORS,
    MEDIA,
    PICTURE,
    BothReadings,
    Dpi,
    Matcher,
    Options,
    PictureFormat,
    ServerSettings,
    SideBySide,
    UploadedFile,
    Workers,
    download,
    read_upload,
)

router = APIRouter(tags=["Gallery"], responses=ERRORS)

LabelPart = Annotated[str, Form(max_length=200)]


@router.get("/gallery", summary="Counts and sizes of the gallery")
async def gallery(request: Request, pool: Workers, settings: ServerSettings) -> models.GalleryInfo:
    """Return what `fpmatch gallery info --json` prints."""
    document = await pool.run(request, work.describe_gallery, settings.gallery)
    return models.GalleryInfo(**document)


@router.post("/identify", summary="Rank the enrolled fingers by how well they match a probe")
async def identify(
    request: Request,
    pool: Workers,
    settings: ServerSettings,
    probe: UploadedFile,
    dpi: Dpi = None,
    matcher: Matcher = DEFAULT_MATCHER,
    candidates: Annotated[int, Form(ge=1, description="Largest number of candidates")] = 10,
    threshold: Annotated[float, Form(description="Smallest score of a candidate")] = 0.0,
) -> models.Identified:
    """Return what `fpmatch identify --transform --json` prints of one probe."""
    upload, reading = (
        await read_upload(probe, "probe", settings),
        PrintOptions(settings.limits, dpi),
    )
    arguments = (upload, reading, settings.gallery, matcher, candidates, threshold)
    return models.Identified(**await pool.run(request, work.identify_print, *arguments))


@router.post("/gallery/{number}/compare", summary="Compare a probe with one enrolled print")
async def compare_enrolled(
    request: Request,
    pool: Workers,
    settings: ServerSettings,
    number: int,
    probe: UploadedFile,
    readings: BothReadings,
    options: Options,
) -> models.Shown:
    """Return what `/compare` does; of the enrolled print, what its template contains."""
    upload = await read_upload(probe, "probe", settings)
    enrolled = pair.EnrolledPrint(str(settings.gallery), number)
    wanted = pair.PairRequest(upload, enrolled, readings, options)
    return models.Shown(**await pool.run(request, pair.show_pair, wanted))


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
    probe: UploadedFile,
    readings: BothReadings,
    options: Options,
    file_format: PictureFormat = "png",
    side_by_side: SideBySide = False,
) -> Response:
    """Return the picture that `/overlay` returns."""
    upload = await read_upload(probe, "probe", settings)
    enrolled = pair.EnrolledPrint(str(settings.gallery), number)
    wanted = pair.PairRequest(upload, enrolled, readings, options)
    content = await pool.run(request, pair.draw_pair, wanted, file_format, side_by_side)
    return download(content, f"overlay.{file_format}", MEDIA[file_format])


@router.post("/enrol", summary="Enrol one print", status_code=201)
async def enrol(
    request: Request,
    response: Response,
    pool: Workers,
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
    upload, reading = (
        await read_upload(image, "image", settings),
        PrintOptions(settings.limits, dpi),
    )
    if not subject and (finger or impression):
        raise RequestError("subject: required with finger or impression")
    label = Label(subject.strip(), finger.strip(), impression.strip()) if subject else None
    arguments = (upload, reading, settings.gallery, label, settings.pattern)
    document = await pool.run(request, work.enrol_print, *arguments)
    if not document["enrolled"]:
        response.status_code = 200
    return models.Enrolled(**document)
