"""Forms and queries of requests, as pydantic reads them, and what every route needs."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import partial
from typing import Annotated, Any, Final, Literal, cast

from fastapi import Depends, Form, Request, Security, UploadFile, params
from fastapi.security import HTTPBearer
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    FiniteFloat,
    TypeAdapter,
    ValidationError,
)

from fpmatch.drawing.case_report import LONGEST_CASE_NUMBER, LONGEST_TEXT
from fpmatch.drawing.overlay.draw import View, view_of
from fpmatch.errors import unknown_name
from fpmatch.gallery.store.audit import act_as
from fpmatch.matching.registry import DEFAULT_MATCHER, matcher_names, split_name
from fpmatch.printable import printable
from fpmatch.prints.pair import PairOptions
from fpmatch.server.access import CLIENT
from fpmatch.server.errors import RequestError
from fpmatch.server.pair import EnrolledPrint, PairRequest
from fpmatch.server.pool import Pool, Result
from fpmatch.server.prints import Upload, shown_name
from fpmatch.server.settings import LOCAL, Client, Limits, Role, Settings, fault_in
from fpmatch.server.watch import Check

MULTIPART: Final = "multipart/form-data"
# Declares the token in the description of the API; `fpmatch.server.access.Access` checks it.
_BEARER: Final = HTTPBearer(auto_error=False, description="Token of the server or of a client")


def needs(role: Role) -> params.Depends:
    """Return the dependency that refuses clients without a role."""

    async def check(request: Request, _: Annotated[Any, Security(_BEARER)]) -> None:
        own = cast("Client", request.scope[CLIENT]).role
        if own < role:
            given = f"the token has {own.name.lower()}"
            raise RequestError(f"this needs the role {role.name.lower()}, and {given}", status=403)

    return cast("params.Depends", Depends(check))


def takes(*names: str) -> params.Depends:
    """Return the dependency that refuses other parameters of the query, and repeated names.

    A form must be one that files can be in.
    """

    async def check(request: Request) -> None:
        given = [name for name, _ in request.query_params.multi_items()]
        for name in given:
            if name not in names:
                raise RequestError(
                    unknown_name("query parameter", name, names)
                    if names
                    else f"unknown query parameter {name!r}: this address takes none"
                )
        if request.method == "POST":
            media = request.headers.get("content-type", "").partition(";")[0].strip().lower()
            if media != MULTIPART:
                was = f"not {media}" if media else "and the type of this body is not stated"
                wanted = f"this address takes a form, {MULTIPART}, as curl -F sends it"
                raise RequestError(f"{wanted}, {was}", status=415)
            given += [name for name, _ in (await request.form()).multi_items()]
        elif request.headers.get("content-length", "0") != "0":
            raise RequestError("this address takes no body", status=415)
        for name in given:
            if given.count(name) > 1:
                raise RequestError(f"{name}: given {given.count(name)} times, must be given once")

    return cast("params.Depends", Depends(check))


class Context:
    """The settings and the client of a request, and the processes that do its work."""

    def __init__(self, request: Request) -> None:
        self._request, state = request, request.app.state
        self.settings: Settings = state.settings
        self.limits: Limits = state.settings.limits
        self.client: Client = request.scope.get(CLIENT, LOCAL)
        self.where = str(state.settings.gallery)
        self._pool: Pool = state.pool
        self._gallery: Check = state.gallery
        self._indexed: asyncio.Event = state.indexed

    async def run(self, work: Callable[..., Result], *args: Any) -> Result:
        """Return ``work(*args)``, done in a worker process."""
        return await self._pool.run(self._request, work, *args)

    async def run_on_gallery(self, work: Callable[..., Result], *args: Any) -> Result:
        """Return ``work(*args)``, done in the client's name; refused if the gallery is silent."""
        fault = await self._gallery.fault()
        if fault is not None and fault.code == "late":
            raise RequestError("the gallery does not answer: try again shortly", status=503)
        in_name = partial(act_as, self.client.name, work)
        return await self._pool.run(self._request, in_name, *args, gallery=True)

    async def run_pair(self, pair: PairRequest, work: Callable[..., Result], *args: Any) -> Result:
        """Return ``work(*args)``, which compares two prints."""
        enrolled = isinstance(pair.reference, EnrolledPrint)
        return await (self.run_on_gallery if enrolled else self.run)(work, *args)

    async def searchable(self) -> None:
        """Wait for the index of the gallery; refused where it is made for long."""
        try:
            await asyncio.wait_for(self._indexed.wait(), self.limits.wait_seconds)
        except TimeoutError:
            why = "the index of the gallery is being made: try again later"
            raise RequestError(why, status=503) from None


Here = Annotated[Context, Depends(Context)]


def _one_line(text: str) -> str:
    """Return the value of a field; ValueError for one with control characters."""
    if printable(text) != text:
        raise ValueError("a control character, or text that is not UTF-8")
    return text


LabelPart = Annotated[str, Field(max_length=200), AfterValidator(_one_line)]
Dpi = Annotated[float | None, Field(description="Resolution in dpi; by default that in the file")]
_File = Annotated[UploadFile, Field(description="An image or a template, by its content")]
FORM: Final = Form(media_type=MULTIPART)


