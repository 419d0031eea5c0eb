"""Content of a file as text and data: an image, a template, or both."""

from __future__ import annotations

import struct
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

import click
import numpy as np

from fpmatch.cli.command import load_object
from fpmatch.errors import FpmatchError, ImageError, without_path
from fpmatch.formats.files import load_record
from fpmatch.formats.registry import codec_of_name
from fpmatch.image.io.read import read_image
from fpmatch.printable import count
from fpmatch.prints.reading import content_of
from fpmatch.templates import plausibility
from fpmatch.templates.minutiae import STANDARD_DPI, MinutiaKind

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterator

    from fpmatch.formats.record import View
    from fpmatch.image.io.read import GreyImage
    from fpmatch.image.quality.print_quality import PrintQuality
    from fpmatch.templates.minutiae import Template

# Impression types of ISO/IEC 19794-2, ANSI/INCITS 378 and ANSI/NIST-ITL.
IMPRESSIONS: Final = {
    0: "live plain",
    1: "live rolled",
    2: "nonlive plain",
    3: "nonlive rolled",
    4: "latent impression",
    5: "latent tracing",
    6: "latent photo",
    7: "latent lift",
    8: "swipe",
    9: "vertical roll",
}
_FINGERS: Final = ("thumb", "index", "middle", "ring", "little")
FINGERS: Final = (
    "unknown finger",
    *(f"{hand} {finger}" for hand in ("right", "left") for finger in _FINGERS),
)
EXTENDED_HEADER: Final = 4  # bytes of type and length before a block of extended data
EXTENDED_KINDS: Final = {1: "ridge counts", 2: "cores and deltas", 3: "zonal quality"}


@dataclass(frozen=True, slots=True)
class InspectedImage:
    """Properties of an image; `dpi` is None if unknown, `quality` if it can be no print.

    `likely_dpi` is what the ridges indicate where `dpi` is unknown and 500 is not possible.
    """

    width: int
    height: int
    dpi: float | None
    notes: tuple[str, ...] = ()
    quality: PrintQuality | None = None
    likely_dpi: float | None = None


