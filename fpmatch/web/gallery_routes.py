"""Routes of a server with a gallery: search it, and enrol in it."""

from __future__ import annotations

from typing import Annotated, Final

from fastapi import APIRouter, Form, Query, Request, Response

from fpmatch.gallery.entry import Label
from fpmatch.matching.matchers import DEFAULT_MATCHER
from fpmatch.web import gallery as work
from fpmatch.web import models, pair
from fpmatch.web.access import Role
from fpmatch.web.errors import RequestError
from fpmatch.web.prints import PrintOptions
from fpmatch.web.requests import (
    ERRORS,
    MEDIA,
    PICTURE,
    BothReadings,
    Dpi,
    Matcher,
    OneReading,
    Options,
    PictureFormat,
    ServerSettings,
    SideBySide,
    UploadedFile,
    Workers,
    audit,
    download,
    needs,
    read_upload,
)

_VERIFY: Final = [needs(Role.VERIFY)]
router = APIRouter(tags=["Gallery"], responses=ERRORS)

LabelPart = Annotated[str, Form(max_length=200)]


@router.get("/gallery", summary="Counts and sizes of the gallery", dependencies=[needs(Role.READ)])
async def gallery(request: Request, pool: Workers, settings: ServerSettings) -> models.GalleryInfo:
    """Return what `fpmatch gallery info --json` prints."""
    document = await pool.run(request, work.describe_gallery, settings.gallery)
    return models.GalleryInfo(**document)


@router.post(
    "/identify",
    summary="Rank the enrolled fingers by how well they match a probe",
    dependencies=_VERIFY,
)
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
        await read_upload(request, probe, "probe"),
        PrintOptions(settings.limits, dpi),
    )
    arguments = (upload, reading, settings.gallery, matcher, candidates, threshold)
    document = await pool.run(request, work.identify_print, *arguments)
    audit(request, candidates=[[found["id"], found["score"]] for found in document["candidates"]])
    return models.Identified(**document)


@router.post(
    "/gallery/{number}/compare",
    summary="Compare a probe with one enrolled print",
    dependencies=_VERIFY,
)
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
    upload = await read_upload(request, probe, "probe")
    enrolled = pair.EnrolledPrint(str(settings.gallery), number)
    wanted = pair.PairRequest(upload, enrolled, readings, options)
    document = await pool.run(request, pair.show_pair, wanted)
    match, score = document["result"]["match"], document["result"]["score"]
    audit(request, entries=[number], match=match, score=score)
    return models.Shown(**document)


@router.post(
    "/gallery/{number}/overlay",
    summary="Draw a probe, moved, over one enrolled print",
    dependencies=_VERIFY,
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
    upload = await read_upload(request, probe, "probe")
    enrolled = pair.EnrolledPrint(str(settings.gallery), number)
    wanted = pair.PairRequest(upload, enrolled, readings, options)
    content = await pool.run(request, pair.draw_pair, wanted, file_format, side_by_side)
    audit(request, entries=[number])
    return download(content, f"overlay.{file_format}", MEDIA[file_format])


@router.post("/enrol", summary="Enrol one print", status_code=201, dependencies=[needs(Role.ENROL)])
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
        await read_upload(request, image, "image"),
        PrintOptions(settings.limits, dpi),
    )
    if not subject and (finger or impression):
        raise RequestError("subject: required with finger or impression")
    label = Label(subject.strip(), finger.strip(), impression.strip()) if subject else None
    arguments = (upload, reading, settings.gallery, label, settings.pattern)
    document = await pool.run(request, work.enrol_print, *arguments)
    audit(request, enrolled=document["enrolled"], subject=document["subject"])
    if not document["enrolled"]:
        response.status_code = 200
    return models.Enrolled(**document)


@router.get(
    "/gallery/prints", summary="The enrolled prints of a subject", dependencies=[needs(Role.READ)]
)
async def list_prints(
    request: Request,
    pool: Workers,
    settings: ServerSettings,
    subject: Annotated[str, Query(max_length=200)],
) -> models.EnrolledPrints:
    """Return what `fpmatch gallery list --subject --json` prints."""
    audit(request, subject=subject)
    found = await pool.run(request, work.list_prints, settings.gallery, subject)
    return models.EnrolledPrints(prints=[models.EnrolledPrint(**one) for one in found])


@router.post(
    "/gallery/verify",
    summary="Decide whether a probe comes from a claimed subject",
    dependencies=_VERIFY,
)
async def verify_claim(
    request: Request,
    pool: Workers,
    settings: ServerSettings,
    probe: UploadedFile,
    subject: LabelPart,
    reading: OneReading,
    options: Options,
    finger: LabelPart = "",
) -> models.CheckedClaim:
    """Return what `fpmatch verify --gallery --subject --json` prints."""
    upload = await read_upload(request, probe, "probe")
    arguments = (upload, reading, settings.gallery, subject, finger or None, options)
    audit(request, subject=subject)
    document = await pool.run(request, work.verify_claim, *arguments)
    audit(request, match=document["match"], score=document["score"])
    return models.CheckedClaim(**document)


@router.delete(
    "/gallery/prints",
    summary="Remove all enrolled prints of a subject",
    dependencies=[needs(Role.ADMIN)],
)
async def remove_subject(
    request: Request,
    pool: Workers,
    settings: ServerSettings,
    subject: Annotated[str, Query(max_length=200)],
) -> models.Removed:
    """Remove the templates of all prints of a subject."""
    audit(request, subject=subject)
    removed = await pool.run(request, work.remove_subject, settings.gallery, subject)
    audit(request, entries=removed)
    return models.Removed(removed=len(removed))


@router.delete(
    "/gallery/{number}", summary="Remove one enrolled print", dependencies=[needs(Role.ADMIN)]
)
async def remove_print(
    request: Request, pool: Workers, settings: ServerSettings, number: int
) -> models.Removed:
    """Remove the template of entry `number`."""
    audit(request, entries=[number])
    await pool.run(request, work.remove_print, settings.gallery, number)
    return models.Removed(removed=1)