class _Form(BaseModel):
    """A form; an unknown field is refused."""

    model_config = ConfigDict(extra="forbid")

    dpi: Dpi = None

    async def read(self, field: str, limits: Limits, dpi: float | None = None) -> Upload:
        """Return an uploaded file, named as its field if it has no name to show."""
        file: UploadFile = getattr(self, field)
        name, most = shown_name(file.filename, field), limits.file_megabytes
        if (file.size or 0) > most * 1e6:
            raise RequestError(f"larger than {most:g} MB", path=name, status=413)
        enhance = getattr(self, "enhance", "learned")
        return Upload(name, await file.read(), limits, self.dpi if dpi is None else dpi, enhance)


class _Probe(_Form):
    probe: _File


class _Image(_Form):
    image: _File


class _Matching(_Form):
    matcher: str = Field(
        DEFAULT_MATCHER,
        description="Name of a matcher that `/about` lists, perhaps with parameters",
    )

    def known_matcher(self) -> str:
        """Return the name of a matcher, never its place, package.module:OBJECT.

        Nothing is imported. It may state parameters, as ``paper:rho=0.9``.
        """
        name = split_name(self.matcher)[0]
        if name not in matcher_names():
            raise RequestError(unknown_name("matcher", name, matcher_names()))
        return self.matcher


class _Enhanced(_Form):
    enhance: Literal["learned", "filters"] = Field("learned", description="Enhancement of ridges")


class _Deciding(_Enhanced, _Matching):
    fmr: float | None = Field(None, description="Decide at this false match rate")
    threshold: float | None = Field(None, description="Decide at this score")

    def options(self) -> PairOptions:
        """Return how two prints are compared."""
        return PairOptions(self.known_matcher(), self.fmr, self.threshold)


class EnrolledPairForm(_Deciding, _Probe):
    """A probe, to be compared with another print."""

    probe_dpi: Dpi = None
    reference_dpi: Dpi = None

    async def pair(self, here: Context, number: int | None) -> PairRequest:
        """Return the comparison of the probe with entry `number`; None: with the `reference`."""
        probe = await self.read("probe", here.limits, self.probe_dpi)
        reference: Upload | EnrolledPrint
        if number is None:
            reference = await self.read("reference", here.limits, self.reference_dpi)
        else:
            reference = EnrolledPrint(here.where, number)
        return PairRequest(probe, reference, self.options(), self.enhance)


class PairForm(EnrolledPairForm):
    """Two prints, to be compared."""

    reference: _File


class EnrolledOverlayForm(EnrolledPairForm):
    """A probe, to be drawn over another print."""

    format: Literal["png", "svg"] = "png"
    side_by_side: bool = Field(False, description="Draw the prints beside each other")
    ridges: bool = Field(False, description="Draw where the ridges agree")

    def view(self) -> View:
        """Return what is drawn."""
        return view_of(side_by_side=self.side_by_side, ridges=self.ridges)


class OverlayForm(EnrolledOverlayForm, PairForm):
    """Two prints, to be drawn over one another."""


class Mark(BaseModel):
    """A mark of an examiner, in pixels of one of the prints."""

    model_config = ConfigDict(extra="forbid")

    side: Literal["probe", "reference"]
    x: FiniteFloat
    y: FiniteFloat
    note: str = ""


class EnrolledReportForm(EnrolledPairForm):
    """A probe, another print, and what an examiner noted and marked."""

    notes: str = Field("", max_length=LONGEST_TEXT)
    marks: str = Field("[]", max_length=LONGEST_TEXT, description="JSON: list of side, x, y, note")
    case_number: str = Field(
        "", max_length=LONGEST_CASE_NUMBER, description="On every page of the report"
    )

    def examination(self) -> tuple[str, list[dict[str, Any]], str]:
        """Return notes, marks and case number; RequestError where the marks cannot be read."""
        try:
            placed = TypeAdapter(list[Mark]).validate_json(self.marks)
        except ValidationError as error:
            raise RequestError(f"marks: {fault_in(error, Mark)}") from None
        return self.notes, [mark.model_dump() for mark in placed], self.case_number


class ReportForm(EnrolledReportForm, PairForm):
    """Two prints, and what an examiner noted and marked."""


class StagesForm(_Enhanced, _Image):
    """An image whose stages of extraction are shown."""


class ExtractForm(StagesForm):
    """A print whose template is wanted."""

    format: str = Field("json", description="A format of `fpmatch convert`")


class IdentifyForm(_Matching, _Probe):
    """A probe to search for."""

    candidates: int = Field(10, ge=1, description="Largest number of candidates")
    threshold: float = Field(0.0, description="Smallest score of a candidate")


class EnrolForm(_Image):
    """A print to enrol."""

    subject: LabelPart = ""
    finger: LabelPart = ""
    impression: LabelPart = ""


class ClaimForm(_Deciding, _Probe):
    """A probe, and whose it is said to be."""

    subject: LabelPart
    finger: LabelPart = ""
