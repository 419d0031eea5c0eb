"""The addresses of the API: of its operation, of prints, and of its gallery."""

from __future__ import annotations

import asyncio
from typing import Annotated, Any, Final

from fastapi import APIRouter, Form, Query, Request, Response
from prometheus_client import CONTENT_TYPE_LATEST, generate_latest
from pydantic import AfterValidator, TypeAdapter, ValidationError

from fpmatch._version import __version__
from fpmatch.drawing.case_report import LONGEST_CASE_NUMBER, LONGEST_TEXT
from fpmatch.errors import unknown_name
from fpmatch.gallery.listing.entry import Label
from fpmatch.matching.registry import matcher_names
from fpmatch.printable import printable
from fpmatch.server import gallery as gallery_work
from fpmatch.server import models, pair, single
from fpmatch.server.errors import NotReadyError, RequestError
from fpmatch.server.pool import encoded
from fpmatch.server.prints import PrintOptions
from fpmatch.server.requests import (
    KNOWN_NAMES,
    Dpi,
    Drawing,
    EnrolledPair,
    Matcher,
    OneReading,
    Options,
    Run,
    Sender,
    ServerSettings,
    UploadedFile,
    UploadedPair,
    needs,
    read_upload,
)
from fpmatch.server.settings import Role

_ERRORS: dict[int | str, dict[str, Any]] = {
    401: {"model": models.Error, "description": "The token is missing or wrong"},
    403: {"model": models.Error, "description": "The role of the token does not permit this"},
    413: {"model": models.Error, "description": "A file is too large"},
    415: {"model": models.Error, "description": "The body is not a form with files"},
    422: {"model": models.Error, "description": "A print, field or parameter cannot be used"},
    503: {"model": models.Error, "description": "Too many requests, or a silent gallery"},
    504: {"model": models.Error, "description": "The work took too long and was stopped"},
}
_MEDIA: Final = {"png": "image/png", "svg": "image/svg+xml"}


def _content_of(*media: str) -> dict[str, Any]:
    """Return what a route declares that returns a file of one of these media types."""
    content: dict[str, Any] = {name: {} for name in media}
    return {"response_class": Response, "responses": {200: {"content": content}}}


_FILE: Final = _content_of("application/json", "application/octet-stream")
_PAGE: Final = _content_of("text/html")
_PICTURE: Final = _content_of(*_MEDIA.values())


def _one_line(text: str) -> str:
    """Return the value of a field; ValueError for one with control characters."""
    if printable(text) != text:
        raise ValueError("a control character, or text that is not UTF-8")
    return text


LabelPart = Annotated[str, Form(max_length=200), AfterValidator(_one_line)]
Subject = Annotated[str, Query(max_length=200), AfterValidator(_one_line)]

_READ, _VERIFY, _ENROL, _ADMIN = ([needs(role), KNOWN_NAMES] for role in Role)
operations_router = APIRouter(tags=["Operation"], responses={422: _ERRORS[422]})
router = APIRouter(tags=["Prints"], responses=_ERRORS, dependencies=_VERIFY)
gallery_router = APIRouter(tags=["Gallery"], responses=_ERRORS)


def _json(content: bytes) -> Response:
    """Return a response with a document that is encoded."""
    return Response(content, media_type="application/json")


def _download(content: bytes, name: str, media: str) -> Response:
    """Return a response with a file, under a name that no client has chosen."""
    headers = {"content-disposition": f'attachment; filename="{name}"'}
    return Response(content, media_type=media, headers=headers)


@operations_router.get("/health", summary="Whether the server answers", dependencies=[KNOWN_NAMES])
async def health() -> models.Health:
    """Return that the process answers; nothing is checked."""
    return models.Health(status="ok")


@operations_router.get(
    "/ready",
    summary="Whether the server can do work",
    dependencies=[KNOWN_NAMES],
    responses={503: {"model": models.Error, "description": "It cannot, for the reason stated"}},
)
async def ready(request: Request) -> models.Health:
    """Return that a worker process answers and the gallery can be opened, as of the last second."""
    faults = await asyncio.gather(*(check.fault() for check in request.app.state.checks))
    for fault in filter(None, faults):
        raise NotReadyError(str(fault)) from fault
    return models.Health(status="ready")


