"""The page of one comparison, which needs no other file and no network."""

from __future__ import annotations

import hashlib
import math
import platform
import re
from dataclasses import dataclass
from datetime import UTC, datetime
from string import ascii_uppercase
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch._version import __version__
from fpmatch.base.html import page_templates
from fpmatch.drawing.overlay.draw import View, overlay_scene
from fpmatch.drawing.overlay.page import FRAME_PEN
from fpmatch.drawing.scene.ink import print_picture
from fpmatch.drawing.scene.items import Circle, Group, Path, Pen, Text, moved
from fpmatch.drawing.scene.palette import EXAMINER_MARK
from fpmatch.drawing.scene.raster import data_url, paint, png_bytes
from fpmatch.errors import FpmatchError
from fpmatch.matching.calibration import score_to_fmr
from fpmatch.printable import printable, printable_lines
from fpmatch.prints.reading import MIRRORED
from fpmatch.prints.report import (
    IDENTITY,
    SELF_COMPARED,
    as_rows,
    odds,
    outcome,
    score_as_high,
)
from fpmatch.templates.minutiae import MM_PER_INCH

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from fpmatch.drawing.scene.items import Box, Item, Matrix
    from fpmatch.prints.pair import ComparedPair, PairOptions
    from fpmatch.templates.minutiae import Minutiae

KINDS: Final = ("unknown", "ending", "bifurcation")
SIDES: Final = ("probe", "reference")

LONGEST_TEXT: Final = 200_000  # characters of notes
LONGEST_CASE_NUMBER: Final = 60  # characters; it is on one line of each page
_LONGEST_HEADER: Final = 110  # characters, of each page
_MOST_MARKS: Final = 500
_PEN: Final = Pen(EXAMINER_MARK, width=2.2, halo=1.4)
_RADIUS, _LETTER_SIZE = 11.0, 22.0  # page pixels
_FARTHEST_MARK: Final = 1e6  # pixels
_NOT_PLAIN: Final = re.compile("[^0-9A-Za-z]")


class CaseReportError(FpmatchError):
    """A case report cannot be made of what was given."""


@dataclass(frozen=True, slots=True)
class CaseFile:
    """The identity of the file of one print: its name, size in bytes where known, and SHA-256."""

    name: str
    size: int | None
    sha256: str

    @classmethod
    def of(cls, name: str, data: bytes) -> CaseFile:
        """Return what identifies a file of these bytes."""
        return cls(name, len(data), hashlib.sha256(data).hexdigest())


@dataclass(frozen=True, slots=True)
class CaseMark:
    """A mark that an examiner set: a place on one side, in pixels, and a note."""

    side: str
    x: float
    y: float
    note: str = ""

    def __post_init__(self) -> None:
        if self.side not in SIDES or not max(abs(self.x), abs(self.y)) <= _FARTHEST_MARK:
            raise CaseReportError(
                "a mark needs a side (probe or reference), and x and y within "
                f"{_FARTHEST_MARK:,.0f} pixels"
            )


def settings_of(
    options: PairOptions, pair: ComparedPair, enhance: str, polarity: str = "auto"
) -> dict[str, str]:
    """Return how two prints were read and compared, by name."""
    v = pair.verification
    if v.rho is not None:
        rule = f"more than {v.rho:.4g} of the minutiae of the smaller print must be paired"
    else:
        rule = f"score of {v.threshold:.1f}, a false match rate of {score_to_fmr(v.threshold):.3g}"
    file = options.calibration
    return {
        "Matcher": v.matcher,
        "Decision at": rule,
        "Calibration": "that of the package" if file is None else str(file),
        "Enhancement": enhance,
        "Polarity": polarity,
        **({"Mirrored": f"{SIDES[0]}: {MIRRORED}"} if MIRRORED in pair.probe.notes else {}),
    }


def check_words(case_number: str, *notes: str) -> None:
    """Raise CaseReportError where the words for a case report are beyond their limits."""
    if sum(map(len, notes)) > LONGEST_TEXT:
        raise CaseReportError(f"notes have at most {LONGEST_TEXT:,} characters")
    if len(case_number) > LONGEST_CASE_NUMBER:
        raise CaseReportError(f"a case number has at most {LONGEST_CASE_NUMBER} characters")


