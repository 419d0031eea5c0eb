"""Content of a file as data and text: an image, a template, or both."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, cast

import click
import numpy as np

from fpmatch.cli.command import load_object
from fpmatch.errors import FpmatchError, ImageError, without_path
from fpmatch.formats.files import load_record
from fpmatch.formats.registry import codec_of_name
from fpmatch.printable import count
from fpmatch.prints.reading import content_of
from fpmatch.templates import plausibility
from fpmatch.templates.minutiae import STANDARD_DPI, MinutiaKind

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from fpmatch.formats.record import View
    from fpmatch.image.io.read import GreyImage
    from fpmatch.templates.minutiae import Template

# Impression types of ISO/IEC 19794-2, ANSI/INCITS 378 and ANSI/NIST-ITL, from 0.
IMPRESSIONS: Final = (
    *("live plain", "live rolled", "nonlive plain", "nonlive rolled", "latent impression"),
    *("latent tracing", "latent photo", "latent lift", "swipe", "vertical roll"),
)
_FINGERS: Final = ("thumb", "index", "middle", "ring", "little")
FINGERS: Final = (
    "unknown finger",
    *(f"{hand} {finger}" for hand in ("right", "left") for finger in _FINGERS),
)


def inspect_file(
    path: Path, *, image_reader: Callable[[Path], GreyImage], dpi: float | None
) -> tuple[dict[str, Any], str]:
    """Return the content of a file, by its content, whatever its name: JSON values, and a line.

    An image is taken to be of `dpi` dots per inch (default: that in the file, else by its ridges).
    Raises TemplateError, ImageReadError or ImageError if it is no such file, or damaged.
    """
    content = content_of(path)
    prints, notes = list[dict[str, Any]](), list[str]()
    image, line = None, ""
    if content in {"template", "both"}:
        record = load_record(path)
        file_format, title = record.format, codec_of_name(record.format).title
        prints = list(map(_print, record.views))
        notes += dict.fromkeys(doubt for view in record.views for doubt in _doubts(view.template))
        notes = [*record.notes, *notes]
        if content == "both":
            try:
                image, line = _image(image_reader(path), dpi)
            except FpmatchError as error:
                notes.append(f"its image cannot be read: {without_path(str(error), path)}")
    else:
        read = image_reader(path)
        file_format, title = read.format, f"{read.format} image"
        image, line = _image(read, dpi)
    several = f"{len(prints)} prints: " if len(prints) > 1 else ""
    parts = [title, several + " | ".join(map(_print_text, prints))]
    parts.append(f"image of {line}" if prints and line else line)
    shown = [*notes, *(image["notes"] if image else ())]
    document = {
        "path": str(path),
        "format": file_format,
        "title": title,
        "image": image,
        "prints": prints,
        "notes": notes,
    }
    return document, "; ".join([f"{path}: {', '.join(filter(None, parts))}", *shown])


def _image(image: GreyImage, dpi: float | None) -> tuple[dict[str, Any], str]:
    """Return properties of an image, and the text about them.

    ``dpi`` is None if unknown, ``quality`` if it can be no print; ``likely_dpi`` is what the ridges
    indicate where ``dpi`` is unknown and 500 is not possible.
    """
    from fpmatch.image.extract import assess

    height, width = image.pixels.shape
    notes, known = list(image.notes), dpi or image.dpi
    quality = likely = None
    try:
        assessed = assess(image, dpi)
        notes += _doubts(assessed.template)
        quality = assessed.quality
        if not known and assessed.template.dpi != STANDARD_DPI:
            likely = assessed.template.dpi
            quality = quality.at_found_resolution()
    except ImageError as error:  # too small or too large for a print at its resolution
        notes.append(f"no print: {without_path(str(error), image.source)}")
    document = {
        "width": width,
        "height": height,
        "dpi": known,
        "notes": notes,
        "quality": None if quality is None else quality.as_dict(),
        "likely_dpi": likely,
    }
    text = f"{_size(width, height)}, {_dpi(known)}"
    text += "" if likely is None else f", by the ridges {likely:g} dpi"
    return document, text if quality is None else f"{text}, {quality}"


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
    finger, impression = f"position {view.finger}", f"impression type {view.impression}"
    return {
        "width": template.width,
        "height": template.height,
        "size_known": view.size_known,
        "dpi": template.dpi if template.dpi_known else None,
        "minutiae": len(minutiae),
        "endings": int(np.count_nonzero(minutiae.kind == MinutiaKind.ENDING)),
        "bifurcations": int(np.count_nonzero(minutiae.kind == MinutiaKind.BIFURCATION)),
        "finger": FINGERS[view.finger] if view.finger < len(FINGERS) else finger,
        "impression": [*IMPRESSIONS, impression][min(view.impression, len(IMPRESSIONS))],
        "quality": view.quality,
        "minutia_quality": round(float(np.mean(minutiae.quality)), 1) if graded else None,
        "ridge_field": template.field is not None,
        "extended": ["extended data"] if view.extended else [],
        "fields": dict(view.fields),
    }


def _print_text(p: dict[str, Any]) -> str:
    """Return the text about a print, of which what is usual or unknown is left out."""
    other = p["minutiae"] - p["endings"] - p["bifurcations"]
    kinds = [(p["endings"], "ending"), (p["bifurcations"], "bifurcation")]
    by_kind = [count(number, noun) for number, noun in kinds if number]
    by_kind += [f"{other} other"] if other and by_kind else []
    minutiae = count(p["minutiae"], "minutia", "minutiae") if p["minutiae"] else "no minutiae"
    parts = [
        _size(p["width"], p["height"]) if p["size_known"] else "size unknown",
        _dpi(p["dpi"]),
        "" if p["finger"] == FINGERS[0] else p["finger"],
        "" if p["impression"] == IMPRESSIONS[0] else p["impression"],
        f"{minutiae} ({', '.join(by_kind)})" if by_kind else minutiae,
        "" if p["quality"] is None else f"quality {p['quality']}",
        "" if p["minutia_quality"] is not None else "no quality of minutiae",
        "ridge field" if p["ridge_field"] else "",
        *p["extended"],
        *(f"{name} {value}" for name, value in p["fields"].items()),
    ]
    return ", ".join(filter(None, parts))


def _size(width: int, height: int) -> str:
    return f"{width} x {height} px"


def _dpi(dpi: float | None) -> str:
    return "resolution unknown" if dpi is None else f"{dpi:g} dpi"
