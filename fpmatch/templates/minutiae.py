"""`Minutiae` and `Template`: the types that the whole package exchanges.

Conventions, the same everywhere:

- coordinates are pixels of the input image, origin top-left, x to the right, y down;
- angles are radians in [0, 2π), counter-clockwise on screen from +x, that is ``atan2(-dy, dx)``;
  the direction is that of ISO/IEC 19794-2: for an ending, from the minutia back along its ridge;
  for a bifurcation, along the valley that its two close branches enclose;
- kinds are the ISO codes 0 other, 1 ending, 2 bifurcation; quality runs from 0 to 100;
- resolutions are in dots per inch; distances are compared at 500 dpi.
"""

from __future__ import annotations

import importlib
import importlib.util
import math
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.errors import MinutiaeError, ResolutionError
from fpmatch.templates.ridge_field import RidgeField, set_read_only

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import ArrayLike, NDArray

STANDARD_DPI: Final = 500.0
MM_PER_INCH: Final = 25.4
CM_PER_INCH: Final = MM_PER_INCH / 10
MIN_DPI: Final = 100.0
MAX_DPI: Final = 4000.0
LARGEST: Final = float(np.finfo(np.float32).max)
"""Largest position or angle, which are kept as float32."""
WIDEST_PX: Final = 2.0**31  # frame of a mirrored template, whose field may be of any size
MOST_DRAWN: Final = 300
"""Minutiae in the drawing of a notebook."""
MOST_SHOWN: Final = 10
"""Minutiae in the table of a notebook."""


class MinutiaKind(IntEnum):
    """Kind of a minutia, by its ISO/IEC 19794-2 code."""

    OTHER = 0
    ENDING = 1
    BIFURCATION = 2


class Minutia(NamedTuple):
    """One minutia: position in pixels, direction in radians, kind, and quality, 0 to 100."""

    x: float
    y: float
    angle: float
    kind: MinutiaKind
    quality: int


_KINDS: Final = {
    MinutiaKind.ENDING: "ending",
    MinutiaKind.BIFURCATION: "bifurcation",
    MinutiaKind.OTHER: "other",
}
_FILLS: Final = {
    MinutiaKind.ENDING: "#003e96",
    MinutiaKind.BIFURCATION: "#be3e00",
    MinutiaKind.OTHER: "none",
}


def dpi_of_per_cm(pixels: float) -> float:
    """Return the dpi of a resolution in whole pixels per centimetre.

    Rounding leaves a range of 2.54 dpi: the result is the multiple of 100 in it, else the nearest
    whole number.
    """
    exact = pixels * CM_PER_INCH
    hundreds = round(exact, -2)
    return float(round(hundreds if abs(hundreds - exact) <= CM_PER_INCH / 2 else exact))


