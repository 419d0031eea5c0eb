"""One or two prints of a request: their comparison, template and stages, as they are shown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.drawing.case_report import CaseFile, CaseMark, case_report, settings_of
from fpmatch.drawing.overlay.draw import View, overlay_scene, scene_bytes
from fpmatch.drawing.overlay.views import agreement
from fpmatch.drawing.scene.ink import ink_of, print_picture, shrunk
from fpmatch.drawing.scene.items import zoomed
from fpmatch.drawing.scene.palette import PROBE_INK, REFERENCE_INK, hexadecimal
from fpmatch.drawing.scene.raster import data_url, png_bytes, reduced, webp_bytes
from fpmatch.drawing.stages import stage_picture, value_range
from fpmatch.errors import ImageError
from fpmatch.formats.record import TemplateRecord
from fpmatch.formats.record import View as RecordView
from fpmatch.formats.registry import codec_of_name
from fpmatch.matching.constants import IMPOSTOR_RIDGES
from fpmatch.prints.pair import compare_pair
from fpmatch.prints.reading import GivenPrint
from fpmatch.prints.report import as_rows, odds
from fpmatch.server.errors import RequestError
from fpmatch.server.gallery import open_served_gallery, short_name
from fpmatch.server.prints import Upload, open_upload

if TYPE_CHECKING:
    from fpmatch.drawing.scene.items import Ink
    from fpmatch.drawing.scene.palette import Colour
    from fpmatch.prints.pair import ComparedPair, PairOptions
    from fpmatch.templates.minutiae import Template


LARGEST_SIDE_SHOWN: Final = 1600  # pixels of a print
INKED: Final = 96  # smallest coverage that counts as ink


@dataclass(frozen=True, slots=True)
class EnrolledPrint:
    """Identify the enrolled print that a probe is to be compared with."""

    gallery: str
    number: int


@dataclass(frozen=True, slots=True)
class PairRequest:
    """Two prints, how they are to be compared, and how images are enhanced."""

    probe: Upload
    reference: Upload | EnrolledPrint
    options: PairOptions
    enhance: str

    def compare(self) -> ComparedPair:
        """Return the two prints and the decision."""
        return self.compare_files()[0]

    def compare_files(self) -> tuple[ComparedPair, CaseFile]:
        """Return the two prints and the decision, and the file that the reference came from."""
        probe = open_upload(self.probe)
        if isinstance(self.reference, Upload):
            reference = open_upload(self.reference)
            file = CaseFile.of(self.reference.name, self.reference.data)
        else:
            reference, file = _open_enrolled(self.reference, self.probe.data)
        return compare_pair(probe, reference, self.options), file


def verify_pair(request: PairRequest) -> dict[str, Any]:
    """Return the object that ``fpmatch verify --json`` prints."""
    return request.compare().as_dict()


def draw_pair(request: PairRequest, file_format: str, view: View) -> bytes:
    """Return the overlay of two prints as the content of a "png" or "svg" file."""
    pair = request.compare()
    pixels = print_picture(pair.probe), print_picture(pair.reference)
    return scene_bytes(f".{file_format}", overlay_scene(*pixels, pair.verification, view))


def report_pair(
    request: PairRequest,
    notes: str,
    marks: list[dict[str, Any]],
    case_number: str = "",
) -> str:
    """Return the case report of two prints, with what an examiner noted and marked."""
    pair, reference = request.compare_files()
    return case_report(
        pair,
        (CaseFile.of(request.probe.name, request.probe.data), reference),
        settings=settings_of(request.options, pair, request.enhance),
        case_number=case_number,
        notes=notes,
        marks=[CaseMark(**mark) for mark in marks],
    )


def show_pair(request: PairRequest) -> dict[str, Any]:
    """Return all that the web interface shows of a verification."""
    pair = request.compare()
    v = pair.verification
    rows = as_rows(v, pair.quality)
    return {
        "result": pair.as_dict(),
        "odds": odds(v.fmr),
        "rows": [{"label": label, "words": text} for label, text in rows],
        "smallest_measured_fmr": v.smallest_measured_fmr,
        "pairs": v.pairs.reshape(-1, 2).tolist(),
        "probe": _shown_print(pair.probe, PROBE_INK),
        "reference": _shown_print(pair.reference, REFERENCE_INK),
    }


def _shown_print(given: GivenPrint, colour: Colour) -> dict[str, Any]:
    """Return one print for the web interface; a minutia is x, y, angle, kind, quality."""
    template, pixels = given.template, print_picture(given)
    m = template.minutiae
    factor = min(1.0, LARGEST_SIDE_SHOWN / max(pixels.shape))
    matrix = zoomed(factor, (-0.5, -0.5), (-0.5, -0.5))
    ink = next(iter(ink_of(pixels, template, matrix, colour, "")), None)
    return {
        "name": given.name,
        "kind": "template" if given.image is None else "image",
        "width": template.width,
        "height": template.height,
        "dpi": template.dpi,
        "notes": list(given.notes),
        "extent": _extent(template, ink, factor),
        "minutiae": [
            [round(float(x), 2), round(float(y), 2), round(float(angle), 4), int(kind), int(q)]
            for x, y, angle, kind, q in zip(m.x, m.y, m.angle, m.kind, m.quality, strict=True)
        ],
        "picture": data_url(webp_bytes(shrunk(pixels, factor), 85), "webp"),
        "ink": _encoded_ink(ink, colour),
    }


def _encoded_ink(ink: Ink | None, colour: Colour) -> str | None:
    """Return an ink as a picture; None where there is none, as of a template without ridges."""
    if ink is None or not ink.coverage.any():
        return None
    coloured = np.full((*ink.coverage.shape, 3), colour, np.uint8)
    return data_url(png_bytes(np.dstack([coloured, ink.coverage])), "png")


def _extent(template: Template, ink: Ink | None, factor: float) -> list[int]:
    """Return left, top, right and bottom of the ridges, or minutiae, in pixels of the print."""
    inked = np.zeros((1, 1), bool) if ink is None else ink.coverage > INKED
    columns, rows = np.flatnonzero(inked.any(axis=0)), np.flatnonzero(inked.any(axis=1))
    if not columns.size and not len(template.minutiae):
        return [0, 0, template.width, template.height]
    if not columns.size:
        xy = template.minutiae.xy
        return [round(float(end)) for end in (*xy.min(axis=0), *xy.max(axis=0))]
    ends = (columns[0], rows[0], columns[-1] + 1, rows[-1] + 1)
    return [round(float(end) / factor) for end in ends]


def _open_enrolled(enrolled: EnrolledPrint, probe: bytes) -> tuple[GivenPrint, CaseFile]:
    with open_served_gallery(enrolled.gallery) as gallery:
        entry = gallery.entry(enrolled.number)
        gallery.record("compare", probe=probe, entries=[enrolled.number])
        given = GivenPrint(str(entry.label), gallery.template(enrolled.number))
    return given, CaseFile(short_name(entry.source), None, entry.content.hex())


_COLOURS: Final = 11  # of the scale of agreement


def show_views(request: PairRequest) -> dict[str, Any]:
    """Return what the web interface shows on request: the map of ridge agreement, if there is."""
    verification = request.compare().verification
    ridges, compared = verification.ridge_map, verification.compared
    if ridges is None or compared is None:
        return {"ridges": None}
    rows = np.column_stack([ridges.xy.round(2), ridges.correlation.round(4)]).tolist()
    shown = {
        "mean": ridges.mean,
        "cell_px": ridges.cell_px,
        "rotation_deg": ridges.rotation_deg,
        "area_mm2": compared.ridge_area_mm2,
        "impostor_mean": IMPOSTOR_RIDGES,
        "cells": [(*row, hexadecimal(agreement(row[2]))) for row in rows],
        "colours": [hexadecimal(agreement(value)) for value in np.linspace(0, 1, _COLOURS)],
    }
    return {"ridges": shown}


LARGEST_STAGE_SHOWN: Final = 1200
STAGE_TEXTS: Final = {
    "input": "The image at 500 dpi.",
    "normalised": "Brightness and contrast equalized, ridges dark.",
    "coherence": "How consistent the ridge orientation is; bright is consistent.",
    "mask": "The area of the print; the tinted part is excluded.",
    "orientation": "The ridge orientation.",
    "period": "The distance between ridges.",
    "enhanced": "The enhanced ridges.",
    "binary": "Ridges and valleys.",
    "skeleton": "The ridges thinned to one pixel, over the image.",
    "minutiae": "Ridge endings (circles) and bifurcations (squares).",
}
"""Explanations of the stages, by name; a stage without one is shown too."""


def extract_template(upload: Upload, file_format: str) -> tuple[bytes, str]:
    """Return the template of a print as the content of a file, and its suffix."""
    codec = codec_of_name(file_format)
    if codec.encode is None:
        raise RequestError(f"{codec.title} is only read, not written")
    template = open_upload(upload).template
    return codec.encode(TemplateRecord("", (RecordView(template),))).data, codec.suffixes[0]


def show_stages(upload: Upload) -> dict[str, Any]:
    """Return the stages of an extraction as pictures; by name, range and words."""
    given = open_upload(upload)
    if given.assessed is None:
        raise ImageError("a template has no stages of extraction", path=given.name)
    stages = given.assessed.stages()
    largest = dict.fromkeys(("width", "height"), LARGEST_STAGE_SHOWN)
    return {
        "name": given.name,
        "stages": [
            {
                "name": name,
                "words": STAGE_TEXTS.get(name, ""),
                "range": value_range(name, array),
                "picture": data_url(webp_bytes(reduced(picture, **largest), 88), "webp"),
            }
            for name, array in stages.items()
            for picture in [stage_picture(name, array, stages["input"])]
        ],
    }
