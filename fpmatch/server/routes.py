"""The addresses of the API: of its operation, of prints, and of its gallery."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Annotated, Any, Final

from fastapi import APIRouter, Query, Request, Response
from prometheus_client import CONTENT_TYPE_LATEST, generate_latest
from pydantic import BaseModel

from fpmatch._version import __version__
from fpmatch.gallery.listing.entry import Label
from fpmatch.matching.registry import matcher_names
from fpmatch.server import forms, pair
from fpmatch.server import gallery as gallery_work
from fpmatch.server.errors import NotReadyError, RequestError
from fpmatch.server.forms import FORM, Context, Here, LabelPart, needs, takes
from fpmatch.server.pair import PairRequest
from fpmatch.server.pool import encoded
from fpmatch.server.settings import Role

Document = dict[str, Any]  # docs/reference/results.md describes those of the commands


class Error(BaseModel):
    """An error, in one sentence."""

    error: str
    id: str | None = None
    """Where the server is the reason: under what its log has more."""


_ERRORS: dict[int | str, dict[str, Any]] = {
    401: {"model": Error, "description": "The token is missing or wrong"},
    403: {"model": Error, "description": "The role of the token does not permit this"},
    413: {"model": Error, "description": "A file is too large"},
    415: {"model": Error, "description": "The body is not a form with files"},
    422: {"model": Error, "description": "A print, field or parameter cannot be used"},
    503: {"model": Error, "description": "Too many requests, or a silent gallery"},
    504: {"model": Error, "description": "The work took too long and was stopped"},
}
_MEDIA: Final = {"png": "image/png", "svg": "image/svg+xml"}


def _content_of(*media: str) -> dict[str, Any]:
    """Return what a route declares that returns a file of one of these media types."""
    content: dict[str, Any] = {name: {} for name in media}
    return {"response_class": Response, "responses": {200: {"content": content}}}


_FILE: Final = _content_of("application/json", "application/octet-stream")
_PAGE: Final = _content_of("text/html")
_SHOWN: Final = _content_of("application/json")
_PICTURE: Final = _content_of(*_MEDIA.values())


_ALONE: Final = takes()
_READ, _VERIFY, _ENROL, _ADMIN = ([needs(role), _ALONE] for role in Role)
_OF_SUBJECT: Final = takes("subject")
Subject = Annotated[LabelPart, Query()]
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


@operations_router.get("/health", summary="Whether the server answers", dependencies=[_ALONE])
async def health() -> Document:
    """Return that the process answers; nothing is checked."""
    return {"status": "ok"}


@operations_router.get(
    "/ready",
    summary="Whether the server can do work",
    dependencies=[_ALONE],
    responses={503: {"model": Error, "description": "It cannot, for the reason stated"}},
)
async def ready(request: Request) -> Document:
    """Return that a worker process answers and the gallery can be opened, as of the last second."""
    faults = await asyncio.gather(*(check.fault() for check in request.app.state.checks))
    for fault in filter(None, faults):
        raise NotReadyError(str(fault)) from fault
    return {"status": "ready"}


@operations_router.get(
    "/metrics",
    summary="Measurements in the text format of Prometheus",
    response_class=Response,
    dependencies=_READ,
    responses={200: {"content": {"text/plain": {}}}},
)
async def metrics(request: Request) -> Response:
    """Return numbers and times of requests, and CPU time and memory of the server."""
    registry = request.scope["fpmatch.registry"]
    return Response(generate_latest(registry), media_type=CONTENT_TYPE_LATEST)


@operations_router.get(
    "/about", summary="Version and limits of this server", dependencies=_READ, responses=_ERRORS
)
async def about(here: Here) -> Document:
    """Return version, matchers and limits, and the role of the client."""
    none = here.settings.gallery is None
    return {
        "version": __version__,
        "gallery": None if none else gallery_work.short_name(here.where),
        "matchers": matcher_names(),
        "role": here.client.role.name.lower(),
        "file_megabytes": here.limits.file_megabytes,
        "seconds": here.limits.seconds,
    }


@router.post("/verify", summary="Decide whether two prints are of the same finger")
async def verify(here: Here, form: Annotated[forms.PairForm, FORM]) -> Document:
    """Return what `fpmatch verify --json` prints."""
    return await here.run(pair.verify_pair, await form.pair(here, None))


async def compare(here: Context, _: forms.EnrolledPairForm, prints: PairRequest) -> Response:
    """Return the decision, both prints with their minutiae and pictures, and the pairs.

    Of an enrolled print it is what its template contains.
    """
    return _json(await here.run_pair(prints, encoded, pair.show_pair, prints))


async def views(here: Context, _: forms.EnrolledPairForm, prints: PairRequest) -> Response:
    """Return the map of ridge agreement."""
    return _json(await here.run_pair(prints, encoded, pair.show_views, prints))


async def overlay(here: Context, form: forms.EnrolledOverlayForm, prints: PairRequest) -> Response:
    """Return the picture that `fpmatch verify --overlay` draws."""
    kind = form.format
    content = await here.run_pair(prints, pair.draw_pair, prints, kind, form.view())
    return _download(content, f"overlay.{kind}", _MEDIA[kind])


async def case_report(
    here: Context, form: forms.EnrolledReportForm, prints: PairRequest
) -> Response:
    """Return the page that `fpmatch verify --case-report` writes.

    Of an enrolled print it has the name and the SHA-256 of the file.
    """
    html = await here.run_pair(prints, pair.report_pair, prints, *form.examination())
    return _download(html.encode(), "case.html", "text/html; charset=utf-8")


def _answer_on_pairs(
    answer: Callable[[Context, Any, PairRequest], Awaitable[Response]],
    name: str,
    summary: str,
    uploaded: type[forms.PairForm],
    enrolled: type[forms.EnrolledPairForm],
    content: dict[str, Any],
) -> None:
    """Let a function answer to the form of two prints, and of a probe for an enrolled print."""

    async def of_two(here: Context, form: forms.EnrolledPairForm) -> Response:
        return await answer(here, form, await form.pair(here, None))

    async def of_entry(here: Context, form: forms.EnrolledPairForm, number: int) -> Response:
        return await answer(here, form, await form.pair(here, number))

    of_two.__annotations__ = {"here": Here, "form": Annotated[uploaded, FORM]}
    of_entry.__annotations__ = {"here": Here, "form": Annotated[enrolled, FORM], "number": int}
    content = content | {"name": name, "description": answer.__doc__}
    router.post(f"/{name}", summary=summary, **content)(of_two)
    at, of_enrolled = f"/gallery/{{number}}/{name}", f"{summary}, of an enrolled print"
    gallery_router.post(at, summary=of_enrolled, dependencies=_VERIFY, **content)(of_entry)


_PAIR: Final = forms.PairForm, forms.EnrolledPairForm
_DRAWN: Final = forms.OverlayForm, forms.EnrolledOverlayForm
_REPORT: Final = forms.ReportForm, forms.EnrolledReportForm
for _row in (
    (compare, "compare", "Decide, and show all", *_PAIR, _SHOWN),
    (views, "views", "Where the ridges agree", *_PAIR, _SHOWN),
    (
        overlay,
        "overlay",
        "Draw one print over the other",
        forms.OverlayForm,
        forms.EnrolledOverlayForm,
        _PICTURE,
    ),
    (case_report, "case-report", "Report to be printed", *_REPORT, _PAGE),
):
    _answer_on_pairs(*_row)


@router.post("/extract", summary="Return the template of a print", **_FILE)
async def extract(here: Here, form: Annotated[forms.ExtractForm, FORM]) -> Response:
    """Return the template as a file: JSON, which is complete, or another format."""
    upload = await form.read("image", here.limits)
    content, suffix = await here.run(pair.extract_template, upload, form.format)
    media = "application/json" if suffix == ".json" else "application/octet-stream"
    return _download(content, f"template{suffix}", media)


@router.post("/stages", summary="Show each stage of an extraction", **_SHOWN)
async def stages(here: Here, form: Annotated[forms.StagesForm, FORM]) -> Response:
    """Return the pictures that `fpmatch extract --format stages` writes."""
    upload = await form.read("image", here.limits)
    return _json(await here.run(encoded, pair.show_stages, upload))


@gallery_router.get("/gallery", summary="Counts and sizes of the gallery", dependencies=_READ)
async def gallery(here: Here) -> Document:
    """Return what `fpmatch gallery list --summary --json` prints."""
    return await here.run_on_gallery(gallery_work.describe_gallery, here.where)


@gallery_router.post(
    "/identify",
    summary="Rank the enrolled subjects by how well their best finger matches a probe",
    dependencies=_VERIFY,
)
async def identify(here: Here, form: Annotated[forms.IdentifyForm, FORM]) -> Document:
    """Return what `fpmatch identify --json` prints of one probe, and the transforms."""
    await here.searchable()
    upload = await form.read("probe", here.limits)
    options = form.known_matcher(), form.candidates, form.threshold
    arguments = (upload, here.where, *options)
    return await here.run_on_gallery(gallery_work.identify_print, *arguments)


@gallery_router.post("/enrol", summary="Enrol one print", status_code=201, dependencies=_ENROL)
async def enrol(here: Here, response: Response, form: Annotated[forms.EnrolForm, FORM]) -> Document:
    """Keep the template of a print, but no image; 201 if it is new, 200 if it is known.

    Without a subject, the name of the file must contain it.
    """
    upload = await form.read("image", here.limits)
    if not form.subject and (form.finger or form.impression):
        raise RequestError("subject: required with finger or impression")
    parts = form.subject.strip(), form.finger.strip(), form.impression.strip()
    label = Label(*parts) if form.subject else None
    arguments = (upload, here.where, label)
    document: Document = await here.run_on_gallery(gallery_work.enrol_print, *arguments)
    if not document["enrolled"]:
        response.status_code = 200
    return document


@gallery_router.get(
    "/gallery/prints",
    summary="The enrolled prints of a subject",
    dependencies=[_READ[0], _OF_SUBJECT],
)
async def list_prints(here: Here, subject: Subject) -> Document:
    """Return what `fpmatch gallery list --subject --json` prints."""
    rows = await here.run_on_gallery(gallery_work.list_prints, here.where, subject)
    return {"prints": rows}


@gallery_router.post(
    "/gallery/verify",
    summary="Decide whether a probe comes from a claimed subject",
    dependencies=_VERIFY,
)
async def verify_claim(here: Here, form: Annotated[forms.ClaimForm, FORM]) -> Document:
    """Return what `fpmatch verify --gallery --subject --json` prints."""
    upload = await form.read("probe", here.limits)
    claim = form.subject, form.finger or None, form.options()
    return await here.run_on_gallery(gallery_work.verify_claim, upload, here.where, *claim)


@gallery_router.delete(
    "/gallery/prints",
    summary="Remove all enrolled prints of a subject",
    dependencies=[_ADMIN[0], _OF_SUBJECT],
)
async def remove_subject(here: Here, subject: Subject) -> Document:
    """Remove the templates of all prints of a subject."""
    removed = await here.run_on_gallery(gallery_work.remove_subject, here.where, subject)
    return {"removed": len(removed)}


@gallery_router.delete(
    "/gallery/{number}", summary="Remove one enrolled print", dependencies=_ADMIN
)
async def remove_print(here: Here, number: int) -> Document:
    """Remove the template of entry `number`."""
    await here.run_on_gallery(gallery_work.remove_print, here.where, number)
    return {"removed": 1}
