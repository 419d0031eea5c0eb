"""`TemplateRecord`, the content of a template file, and `Codec`, which reads and writes it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import TemplateError
from fpmatch.printable import count
from fpmatch.templates.minutiae import STANDARD_DPI, Minutiae, Template

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

MAX_BYTES: Final = 16 * 2**20  # of a file: a hundred times that of a full palm print
MAX_MINUTIAE: Final = 10_000  # of one print
MAX_VIEWS: Final = 256  # prints in one file
UNKNOWN: Final = (
    "the file does not define how its angles are measured: --angles of verify, extract and convert "
    "does, as deg or rad, with ,clockwise where they increase clockwise on screen"
)


@dataclass(frozen=True, slots=True)
class AngleConvention:
    """Unit, sense and direction of minutia angles.

    Angles increase `clockwise` on screen, as ``atan2(dy, dx)`` does with y down, or
    counter-clockwise. Directions are as in ISO/IEC 19794-2 or `opposite`, as in NIST's XYT.
    """

    unit: str
    clockwise: bool = False
    opposite: bool = False

    @classmethod
    def parse(cls, text: str) -> AngleConvention:
        """Return the convention that ``deg`` or ``rad``, ``,clockwise`` and ``,opposite`` mean."""
        unit, *words = (word.strip().lower() for word in text.split(","))
        known = {"clockwise", "opposite"}
        if unit not in {"deg", "rad"} or not set(words) <= known or len(set(words)) < len(words):
            raise TemplateError(
                f"{text!r} is no convention of angles: deg or rad, then ,clockwise or ,opposite "
                "or both"
            )
        return cls(unit, "clockwise" in words, "opposite" in words)

    def to_radians(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return angles in radians in fpmatch's own convention, not wrapped into one turn."""
        angles = np.radians(values) if self.unit == "deg" else values
        return (-angles if self.clockwise else angles) + (math.pi if self.opposite else 0.0)


OWN_DEGREES: Final = AngleConvention("deg")


@dataclass(frozen=True, slots=True)
class ReadingOptions:
    """Values for what a file leaves out.

    Parameters
    ----------
    dpi : float
        Resolution where the file has none.
    size : tuple of int or None
        Width and height in pixels where the file has none; None for the span of the minutiae.
    angles : AngleConvention or None
        How angles are measured where the file does not define it.
    """

    dpi: float = STANDARD_DPI
    size: tuple[int, int] | None = None
    angles: AngleConvention | None = None


@dataclass(frozen=True, slots=True)
class View:
    """One print of a template file.

    Parameters
    ----------
    template : Template
        Its minutiae and frame.
    finger : int
        Code of the finger: 0 unknown, 1 to 5 right thumb to little finger, 6 to 10 left.
    impression : int
        Code of the impression type: 0 live plain, 1 live rolled, and so on.
    quality : int or None
        Quality of the whole print, 0 to 100; None if unknown.
    size_known, quality_known : bool
        Whether the file contains the size, and the qualities of minutiae. If not, `template` has
        the values of the `ReadingOptions`, and quality 100.
    extended : bytes
        Blocks of ridge counts, cores, deltas and vendor data with their headers, not interpreted;
        only files of the same format keep them.
    fields : tuple of (str, str)
        Name and text of further information in the file.
    """

    template: Template
    finger: int = 0
    impression: int = 0
    quality: int | None = None
    size_known: bool = True
    quality_known: bool = True
    extended: bytes = b""
    fields: tuple[tuple[str, str], ...] = ()

    @classmethod
    def without_frame(
        cls,
        minutiae: tuple[ArrayLike, ...],
        size: tuple[int, int],
        options: ReadingOptions,
        *,
        quality_known: bool,
    ) -> View:
        """Return a print of a format that keeps neither size nor resolution.

        Its minutiae are the columns of `Minutiae`; raises MinutiaeError for invalid values.
        """
        columns: Any = minutiae
        template = Template(Minutiae(*columns), *size, options.dpi, dpi_known=False)
        return cls(template, size_known=False, quality_known=quality_known)

    def at(self, dpi: float | None) -> View:
        """Return this print at another resolution (None: at its own)."""
        if dpi is None:
            return self
        return replace(self, template=replace(self.template, dpi=dpi, dpi_known=True))