def case_report(
    pair: ComparedPair,
    files: tuple[CaseFile, CaseFile],
    *,
    settings: Mapping[str, str],
    case_number: str = "",
    notes: str = "",
    marks: Sequence[CaseMark] = (),
    made: datetime | None = None,
) -> str:
    """Return the report on a comparison as HTML, which prints to PDF on A4 or Letter paper.

    `settings` says how the prints were read and compared; the first of `marks` is A; `made` is now
    by default. Every kind of line break in `notes` begins a new line. Raises CaseReportError if
    notes, case number or marks are beyond their limits.
    """
    check_words(case_number, notes, *(mark.note for mark in marks))
    if len(marks) > _MOST_MARKS:
        raise CaseReportError(f"a case report shows at most {_MOST_MARKS} marks")
    v = pair.verification
    prints = (pair.probe, pair.reference)
    sides = [
        {
            "name": side,
            "file": file,
            "given": one,
            "picture": data_url(png_bytes(print_picture(one)), "png"),
        }
        for side, file, one in zip(SIDES, files, prints, strict=True)
    ]
    scored = not math.isnan(v.score)
    title = f"{files[0].name} and {files[1].name}"
    title = printable(f"Case {case_number.strip()}: {title}" if case_number.strip() else title)
    html = (
        page_templates("fpmatch.drawing")
        .get_template("case_report.html.j2")
        .render(
            title=title,
            running=_css_string(title[:_LONGEST_HEADER] + "…" * (len(title) > _LONGEST_HEADER)),
            made=(made or datetime.now(UTC)).strftime("%Y-%m-%d %H:%M UTC"),
            version=__version__,
            python=platform.python_version(),
            numpy=np.__version__,
            verdict=outcome(v),
            decision=v.decision,
            v=v,
            scored=scored,
            same="" if v.identical is None else f"{IDENTITY[v.identical]}: {SELF_COMPARED}",
            rarity=score_as_high(odds(v.fmr)) if scored else "",
            largest=odds(v.smallest_measured_fmr) if scored else "",
            rows=as_rows(v, pair.quality),
            settings=settings,
            sides=sides,
            overlay=_picture(pair, "superposed") if v.transform is not None else "",
            ridges=_picture(pair, "ridges") if v.ridge_map is not None else "",
            beside=_picture(pair, "side-by-side", marks),
            pairs=_pairs(pair),
            notes=_lines(notes),
            marks=[(mark_letter(k), mark, _lines(mark.note)) for k, mark in enumerate(marks)],
        )
    )
    return printable_lines(html.lstrip())


def mark_letter(index: int) -> str:
    """Return the letter of a mark by its place among the marks, as the web page writes it."""
    turn, place = divmod(index, len(ascii_uppercase))
    return ascii_uppercase[place] + (str(turn + 1) if turn else "")


def _lines(text: str) -> str:
    """Return text in which every kind of line break is a newline."""
    return "\n".join(text.splitlines()).rstrip().lstrip("\n")


def _css_string(text: str) -> str:
    """Return text as the inside of a string of CSS, all but letters and digits escaped."""
    return _NOT_PLAIN.sub(lambda match: f"\\{ord(match[0]):x} ", text)


def _picture(pair: ComparedPair, view: View, own: Sequence[CaseMark] = ()) -> str:
    """Return an overlay without caption and legend, with the marks of the examiner, as a URL."""
    both = print_picture(pair.probe), print_picture(pair.reference)
    scene = overlay_scene(*both, pair.verification, view)
    parts = {item.role: item.clip for item in scene.items if isinstance(item, Group)}
    top, bottom = parts["caption"].bottom, parts["legend"].y + 2 * FRAME_PEN.width
    drawn = examiner_marks(own, scene.placed) if own else []
    pixels = paint(scene._replace(items=(*scene.items, *drawn)))
    return data_url(png_bytes(pixels[math.ceil(top) : math.floor(bottom)]), "png")


def examiner_marks(own: Sequence[CaseMark], placed: Sequence[tuple[Matrix, Box]]) -> list[Item]:
    """Draw the marks of an examiner, each as a cross in a circle, with its letter.

    `placed` has, for each side, the matrix of its pixels, and its panel: marks outside it are left
    out.
    """
    drawn: list[Item] = []
    r = _RADIUS
    for k, mark in enumerate(own):
        matrix, panel = placed[SIDES.index(mark.side)]
        ((x, y),) = moved(matrix, [(mark.x, mark.y)])
        if not (panel.x <= x <= panel.right and panel.y <= y <= panel.bottom):
            continue
        drawn.append(Circle((x, y), r, _PEN))
        drawn.append(Path(((x - r, y), (x + r, y)), _PEN))
        drawn.append(Path(((x, y - r), (x, y + r)), _PEN))
        letter = Text(x + r + 2, y - r + 4, mark_letter(k), _LETTER_SIZE, EXAMINER_MARK)
        drawn.append(letter._replace(bold=0.8, halo=2.5))
    return drawn


def _pairs(pair: ComparedPair) -> list[tuple[str, str, float]]:
    """Return each pair with its distance under the transform, in mm on the reference."""
    v = pair.verification
    if v.transform is None or not len(v.pairs):
        return []
    ours, theirs = v.probe.minutiae, v.reference.minutiae
    probe = v.transform.apply(ours.xy[v.pairs[:, 0]])
    apart = np.hypot(*(probe - theirs.xy[v.pairs[:, 1]]).T) * MM_PER_INCH / v.reference.dpi
    return [
        (_in_words(ours, i), _in_words(theirs, j), float(distance))
        for (i, j), distance in zip(v.pairs.tolist(), apart, strict=True)
    ]


def _in_words(m: Minutiae, k: int) -> str:
    """Return kind, x, y, direction and quality of a minutia."""
    direction = round(math.degrees(float(m.angle[k]))) % 360
    return f"{KINDS[int(m.kind[k])]}, {m.x[k]:.0f}, {m.y[k]:.0f}, {direction}°, {m.quality[k]}"
