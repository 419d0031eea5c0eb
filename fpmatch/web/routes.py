"""Routes that compare and draw prints, and show their extraction."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Form, Request, Response

from fpmatch.web import models, pair, single
from fpmatch.web.access import Role
from fpmatch.web.requests import (
    ERRORS,
    FILE,
    MEDIA,
    PICTURE,
    BothReadings,
    BothUploads,
    OneReading,
    Options,
    PictureFormat,
    SideBySide,
    UploadedFile,
    Workers,
    audit,
    download,
    needs,
    read_upload,
)

router = APIRouter(tags=["Prints"], responses=ERRORS, dependencies=[needs(Role.VERIFY)])


@router.post("/verify", summary="Decide whether two prints are of the same finger")
async def verify(
    request: Request, pool: Workers, prints: BothUploads, readings: BothReadings, options: Options
) -> models.Verified:
    """Return what `fpmatch verify --json` prints."""
    wanted = pair.PairRequest(*prints, readings, options)
    document = await pool.run(request, pair.verify_pair, wanted)
    audit(request, match=document["match"], score=document["score"])
    return models.Verified(**document)


@router.post("/compare", summary="Decide, and return all that the web interface shows")
async def compare(
    request: Request, pool: Workers, prints: BothUploads, readings: BothReadings, options: Options
) -> models.Shown:
    """Return the decision, both prints with their minutiae and pictures, and the pairs."""
    wanted = pair.PairRequest(*prints, readings, options)
    document = await pool.run(request, pair.show_pair, wanted)
    audit(request, match=document["result"]["match"], score=document["result"]["score"])
    return models.Shown(**document)


@router.post(
    "/overlay",
    summary="Draw one print, moved, over the other",
    response_class=Response,
    responses=PICTURE,
)
async def overlay(
    request: Request,
    pool: Workers,
    prints: BothUploads,
    readings: BothReadings,
    options: Options,
    file_format: PictureFormat = "png",
    side_by_side: SideBySide = False,
) -> Response:
    """Return the picture that `fpmatch overlay` writes."""
    wanted = pair.PairRequest(*prints, readings, options)
    content = await pool.run(request, pair.draw_pair, wanted, file_format, side_by_side)
    return download(content, f"overlay.{file_format}", MEDIA[file_format])


@router.post(
    "/extract",
    summary="Return the template of a print",
    response_class=Response,
    responses=FILE,
)
async def extract(
    request: Request,
    pool: Workers,
    image: UploadedFile,
    reading: OneReading,
    file_format: Annotated[
        str, Form(alias="format", description="A format of `fpmatch convert`")
    ] = "json",
) -> Response:
    """Return the template as a file: JSON, which is complete, or another format."""
    upload = await read_upload(request, image, "image")
    content, suffix = await pool.run(request, single.extract_template, upload, reading, file_format)
    media = "application/json" if suffix == ".json" else "application/octet-stream"
    return download(content, f"template{suffix}", media)


@router.post("/stages", summary="Show each stage of an extraction")
async def stages(
    request: Request,
    pool: Workers,
    image: UploadedFile,
    reading: OneReading,
) -> models.Stages:
    """Return the pictures that `fpmatch stages` writes."""
    upload = await read_upload(request, image, "image")
    return models.Stages(**await pool.run(request, single.show_stages, upload, reading))
