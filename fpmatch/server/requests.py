"""Parts of a request, as the routes declare them."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Collection
from functools import partial
from typing import Annotated, Any, Final, Literal, cast

from fastapi import Depends, File, Form, Request, Security, UploadFile, params
from fastapi.security import HTTPBearer

from fpmatch.drawing.overlay.draw import View
from fpmatch.errors import unknown_name
from fpmatch.gallery.store.audit_chain import act_as
from fpmatch.matching.registry import DEFAULT_MATCHER, matcher_names, split_name
from fpmatch.prints.pair import PairOptions
from fpmatch.server.errors import RequestError
from fpmatch.server.guard import CLIENT
from fpmatch.server.observer import route_of
from fpmatch.server.pair import EnrolledPrint, PairRequest
from fpmatch.server.prints import PrintOptions, Upload, shown_name
from fpmatch.server.settings import LOCAL, Client, Role, Settings

UploadedFile = Annotated[UploadFile, File(description="An image or a template, by its content")]
Dpi = Annotated[float | None, Form(description="Resolution in dpi; by default that in the file")]
Enhance = Annotated[Literal["learned", "filters"], Form(description="Enhancement of ridges")]

_PARAMETER: Final = "query parameter"
_FIELD: Final = "form field"
_FORM: Final = "multipart/form-data"
_FORM_WITHOUT_FILES: Final = "application/x-www-form-urlencoded"

# Declares the token in the description of the API; `fpmatch.server.guard.Guard` checks it.
_BEARER: Final = HTTPBearer(auto_error=False, description="Token of the server or of a client")


def needs(role: Role) -> params.Depends:
    """Return the dependency that refuses clients without a role."""

    async def check(request: Request, _: Annotated[Any, Security(_BEARER)]) -> None:
        own = cast("Client", request.scope[CLIENT]).role
        if own < role:
            given = f"the token has {own.name.lower()}"
            raise RequestError(f"this needs the role {role.name.lower()}, and {given}", status=403)

    return cast("params.Depends", Depends(check))


async def _check_names(request: Request) -> None:
    """Refuse another body than a form, and what the description of the API does not name once.

    FastAPI ignores unknown names, and all but the last value of a name.
    """
    api = request.app.openapi()
    operation = api["paths"][route_of(request.scope)][request.method.lower()]
    parameters = [one["name"] for one in operation.get("parameters", ()) if one["in"] == "query"]
    fields = _fields(api, operation)
    _check_media_type(request, fields)
    form = await request.form()
    taken = {_PARAMETER: parameters, _FIELD: list(fields)}
    try:
        names = [name for name, _ in request.query_params.multi_items()]
        _check_taken_once(_PARAMETER, names, taken)
        _check_taken_once(_FIELD, [name for name, _ in form.multi_items()], taken)
        for name, value in form.items():
            file = fields[name] == "file"
            if file == isinstance(value, str):
                needed = f"a file, as curl -F {name}=@FILE sends it" if file else "no file"
                raise RequestError(f"{name}: must be {needed}")
            if fields[name] == "number":
                _check_blanks(name, str(value))
        for name, value in request.path_params.items():
            _check_blanks(name, value)
    except RequestError:
        await form.close()
        raise


def _check_blanks(name: str, number: str) -> None:
    """Refuse blanks and line breaks around a number, which pydantic ignores."""
    if number != number.strip():
        raise RequestError(f"{name}: must be a number alone, not {number!r}")


def _fields(api: dict[str, Any], operation: dict[str, Any]) -> dict[str, str]:
    """Return the fields of the form that an operation takes: "file", "number" or "text"."""
    if "requestBody" not in operation:
        return {}
    place = operation["requestBody"]["content"][_FORM]["schema"]["$ref"]
    properties = api["components"]["schemas"][place.rpartition("/")[2]]["properties"]
    kinds = {}
    for name, schema in properties.items():
        types = {one.get("type") for one in (schema, *schema.get("anyOf", ()))}
        file = "contentMediaType" in schema or schema.get("format") == "binary"
        kinds[name] = "file" if file else "number" if types & {"number", "integer"} else "text"
    return kinds


def _check_media_type(request: Request, fields: Collection[str]) -> None:
    """Refuse a body of another type than that of a form; status 415."""
    headers = request.headers
    if headers.get("content-length", "0") == "0" and "transfer-encoding" not in headers:
        return
    media = headers.get("content-type", "").partition(";")[0].strip().lower()
    if media != _FORM and (fields or media != _FORM_WITHOUT_FILES):
        wanted = f"a form, {_FORM}, as curl -F sends it" if fields else "no body"
        was = f"not {media}" if media else "and the type of this body is not stated"
        raise RequestError(f"this address takes {wanted}, {was}", status=415)


def _check_taken_once(kind: str, names: list[str], taken: dict[str, list[str]]) -> None:
    """Refuse names of a kind that are unknown, belong to another kind, or are repeated."""
    for name in names:
        if name not in taken[kind]:
            others = [other for other in taken if name in taken[other]]
            if others:
                raise RequestError(f"{name}: must be a {others[0]}, not a {kind}")
            if not taken[kind]:
                raise RequestError(f"unknown {kind} {name!r}: this address takes none")
            raise RequestError(unknown_name(kind, name, taken[kind]))
        if names.count(name) > 1:
            raise RequestError(f"{name}: given {names.count(name)} times, must be given once")


KNOWN_NAMES: Final = cast("params.Depends", Depends(_check_names))


async def _settings(request: Request) -> Settings:
    return cast("Settings", request.app.state.settings)


async def _client(request: Request) -> Client:
    return cast("Client", request.scope.get(CLIENT, LOCAL))


async def _run(request: Request, client: Sender) -> Callable[..., Awaitable[Any]]:
    """Return the function that lets a worker process do some work, in the client's name."""
    return partial(request.app.state.pool.run, request, act_as, client.name)


