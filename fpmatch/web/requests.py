"""Parts of a request, as the routes declare them."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from functools import partial
from typing import Annotated, Any, Literal, cast

from fastapi import Depends, File, Form, Request, UploadFile

from fpmatch.matching.matchers import DEFAULT_MATCHER
from fpmatch.pair import PairOptions
from fpmatch.web.errors import RequestError
from fpmatch.web.pair import EnrolledPrint, PairRequest
from fpmatch.web.prints import PrintOptions, Upload, shown_name
from fpmatch.web.settings import Settings

UploadedFile = Annotated[UploadFile, File(description="An image or a template, by its content")]
Dpi = Annotated[float | None, Form(description="Resolution in dpi; by default that in the file")]
Matcher = Annotated[str, Form(description="Name of the matcher")]
Enhance = Annotated[Literal["learned", "filters"], Form(description="Enhancement of ridges")]


async def _settings(request: Request) -> Settings:
    return cast("Settings", request.app.state.settings)


async def _run(request: Request) -> Callable[..., Awaitable[Any]]:
    return partial(request.app.state.pool.run, request)


ServerSettings = Annotated[Settings, Depends(_settings)]
Run = Annotated[Callable[..., Awaitable[Any]], Depends(_run)]


async def read_upload(file: UploadFile, role: str, settings: Settings) -> Upload:
    """Return the bytes of an uploaded file; `role` is its name if it has none to show."""
    name, most = shown_name(file.filename, role), settings.limits.file_megabytes
    if (file.size or 0) > most * 1e6:
        raise RequestError(f"larger than {most:g} MB", path=name, status=413)
    return Upload(name, await file.read())


async def _print_options(
    settings: ServerSettings, dpi: Dpi = None, enhance: Enhance = "learned"
) -> PrintOptions:
    return PrintOptions(settings.limits, dpi, enhance)


async def _both_options(
    settings: ServerSettings,
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


OneReading = Annotated[PrintOptions, Depends(_print_options)]
_BothReadings = Annotated[tuple[PrintOptions, PrintOptions], Depends(_both_options)]
_Options = Annotated[PairOptions, Depends(_pair_options)]


async def _uploaded_pair(
    settings: ServerSettings,
    probe: UploadedFile,
    reference: UploadedFile,
    readings: _BothReadings,
    options: _Options,
) -> PairRequest:
    first = await read_upload(probe, "probe", settings)
    second = await read_upload(reference, "reference", settings)
    return PairRequest(first, second, readings, options)


async def _enrolled_pair(
    settings: ServerSettings,
    number: int,
    probe: UploadedFile,
    readings: _BothReadings,
    options: _Options,
) -> PairRequest:
    enrolled = EnrolledPrint(str(settings.gallery), number)
    return PairRequest(await read_upload(probe, "probe", settings), enrolled, readings, options)


async def _drawing(
    file_format: Annotated[Literal["png", "svg"], Form(alias="format")] = "png",
    side_by_side: Annotated[bool, Form(description="Draw the prints beside each other")] = False,
) -> tuple[str, bool]:
    return file_format, side_by_side


Drawing = Annotated[tuple[str, bool], Depends(_drawing)]
UploadedPair = Annotated[PairRequest, Depends(_uploaded_pair)]
EnrolledPair = Annotated[PairRequest, Depends(_enrolled_pair)]