@dataclass(frozen=True, slots=True)
class TemplateRecord:
    """The content of a template file.

    Parameters
    ----------
    format : str
        Name of its format.
    views : tuple of View
        Its prints, one at least.
    notes : tuple of str
        Irregularities in the file and ignored parts, a short text each.
    """

    format: str
    views: tuple[View, ...]
    notes: tuple[str, ...] = ()

    def of_view(self, number: int, path: object) -> TemplateRecord:
        """Return a record of the view of a number, from 1; a TemplateError names the file."""
        if number > len(self.views):
            raise TemplateError(f"{path}: holds {count(len(self.views), 'print')}, not {number}")
        return replace(self, views=(self.views[number - 1],))

    def single(self) -> View:
        """Return the only view; raises TemplateError if there are more."""
        if len(self.views) != 1:
            raise TemplateError(
                f"the format holds one print a file, and there are {len(self.views)}; choose one"
            )
        return self.views[0]


@dataclass(frozen=True, slots=True)
class Encoded:
    """The bytes of a template file, and a note on each part that they cannot hold."""

    data: bytes
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Codec:
    """Read and write one template file format.

    Parameters
    ----------
    name : str
        Name of the format, as the command line takes it.
    title : str
        Full name, for messages and tables.
    suffixes : tuple of str
        File suffixes, with the dot, in lower case; files are written with the first.
    recognises : callable
        Whether a file's bytes, or its first few thousand, are of this format.
    decode : callable
        Converts bytes to a TemplateRecord under `ReadingOptions`; raises an `FpmatchError` that
        names the reason (and the line, in text formats) but not the file.
    encode : callable or None
        Converts a TemplateRecord to bytes, always the same for the same record. None for formats
        that are only read.
    """

    name: str
    title: str
    suffixes: tuple[str, ...]
    recognises: Callable[[bytes], bool]
    decode: Callable[[bytes, ReadingOptions], TemplateRecord]
    encode: Callable[[TemplateRecord], Encoded] | None = None


def check_minutiae(count: int) -> None:
    """Raise TemplateError if a print may not have `count` minutiae."""
    if count > MAX_MINUTIAE:
        raise TemplateError(f"more than {MAX_MINUTIAE} minutiae in one print")


def check_views(count: int) -> None:
    """Raise TemplateError unless a file may have `count` prints."""
    if not 1 <= count <= MAX_VIEWS:
        raise TemplateError(f"holds more than {MAX_VIEWS} prints" if count else "holds no print")


def range_notes(values: NDArray[np.float64], convention: AngleConvention) -> list[str]:
    """Return a note where angles lie in a range that is not that of their unit."""
    largest = float(np.abs(values).max(initial=0.0))
    if convention.unit == "deg" and len(values) >= 4 and largest <= 2 * math.pi:
        return ["all its angles are within 2π degrees; --angles rad reads them as radians"]
    if convention.unit == "rad" and largest > 4 * math.pi:
        return ["its angles exceed 4π radians; --angles deg reads them as degrees"]
    return []


def dropped_notes(record: TemplateRecord, *, field: bool = False) -> list[str]:
    """Return notes on dropped extended data and, if `field`, a dropped ridge field."""
    view = record.single()
    notes = ["the ridge field dropped"] if field and view.template.field is not None else []
    return notes + [f"extended data of {record.format} dropped"] * bool(view.extended)


def fit_minutiae(template: Template, most: int, notes: list[str]) -> Minutiae:
    """Return the minutiae of a template that a format can hold, in their order.

    Minutiae outside the image are dropped; then, if more than `most` are left, the minutiae of
    lowest quality, of equal ones the later. Each reason adds a line to `notes`.
    """
    minutiae = template.minutiae
    sides = np.array([template.width, template.height])
    inside = ((minutiae.xy >= -0.5) & (minutiae.xy <= sides)).all(axis=1)
    if not inside.all():
        outside = count(int(np.count_nonzero(~inside)), "minutia", "minutiae")
        notes.append(f"{outside} outside the print dropped")
        minutiae = minutiae.take(inside)
    if len(minutiae) > most:
        dropped = count(len(minutiae) - most, "minutia", "minutiae")
        notes.append(f"{dropped} of lowest quality dropped: {most} fit in")
    return minutiae.best(most)


def span(x: NDArray[Any], y: NDArray[Any]) -> tuple[int, int]:
    """Return width and height of the smallest image from 0 that contains positions."""
    width, height = (int(np.clip(values.max(initial=0), 0, 2**31)) + 1 for values in (x, y))
    return width, height


def whole_steps(angle: NDArray[np.float32], steps: int) -> NDArray[np.int64]:
    """Return angles in radians, rounded to `steps` equal steps of a turn."""
    turns = angle.astype(np.float64) / (2 * np.pi)
    return np.mod(np.rint(turns * steps), steps).astype(np.int64)
