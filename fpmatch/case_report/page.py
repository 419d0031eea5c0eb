"""The page of one comparison, which needs no other file and no network."""

from __future__ import annotations

import hashlib
import math
import platform
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Final

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from fpmatch._version import __version__
from fpmatch.drawing.files import data_url, png_bytes
from fpmatch.drawing.overlay.draw import View, overlay_file
from fpmatch.drawing.overlay.warp import pair_warp
from fpmatch.drawing.words import odds, score_as_high, verdict
from fpmatch.errors import FpmatchError
from fpmatch.matching.calibration import score_to_fmr
from fpmatch.printable import printable_lines
from fpmatch.report import as_rows

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from fpmatch.matching.result import Verification
    from fpmatch.minutiae import Template
    from fpmatch.pair import ComparedPair, PairOptions
    from fpmatch.reading import GivenPrint

KINDS: Final = ("unknown", "ending", "bifurcation")
SIDES: Final = ("probe", "reference")
_MM_PER_INCH: Final = 25.4
_LONGEST_TEXT: Final = 20_000  # characters of notes


class CaseReportError(FpmatchError):
    """A case report cannot be made of what was given."""


@dataclass(frozen=True, slots=True)
class CaseFile:
    """Hold what identifies the file of one print: its name, size in bytes and SHA-256."""

    name: str
    size: int
    sha256: str

    @classmethod
    def of(cls, name: str, data: bytes) -> CaseFile:
        """Return what identifies a file of these bytes."""
        return cls(name, len(data), hashlib.sha256(data).hexdigest())


@dataclass(frozen=True, slots=True)
class CaseMark:
    """Hold a mark that an examiner set: a place on one side, in pixels, and a note."""

    side: str
    x: float
    y: float
    note: str = ""

    def __post_init__(self) -> None:
        if self.side not in SIDES or not (math.isfinite(self.x) and math.isfinite(self.y)):
            raise CaseReportError("a mark needs a side (probe or reference) and finite x and y")


@dataclass(frozen=True, slots=True)
class _Minutia:
    x: float
    y: float
    direction: int
    kind: str
    quality: int


@dataclass(frozen=True, slots=True)
class _Side:
    """Hold what the page shows of one print."""

    name: str
    file: CaseFile
    given: GivenPrint
    picture: str

    @property
    def template(self) -> Template:
        return self.given.template


def settings_of(
    options: PairOptions,
    verification: Verification,
    dpi: tuple[float | None, float | None],
    enhance: str,
    polarity: str = "auto",
) -> dict[str, str]:
    """Return how two prints were read and compared, by name; `dpi` are the given resolutions."""
    v = verification
    if v.rho is not None:
        rule = f"more than {v.rho:.4g} of the minutiae of the smaller print must be paired"
    else:
        rule = f"score of {v.threshold:.1f}, a false match rate of {score_to_fmr(v.threshold):.3g}"
    file = options.calibration
    given = [f"{value:g} dpi ({side})" for side, value in zip(SIDES, dpi, strict=True) if value]
    return {
        "Matcher": v.matcher,
        "Decision at": rule,
        "Calibration": "that of the package" if file is None else str(file),
        "Resolution": ", ".join(given) or "that of the files",
        "Enhancement": enhance,
        "Polarity": polarity,
    }


def case_report(
    pair: ComparedPair,
    files: tuple[CaseFile, CaseFile],
    *,
    settings: Mapping[str, str],
    title: str = "",
    notes: str = "",
    marks: Sequence[CaseMark] = (),
    made: datetime | None = None,
    warp: bool = False,
) -> str:
    """Return the report on a comparison as HTML, which prints to PDF on A4 paper.

    Parameters
    ----------
    pair : ComparedPair
        The comparison.
    files : tuple of CaseFile
        The files of probe and reference.
    settings : mapping of str to str
        How the prints were read and compared, by name.
    title : str
        Name of the case.
    notes : str
        What the examiner noted.
    marks : sequence of CaseMark
        What the examiner marked.
    made : datetime, optional
        Time of the report (default: now).
    warp : bool
        Show the overlay warped through the pairs, too.

    Raises
    ------
    CaseReportError
        If the notes are longer than 20,000 characters.
    """
    if len(notes) + sum(len(mark.note) for mark in marks) > _LONGEST_TEXT:
        raise CaseReportError(f"notes have at most {_LONGEST_TEXT:,} characters")
    v = pair.verification
    images = pair.probe.pixels, pair.reference.pixels
    sides = [
        _Side(name, file, given, data_url(png_bytes(given.pixels), "png"))
        for name, file, given in zip(SIDES, files, (pair.probe, pair.reference), strict=True)
    ]
    environment = Environment(
        loader=PackageLoader("fpmatch.case_report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    scored = not math.isnan(v.score)
    bent, drawn = pair_warp(v) if warp and v.transform is not None else (None, "")
    html = environment.get_template("page.html.j2").render(
        title=title or f"{files[0].name} and {files[1].name}",
        made=(made or datetime.now(UTC)).strftime("%Y-%m-%d %H:%M UTC"),
        version=__version__,
        python=platform.python_version(),
        numpy=np.__version__,
        verdict=verdict(v.match),
        match=v.match,
        v=v,
        scored=scored,
        rarity=score_as_high(odds(v.fmr)) if scored else "",
        largest=odds(v.smallest_measured_fmr) if scored else "",
        rows=as_rows(v, pair.scale, pair.quality, identical=pair.identical),
        settings=settings,
        sides=sides,
        overlay=_picture(pair, images, View()) if v.transform is not None else "",
        warped=_picture(pair, images, View(warp=True)) if bent else "",
        drawn=drawn,
        ridges=_picture(pair, images, View(ridges=True)) if v.ridge_map is not None else "",
        beside=_picture(pair, images, View(side_by_side=True)),
        pairs=_pairs(pair),
        notes=notes.strip(),
        marks=marks,
    )
    return printable_lines(html.lstrip())


def _picture(pair: ComparedPair, images: tuple[object, object], view: View) -> str:
    content = overlay_file(".png", *images, pair.verification, view)
    return data_url(content, "png")


def _pairs(pair: ComparedPair) -> list[tuple[_Minutia, _Minutia, float]]:
    """Return each pair with its distance under the transform, in mm on the reference."""
    v = pair.verification
    if v.transform is None or not len(v.pairs):
        return []
    ours, theirs = v.probe.minutiae, v.reference.minutiae
    moved = v.transform.apply(ours.xy[v.pairs[:, 0]])
    apart = np.hypot(*(moved - theirs.xy[v.pairs[:, 1]]).T) * _MM_PER_INCH / v.reference.dpi
    return [
        (_minutia(v.probe, i), _minutia(v.reference, j), float(distance))
        for (i, j), distance in zip(v.pairs.tolist(), apart, strict=True)
    ]


def _minutia(template: Template, index: int) -> _Minutia:
    m = template.minutiae
    direction = round(math.degrees(float(m.angle[index]))) % 360
    kind = KINDS[int(m.kind[index])]
    return _Minutia(float(m.x[index]), float(m.y[index]), direction, kind, int(m.quality[index]))
