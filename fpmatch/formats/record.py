"""`TemplateRecord`: the content of a template file, with a `View` for each print."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

from fpmatch.errors import TemplateError
from fpmatch.printable import count
from fpmatch.templates.minutiae import STANDARD_DPI, Minutiae, Template

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from fpmatch.formats.angles import AngleConvention


MAX_BYTES: Final = 16 * 2**20  # of a file: a hundred times that of a full palm print
MAX_MINUTIAE: Final = 10_000  # of one print
MAX_VIEWS: Final = 256  # prints in one file


def check_minutiae(count: int) -> None:
    """Raise TemplateError if a print may not have `count` minutiae."""
    if count > MAX_MINUTIAE:
        raise TemplateError(f"more than {MAX_MINUTIAE} minutiae in one print")


def check_views(count: int) -> None:
    """Raise TemplateError unless a file may have `count` prints."""
    if not 1 <= count <= MAX_VIEWS:
        raise TemplateError(f"holds more than {MAX_VIEWS} prints" if count else "holds no print")


@dataclass(frozen=True, slots=True)
class ReadingOptions:
    """Values for what a file leaves out.

    Parameters
    ----------
    dpi : float or None
        Resolution where the file has none; None for 500.
    size : tuple of int or None
        Width and height in pixels where the file has none; None for the span of the minutiae.
    angles : AngleConvention or None
        How angles are measured where the file does not define it.
    """

    dpi: float | None = None
    size: tuple[int, int] | None = None
    angles: AngleConvention | None = None

    @property
    def assumed_dpi(self) -> float:
        """`dpi`, or 500 for None."""
        return STANDARD_DPI if self.dpi is None else self.dpi


@dataclass(frozen=True, slots=True)
class ExtendedData:
    """Blocks of extended data with their headers, kept only in files of the format `layout`."""

    layout: str
    data: bytes


@dataclass(frozen=True, slots=True)
class View:
    """One print of a template file.

    Parameters
    ----------
    template : Template
        Its minutiae and frame.
    finger : int
        Code of the finger: 0 unknown, 1 to 5 right thumb to little finger, 6 to 10 left.
    number : int
        Number of the view among those of the finger, from 0.
    impression : int
        Code of the impression type: 0 live plain, 1 live rolled, and so on.
    quality : int or None
        Quality of the whole print, 0 to 100; None if unknown.
    size_known, quality_known : bool
        Whether the file contains the size, and the qualities of minutiae. If not, `template` has
        the values of the `ReadingOptions`, and quality 100.
    extended : ExtendedData or None
        Ridge counts, cores, deltas and vendor data, kept but not interpreted.
    fields : tuple of (str, str)
        Name and text of further information in the file.
    """

    template: Template
    finger: int = 0
    number: int = 0
    impression: int = 0
    quality: int | None = None
    size_known: bool = True
    quality_known: bool = True
    extended: ExtendedData | None = None
    fields: tuple[tuple[str, str], ...] = ()

    @property
    def dpi_known(self) -> bool:
        """Whether the file contains the resolution; `template` has that of the options if not."""
        return self.template.dpi_known

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
        template = Template(Minutiae(*columns), *size, options.assumed_dpi, dpi_known=False)
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