@operations_router.get(
    "/metrics",
    summary="Measurements in the text format of Prometheus",
    response_class=Response,
    dependencies=_READ,
    responses={200: {"content": {"text/plain": {}}}},
)
async def metrics(request: Request) -> Response:
    """Return numbers and times of requests, and CPU time and memory of the server."""
    registry = request.scope["fpmatch.observer"].registry
    return Response(generate_latest(registry), media_type=CONTENT_TYPE_LATEST)


@operations_router.get(
    "/about", summary="Version and limits of this server", dependencies=_READ, responses=_ERRORS
)
async def about(settings: ServerSettings, client: Sender) -> models.About:
    """Return version, matchers and limits, and the role of the client."""
    return models.About(
        version=__version__,
        gallery=None if settings.gallery is None else gallery_work.short_name(settings.gallery),
        matchers=matcher_names(),
        role=client.role.name.lower(),
        file_megabytes=settings.limits.file_megabytes,
        seconds=settings.limits.seconds,
    )


@router.post("/verify", summary="Decide whether two prints are of the same finger")
async def verify(run: Run, prints: UploadedPair) -> models.Verified:
    """Return what `fpmatch verify --json` prints."""
    document = await run(pair.verify_pair, prints)
    return models.Verified(**document)


@router.post(
    "/compare",
    summary="Decide, and return all that the web interface shows",
    response_model=models.Shown,
)
async def compare(run: Run, prints: UploadedPair) -> Response:
    """Return the decision, both prints with their minutiae and pictures, and the pairs."""
    content = await run(encoded, pair.show_pair, prints)
    return _json(content)


@gallery_router.post(
    "/gallery/{number}/compare",
    summary="Compare a probe with one enrolled print",
    response_model=models.Shown,
    dependencies=_VERIFY,
)
async def compare_enrolled(run: Run, prints: EnrolledPair) -> Response:
    """Return what `/compare` does; of the enrolled print, what its template contains."""
    return await compare(run, prints)


@router.post("/overlay", summary="Draw one print, moved, over the other", **_PICTURE)
async def overlay(run: Run, prints: UploadedPair, drawing: Drawing) -> Response:
    """Return the picture that `fpmatch verify --overlay` draws."""
    file_format, view = drawing
    content = await run(pair.draw_pair, prints, file_format, view)
    return _download(content, f"overlay.{file_format}", _MEDIA[file_format])


@router.post(
    "/views",
    summary="Where the ridges agree",
    response_model=models.Views,
)
async def further_views(run: Run, prints: UploadedPair) -> Response:
    """Return the map of ridge agreement."""
    content = await run(encoded, pair.show_views, prints)
    return _json(content)


@gallery_router.post(
    "/gallery/{number}/views",
    summary="Further views of a probe and one enrolled print",
    response_model=models.Views,
    dependencies=_VERIFY,
)
async def views_of_enrolled(run: Run, prints: EnrolledPair) -> Response:
    """Return what `/views` does."""
    return await further_views(run, prints)


@router.post("/case-report", summary="Report on a comparison, to be printed", **_PAGE)
async def case_report(
    run: Run,
    prints: UploadedPair,
    notes: Annotated[str, Form(max_length=LONGEST_TEXT)] = "",
    marks: Annotated[
        str, Form(max_length=LONGEST_TEXT, description="JSON: list of side, x, y, note")
    ] = "[]",
    case_number: Annotated[
        str, Form(max_length=LONGEST_CASE_NUMBER, description="On every page of the report")
    ] = "",
) -> Response:
    """Return the page that `fpmatch verify --case-report` writes."""
    try:
        placed = TypeAdapter(list[models.Mark]).validate_json(marks)
    except ValidationError as error:
        raise RequestError(f"marks: {_fault_of_marks(error)}") from None
    document = [mark.model_dump() for mark in placed]
    html = await run(pair.report_pair, prints, notes, document, case_number)
    return _download(html.encode(), "case.html", "text/html; charset=utf-8")


def _fault_of_marks(error: ValidationError) -> str:
    """Return why the marks of an examiner cannot be read."""
    for fault in error.errors():
        if fault["type"] == "extra_forbidden":
            return unknown_name("key", str(fault["loc"][-1]), models.Mark.model_fields)
    return "must be a JSON list of side, x, y and note"


@gallery_router.post(
    "/gallery/{number}/overlay",
    summary="Draw a probe, moved, over one enrolled print",
    dependencies=_VERIFY,
    **_PICTURE,
)
async def overlay_enrolled(run: Run, prints: EnrolledPair, drawing: Drawing) -> Response:
    """Return the picture that `/overlay` returns."""
    return await overlay(run, prints, drawing)