@dataclass(frozen=True, slots=True)
class Inspection:
    """The content of a file: its format, short and in full, its image and its prints.

    `notes` are anomalies, and data that were skipped.
    """

    path: str
    format: str
    title: str
    image: InspectedImage | None = None
    prints: tuple[dict[str, Any], ...] = ()
    notes: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return all of it, ready for JSON."""
        return asdict(self)

    def as_text(self) -> str:
        """Return all of it on one line."""
        parts = [self.title, *_prints_as_text(self.prints)]
        if self.image is not None:
            prefix = "image of " if self.prints else ""
            size = _size(self.image.width, self.image.height)
            parts += [prefix + size, _dpi(self.image.dpi)]
            if self.image.likely_dpi is not None:
                parts[-1] += f", by the ridges {self.image.likely_dpi:g} dpi"
            if self.image.quality is not None:
                parts.append(str(self.image.quality))
        notes = (*self.notes, *(self.image.notes if self.image else ()))
        return "; ".join([f"{self.path}: {', '.join(parts)}", *notes])


def inspect_file(
    path: str | os.PathLike[str],
    *,
    image_reader: Callable[[Path], GreyImage] = read_image,
    dpi: float | None = None,
) -> Inspection:
    """Find out what a file, an image or a template, contains, by its content, whatever its name.

    An image is taken to be of `dpi` dots per inch (default: that in the file, else by its ridges).

    Raises TemplateError, ImageReadError or ImageError if it is no such file, or damaged.
    """
    content = content_of(path)
    if content not in {"template", "both"}:
        image = image_reader(Path(path))
        return Inspection(str(path), image.format, f"{image.format} image", _image(image, dpi))
    record = load_record(path)
    doubts = dict.fromkeys(each for view in record.views for each in _doubts(view.template))
    picture, notes = None, (*record.notes, *doubts)
    if content == "both":
        try:
            picture = _image(image_reader(Path(path)), dpi)
        except FpmatchError as error:
            notes += (f"its image cannot be read: {without_path(str(error), path)}",)
    return Inspection(
        str(path),
        record.format,
        codec_of_name(record.format).title,
        picture,
        tuple(map(_print, record.views)),
        notes,
    )


def _image(image: GreyImage, dpi: float | None) -> InspectedImage:
    from fpmatch.image.extract import assess

    height, width = image.pixels.shape
    notes, known, likely = image.notes, dpi or image.dpi, None
    try:
        assessed = assess(image, dpi)
        quality = assessed.quality
        notes += _doubts(assessed.template)
        likely = None if known or assessed.template.dpi == STANDARD_DPI else assessed.template.dpi
        quality = quality if likely is None else quality.at_found_resolution()
    except ImageError as error:  # too small or too large for a print at its resolution
        quality = None
        notes += (f"no print: {without_path(str(error), image.source)}",)
    return InspectedImage(width, height, known, notes, quality, likely)


def _doubts(template: Template) -> tuple[str, ...]:
    """Return doubts about a template; that it is two prints in one, the wing of galleries finds."""
    try:
        find = load_object("fpmatch.gallery.listing.two_prints:find_doubts", used_by="inspect")
    except click.UsageError:  # the wing is missing
        return plausibility.find_doubts(template)
    return cast("tuple[str, ...]", find(template))


def _print(view: View) -> dict[str, Any]:
    """Return properties of one print of a template file, None where they are unknown.

    Width and height are those of the box around the minutiae unless ``size_known``. Qualities are 0
    to 100, that of the minutiae a mean.
    """
    template, minutiae = view.template, view.template.minutiae
    graded = view.quality_known and len(minutiae) > 0
    known_finger = view.finger < len(FINGERS)
    return {
        "width": template.width,
        "height": template.height,
        "size_known": view.size_known,
        "dpi": template.dpi if view.dpi_known else None,
        "minutiae": len(minutiae),
        "endings": int(np.count_nonzero(minutiae.kind == MinutiaKind.ENDING)),
        "bifurcations": int(np.count_nonzero(minutiae.kind == MinutiaKind.BIFURCATION)),
        "finger": FINGERS[view.finger] if known_finger else f"position {view.finger}",
        "impression": IMPRESSIONS.get(view.impression, f"impression type {view.impression}"),
        "quality": view.quality,
        "minutia_quality": round(float(np.mean(minutiae.quality)), 1) if graded else None,
        "ridge_field": template.field is not None,
        "extended": tuple(extended_kinds(view.extended)),
        "fields": dict(view.fields),
    }


def extended_kinds(data: bytes) -> list[str]:
    """Return descriptions of the blocks of extended data.

    The formats of 2005 leave open whether a block's length includes its own header; the
    interpretation under which the blocks fill the area is taken.
    """
    for uncounted in (0, EXTENDED_HEADER):
        kinds, at, size = list[str](), 0, EXTENDED_HEADER
        while size >= EXTENDED_HEADER and at + EXTENDED_HEADER <= len(data):
            code, length = struct.unpack_from(">2H", data, at)
            kinds.append(EXTENDED_KINDS.get(code, f"maker's own 0x{code:04x}"))
            size = length + uncounted
            at += size
        if size >= EXTENDED_HEADER and at == len(data):
            return kinds
    return ["blocks that do not fill their area"]


def _prints_as_text(prints: tuple[dict[str, Any], ...]) -> list[str]:
    """Return what all prints have in common, then what differs, separated by bars."""
    rows = list(zip(*map(_print_parts, prints), strict=True))
    shared = [row[0] for row in rows if len(set(row)) == 1 and row[0]]
    if len(prints) < 2:
        return shared
    own = [row for row in rows if len(set(row)) > 1]
    each = [", ".join(filter(None, parts)) for parts in zip(*own, strict=True)]
    return [*shared, f"{len(prints)} prints" + (f": {' | '.join(each)}" if own else "")]


def _print_parts(p: dict[str, Any]) -> Iterator[str]:
    """Yield the parts of the text about a print, always as many, "" for nothing."""
    yield _size(p["width"], p["height"]) if p["size_known"] else "size unknown"
    yield _dpi(p["dpi"])
    yield "" if p["finger"] == FINGERS[0] else p["finger"]
    yield "" if p["impression"] == IMPRESSIONS[0] else p["impression"]
    yield _minutiae(p["minutiae"], p["endings"], p["bifurcations"])
    yield "" if p["quality"] is None else f"quality {p['quality']}"
    yield "" if p["minutia_quality"] is not None else "no quality of minutiae"
    yield "ridge field" if p["ridge_field"] else ""
    yield " and ".join(p["extended"])
    yield ", ".join(f"{name} {value}" for name, value in p["fields"].items())


def _minutiae(number: int, endings: int, bifurcations: int) -> str:
    """Return the number of minutiae, and of each kind where any is known."""
    other = number - endings - bifurcations
    kinds = [_some(endings, "ending"), _some(bifurcations, "bifurcation")]
    kinds += [f"{other} other"] if other else []
    by_kind = f" ({', '.join(filter(None, kinds))})" if other < number else ""
    return (count(number, "minutia", "minutiae") if number else "no minutiae") + by_kind


def _some(number: int, noun: str) -> str:
    return count(number, noun) if number else ""


def _size(width: int, height: int) -> str:
    return f"{width} x {height} px"


def _dpi(dpi: float | None) -> str:
    return "resolution unknown" if dpi is None else f"{dpi:g} dpi"