def check_dpi(dpi: float) -> float:
    """Return a resolution as a float; raise ResolutionError unless it is from 100 to 4000 dpi."""
    try:
        value = float(dpi)
    except OverflowError:
        value = math.inf
    if not MIN_DPI <= value <= MAX_DPI:
        raise ResolutionError(
            f"resolution of {value:g} dpi is outside the usable range "
            f"of {MIN_DPI:g} to {MAX_DPI:g} dpi"
        )
    return value


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Minutiae:
    """N minutiae as a struct of arrays.

    Parameters
    ----------
    x, y : array_like of float, shape (N,)
        Positions in pixels of the input image; kept as float32.
    angle : array_like of float, shape (N,)
        Directions in radians; wrapped into [0, 2π), kept as float32.
    kind : array_like of int, shape (N,), optional
        ISO codes 0 other, 1 ending, 2 bifurcation (default: all other); kept as uint8.
    quality : array_like of float, shape (N,), optional
        0 (worst) to 100 (best) (default: all 100); kept as uint8.

    Raises
    ------
    MinutiaeError
        If lengths differ, a value is not finite, or a kind or quality leaves its range.

    Examples
    --------
    >>> from fpmatch import Minutiae
    >>> m = Minutiae(x=[10, 20], y=[5, 8], angle=[0.0, 7.0])
    >>> len(m), m.angle.round(3).tolist()
    (2, [0.0, 0.7170000076293945])
    """

    x: NDArray[np.float32]
    y: NDArray[np.float32]
    angle: NDArray[np.float32]
    kind: NDArray[np.uint8] = None  # type: ignore[assignment]
    quality: NDArray[np.uint8] = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        x = _real_column("x", self.x)
        n = x.size
        y = _real_column("y", self.y, n)
        angle = np.mod(_real_column("angle", self.angle, n), 2 * np.pi)
        kind = np.zeros(n) if self.kind is None else _real_column("kind", self.kind, n)
        quality = (
            np.full(n, 100.0) if self.quality is None else _real_column("quality", self.quality, n)
        )
        if n and (kind.min() < 0 or kind.max() > max(MinutiaKind)):
            raise MinutiaeError("minutia kind must be 0 (other), 1 (ending) or 2 (bifurcation)")
        if n and (quality.min() < 0 or quality.max() > 100):
            raise MinutiaeError("minutia quality must lie in 0..100")
        angle32 = angle.astype(np.float32)
        angle32[angle32 >= np.float32(2 * np.pi)] = 0.0
        set_read_only(
            self,
            x=x.astype(np.float32),
            y=y.astype(np.float32),
            angle=angle32,
            kind=kind.astype(np.uint8),
            quality=np.rint(quality).astype(np.uint8),
        )

    @classmethod
    def empty(cls) -> Minutiae:
        """Return a set of no minutiae."""
        return cls(np.empty(0), np.empty(0), np.empty(0))  # type: ignore[arg-type]

    @property
    def xy(self) -> NDArray[np.float32]:
        """Positions as one array of shape (N, 2), float32, pixels."""
        return np.column_stack([self.x, self.y])

    def __len__(self) -> int:
        return int(self.x.size)

    def __getitem__(self, index: Any) -> Any:
        """Return one minutia as a `Minutia`; of a slice, mask or list of indices, `Minutiae`."""
        if not isinstance(index, int | np.integer):
            return self.take(np.arange(len(self))[index])
        kind = MinutiaKind(int(self.kind[index]))
        x, y, angle = (float(column[index]) for column in (self.x, self.y, self.angle))
        return Minutia(x, y, angle, kind, int(self.quality[index]))

    def __iter__(self) -> Iterator[Minutia]:
        return (self[k] for k in range(len(self)))

    def __repr__(self) -> str:
        kinds = np.bincount(self.kind, minlength=len(MinutiaKind)).tolist()
        named = [(kinds[kind], name) for kind, name in _KINDS.items() if kinds[kind]]
        counts = ", ".join(f"{count} {name}{'s' * (count != 1)}" for count, name in named)
        return f"Minutiae({len(self)}{f': {counts}' if counts else ''})"

    def _repr_html_(self) -> str:
        """Return a table of the first minutiae, for notebooks."""
        from fpmatch.base.html import html_table  # noqa: PLC0415  (for notebooks only)

        rows = [
            (k, f"{x:.1f}", f"{y:.1f}", f"{math.degrees(angle):.1f}°", _KINDS[kind], quality)
            for k, (x, y, angle, kind, quality) in enumerate(self[:MOST_SHOWN])
        ]
        table = html_table([("", "x", "y", "angle", "kind", "quality"), *rows], head=True)
        return f"<div>{self!r}</div>{table}" + "…" * (len(self) > MOST_SHOWN)

    def to_dataframe(self, library: str | None = None) -> Any:
        """Return a data frame with the columns x, y, angle, kind and quality, a row a minutia.

        Parameters
        ----------
        library : str, optional
            "pandas" or "polars" (default: pandas where it is installed, else polars).

        Raises
        ------
        ImportError
            If the library is not installed.
        """
        columns = {name: getattr(self, name) for name in ("x", "y", "angle", "kind", "quality")}
        if library is None:
            library = "pandas" if importlib.util.find_spec("pandas") else "polars"
        return importlib.import_module(library).DataFrame(columns)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Minutiae):
            return NotImplemented
        return all(
            np.array_equal(getattr(self, c), getattr(other, c))
            for c in ("x", "y", "angle", "kind", "quality")
        )

    __hash__ = None  # type: ignore[assignment]

    def take(self, index: ArrayLike) -> Minutiae:
        """Return the minutiae that `index` (integers or a boolean mask, shape (N,)) selects."""
        i = np.asarray(index)
        return Minutiae(self.x[i], self.y[i], self.angle[i], self.kind[i], self.quality[i])