ServerSettings = Annotated[Settings, Depends(_settings)]
Sender = Annotated[Client, Depends(_client)]
Run = Annotated[Callable[..., Awaitable[Any]], Depends(_run)]


async def read_upload(request: Request, file: UploadFile, role: str) -> Upload:
    """Return the bytes of an uploaded file; `role` is its name if it has none to show."""
    settings = await _settings(request)
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


async def _matcher(
    matcher: Annotated[
        str, Form(description="Name of a matcher that `/about` lists, perhaps with parameters")
    ] = DEFAULT_MATCHER,
) -> str:
    """Return the name of a matcher, never its place, package.module:OBJECT: nothing is imported.

    It may state parameters, as ``paper:rho=0.9``.
    """
    name = split_name(matcher)[0]
    if name not in matcher_names():
        raise RequestError(unknown_name("matcher", name, matcher_names()))
    return matcher


Matcher = Annotated[str, Depends(_matcher)]


async def _pair_options(
    matcher: Matcher,
    fmr: Annotated[float | None, Form(description="Decide at this false match rate")] = None,
    threshold: Annotated[float | None, Form(description="Decide at this score")] = None,
) -> PairOptions:
    return PairOptions(matcher, fmr, threshold)


OneReading = Annotated[PrintOptions, Depends(_print_options)]
_BothReadings = Annotated[tuple[PrintOptions, PrintOptions], Depends(_both_options)]
Options = Annotated[PairOptions, Depends(_pair_options)]


async def _uploaded_pair(
    request: Request,
    probe: UploadedFile,
    reference: UploadedFile,
    readings: _BothReadings,
    options: Options,
) -> PairRequest:
    first = await read_upload(request, probe, "probe")
    second = await read_upload(request, reference, "reference")
    return PairRequest(first, second, readings, options)


async def _enrolled_pair(
    request: Request,
    settings: ServerSettings,
    number: int,
    probe: UploadedFile,
    readings: _BothReadings,
    options: Options,
) -> PairRequest:
    enrolled = EnrolledPrint(str(settings.gallery), number)
    return PairRequest(await read_upload(request, probe, "probe"), enrolled, readings, options)


async def _drawing(
    file_format: Annotated[Literal["png", "svg"], Form(alias="format")] = "png",
    side_by_side: Annotated[bool, Form(description="Draw the prints beside each other")] = False,
    ridges: Annotated[bool, Form(description="Draw where the ridges agree")] = False,
) -> tuple[str, View]:
    return file_format, View(side_by_side, ridges)


Drawing = Annotated[tuple[str, View], Depends(_drawing)]
UploadedPair = Annotated[PairRequest, Depends(_uploaded_pair)]
EnrolledPair = Annotated[PairRequest, Depends(_enrolled_pair)]