@router.post("/extract", summary="Return the template of a print", **_FILE)
async def extract(
    request: Request,
    run: Run,
    image: UploadedFile,
    reading: OneReading,
    file_format: Annotated[
        str, Form(alias="format", description="A format of `fpmatch convert`")
    ] = "json",
) -> Response:
    """Return the template as a file: JSON, which is complete, or another format."""
    upload = await read_upload(request, image, "image")
    content, suffix = await run(single.extract_template, upload, reading, file_format)
    media = "application/json" if suffix == ".json" else "application/octet-stream"
    return _download(content, f"template{suffix}", media)


@router.post("/stages", summary="Show each stage of an extraction", response_model=models.Stages)
async def stages(request: Request, run: Run, image: UploadedFile, reading: OneReading) -> Response:
    """Return the pictures that `fpmatch extract --format stages` writes."""
    upload = await read_upload(request, image, "image")
    content = await run(encoded, single.show_stages, upload, reading)
    return _json(content)


@gallery_router.get("/gallery", summary="Counts and sizes of the gallery", dependencies=_READ)
async def gallery(run: Run, settings: ServerSettings) -> models.GalleryInfo:
    """Return what `fpmatch gallery list --summary --json` prints."""
    return models.GalleryInfo(**await run(gallery_work.describe_gallery, settings.gallery))


@gallery_router.post(
    "/identify",
    summary="Rank the enrolled fingers by how well they match a probe",
    dependencies=_VERIFY,
)
async def identify(
    request: Request,
    run: Run,
    settings: ServerSettings,
    probe: UploadedFile,
    matcher: Matcher,
    dpi: Dpi = None,
    candidates: Annotated[int, Form(ge=1, description="Largest number of candidates")] = 10,
    threshold: Annotated[float, Form(description="Smallest score of a candidate")] = 0.0,
) -> models.Identified:
    """Return what `fpmatch identify --transform --json` prints of one probe."""
    upload = await read_upload(request, probe, "probe")
    reading, where = PrintOptions(settings.limits, dpi), settings.gallery
    arguments = (upload, reading, where, matcher, candidates, threshold)
    document = await run(gallery_work.identify_print, *arguments)
    return models.Identified(**document)


@gallery_router.post("/enrol", summary="Enrol one print", status_code=201, dependencies=_ENROL)
async def enrol(
    request: Request,
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
    upload = await read_upload(request, image, "image")
    if not subject and (finger or impression):
        raise RequestError("subject: required with finger or impression")
    label = Label(subject.strip(), finger.strip(), impression.strip()) if subject else None
    reading = PrintOptions(settings.limits, dpi)
    arguments = (upload, reading, settings.gallery, label, settings.pattern)
    document = await run(gallery_work.enrol_print, *arguments)
    if not document["enrolled"]:
        response.status_code = 200
    return models.Enrolled(**document)


@gallery_router.get(
    "/gallery/prints", summary="The enrolled prints of a subject", dependencies=_READ
)
async def list_prints(
    run: Run, settings: ServerSettings, subject: Subject
) -> models.EnrolledPrints:
    """Return what `fpmatch gallery list --subject --json` prints."""
    rows = await run(gallery_work.list_prints, settings.gallery, subject)
    return models.EnrolledPrints(prints=[models.EnrolledPrint(**one) for one in rows])


@gallery_router.post(
    "/gallery/verify",
    summary="Decide whether a probe comes from a claimed subject",
    dependencies=_VERIFY,
)
async def verify_claim(
    request: Request,
    run: Run,
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
    document = await run(gallery_work.verify_claim, *arguments)
    return models.CheckedClaim(**document)


@gallery_router.delete(
    "/gallery/prints", summary="Remove all enrolled prints of a subject", dependencies=_ADMIN
)
async def remove_subject(run: Run, settings: ServerSettings, subject: Subject) -> models.Removed:
    """Remove the templates of all prints of a subject."""
    removed = await run(gallery_work.remove_subject, settings.gallery, subject)
    return models.Removed(removed=len(removed))


@gallery_router.delete(
    "/gallery/{number}", summary="Remove one enrolled print", dependencies=_ADMIN
)
async def remove_print(run: Run, settings: ServerSettings, number: int) -> models.Removed:
    """Remove the template of entry `number`."""
    await run(gallery_work.remove_print, settings.gallery, number)
    return models.Removed(removed=1)