@dataclass(frozen=True, slots=True, repr=False)
class Template:
    """The features of one impression that are kept: its minutiae and the frame they lie in.

    Parameters
    ----------
    minutiae : Minutiae
        The minutiae, in pixels of the input image.
    width, height : int
        Size of the input image in pixels.
    dpi : float
        Resolution of the input image in dots per inch (default 500).
    field : RidgeField or None
        Coarse ridge orientation field where it is known; matchers use it when both sides have it.
    dpi_known : bool
        Whether a file or the caller states the resolution; else it is an estimate, or assumed. It
        does not count where templates are compared for equality.

    Raises
    ------
    MinutiaeError
        If width or height is not positive, or positions at 500 dpi overflow float32.
    ResolutionError
        If `dpi` is outside 100 to 4000.
    """

    minutiae: Minutiae
    width: int
    height: int
    dpi: float = STANDARD_DPI
    dpi_known: bool = field(default=True, repr=False, compare=False, kw_only=True)
    field: RidgeField | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        if self.width < 1 or self.height < 1:
            raise MinutiaeError(f"template size must be positive, not {self.width} x {self.height}")
        object.__setattr__(self, "dpi", check_dpi(self.dpi))
        if self.dpi < STANDARD_DPI:  # else no position grows
            most = LARGEST * self.dpi / STANDARD_DPI
            farthest = np.abs(self.minutiae.xy).max(initial=0.0)
            if not farthest <= most:
                raise MinutiaeError(
                    f"minutiae: a position of {farthest:g} px is too large at {self.dpi:g} dpi"
                )

    __hash__ = None  # type: ignore[assignment]

    def mirrored(self) -> Template:
        """Return the template of the mirror image, left and right exchanged.

        With a ridge field, the frame becomes as wide as the cells of the field.

        Examples
        --------
        >>> from fpmatch import Minutiae, Template
        >>> one = Template(Minutiae(x=[10], y=[40], angle=[0.5]), width=101, height=90)
        >>> one.mirrored().minutiae[0].x, one.mirrored().mirrored() == one
        (90.0, True)
        """
        m, field = self.minutiae, self.field
        width, mirrored = float(self.width), None
        if field is not None:
            width, mirrored = min(field.mask.shape[1] * field.step, WIDEST_PX), field.mirrored()
        minutiae = Minutiae(width - 1 - m.x, m.y, np.pi - m.angle, m.kind, m.quality)
        return replace(self, minutiae=minutiae, width=max(1, math.ceil(width)), field=mirrored)

    def __len__(self) -> int:
        """Return the number of minutiae."""
        return len(self.minutiae)

    def __iter__(self) -> Iterator[Minutia]:
        return iter(self.minutiae)

    def __getitem__(self, index: Any) -> Any:
        """Return one minutia, or `Minutiae`, as `Minutiae` does."""
        return self.minutiae[index]

    def __repr__(self) -> str:
        ridges = "" if self.field is None else ", ridges" * (self.field.ridges is not None)
        size = f"{self.width} x {self.height} px, {self.dpi:g} dpi"
        count = len(self)
        return f"Template({size}, {count} minutia{'e' * (count != 1)}{ridges})"

    def _repr_html_(self) -> str:
        """Return a drawing of the minutiae, the best where there are many, for notebooks."""
        drawn = np.argsort(-self.minutiae.quality.astype(int), kind="stable")[:MOST_DRAWN]
        marks = "".join(
            f'<g transform="translate({m.x:.1f} {m.y:.1f}) rotate({-math.degrees(m.angle):.0f})">'
            f'<path d="M0 0H9"/><circle r="3" fill="{_FILLS[m.kind]}"/></g>'
            for m in self.minutiae.take(drawn)
        )
        frame = f'viewBox="0 0 {self.width} {self.height}" width="240" stroke="#003e96"'
        style = "background:#fff;border:1px solid #ccc"
        return f'<svg {frame} style="{style}">{marks}</svg><div>{self!r}</div>'


def _real_column(name: str, values: ArrayLike, length: int | None = None) -> NDArray[np.float64]:
    """Return `values` as a new float64 vector, finite and of the given length, or refuse it."""
    try:
        column = np.array(values, dtype=np.float64)
    except (OverflowError, TypeError, ValueError) as error:
        raise MinutiaeError(f"minutiae: {name} must be numbers") from error
    if column.ndim != 1:
        raise MinutiaeError(f"minutiae: {name} must be one-dimensional, not {column.ndim}-D")
    if length is not None and column.size != length:
        raise MinutiaeError(f"minutiae: {name} has {column.size} values where x has {length}")
    if not (np.abs(column) <= LARGEST).all():
        raise MinutiaeError(f"minutiae: {name} has values that are not finite in float32")
    return column
