"""`Minutiae`, `RidgeField` and `Template`: the types that the whole package exchanges.

Conventions, the same everywhere:

- coordinates are pixels of the input image, origin top-left, x to the right, y down;
- angles are radians in [0, 2π), counter-clockwise on screen from +x, that is ``atan2(-dy, dx)``;
  the direction is that of ISO/IEC 19794-2: for an ending, from the minutia back along its ridge;
  for a bifurcation, along the valley that its two close branches enclose;
- kinds are the ISO codes 0 other, 1 ending, 2 bifurcation; quality runs from 0 to 100;
- resolutions are in dots per inch; distances are compared at 500 dpi.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.errors import MinutiaeError, ResolutionError
from fpmatch.printable import count

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import ArrayLike, NDArray

STANDARD_DPI: Final = 500.0
MM_PER_INCH: Final = 25.4
CM_PER_INCH: Final = MM_PER_INCH / 10
MIN_DPI: Final = 100.0
MAX_DPI: Final = 4000.0
COLUMNS: Final = ("x", "y", "angle", "kind", "quality")
LARGEST: Final = 1e37
"""Largest position or angle; float32, in which they are kept, also holds them at 500 dpi."""
CELL_BITS: Final = 8
"""Bits along a side of the picture of the ridges in a cell of a `RidgeField`."""
_MOST_RADIANS: Final = 1e6  # of an orientation: more is no angle, and overflows integers
WIDEST_PX: Final = 2.0**31  # frame of a mirrored template, whose field may be of any size
MOST_DRAWN: Final = 300
"""Minutiae in the drawing of a notebook."""


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
        y, angle = _real_column("y", self.y, n), _real_column("angle", self.angle, n)
        kind = _real_column("kind", np.zeros(n) if self.kind is None else self.kind, n)
        quality = _real_column(
            "quality", np.full(n, 100) if self.quality is None else self.quality, n
        )
        if n and (kind.min() < 0 or kind.max() > max(MinutiaKind)):
            raise MinutiaeError("minutia kind must be 0 (other), 1 (ending) or 2 (bifurcation)")
        if n and (quality.min() < 0 or quality.max() > 100):
            raise MinutiaeError("minutia quality must lie in 0..100")
        angle32 = np.mod(angle, 2 * np.pi).astype(np.float32)
        angle32[angle32 >= np.float32(2 * np.pi)] = 0.0
        kept: dict[str, NDArray[Any]] = {
            "x": x.astype(np.float32),
            "y": y.astype(np.float32),
            "angle": angle32,
            "kind": kind.astype(np.uint8),
            "quality": np.rint(quality).astype(np.uint8),
        }
        for name, column in kept.items():
            column.setflags(write=False)
            object.__setattr__(self, name, column)

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
        order = (MinutiaKind.ENDING, MinutiaKind.BIFURCATION, MinutiaKind.OTHER)
        kinds = [(int(np.count_nonzero(self.kind == kind)), kind.name.lower()) for kind in order]
        texts = [count(number, name) for number, name in kinds if number]
        return f"Minutiae({': '.join([str(len(self)), *filter(None, [', '.join(texts)])])})"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Minutiae):
            return NotImplemented
        return all(np.array_equal(getattr(self, c), getattr(other, c)) for c in COLUMNS)

    __hash__ = None  # type: ignore[assignment]

    def take(self, index: ArrayLike) -> Minutiae:
        """Return the minutiae that `index` (integers or a boolean mask, shape (N,)) selects."""
        i = np.asarray(index)
        return Minutiae(self.x[i], self.y[i], self.angle[i], self.kind[i], self.quality[i])


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class RidgeField:
    """The coarse ridge orientation field of a print, on square cells.

    Cell ``[i, j]`` is centred at pixel ``((j + 0.5) * step, (i + 0.5) * step)``.

    Parameters
    ----------
    step : float
        Side of a cell in pixels of the input image.
    orientation : ndarray of float32, shape (rows, columns)
        Ridge orientation in radians in [0, π), counter-clockwise on screen from +x.
    mask : ndarray of bool, shape (rows, columns)
        Where the print has ridges; `orientation` means nothing elsewhere.
    ridges : ndarray of uint64, shape (rows, columns), or None
        A picture of the ridges in each cell, 8 by 8 bits: bit ``8 * row + column`` is set on a
        ridge; 0 outside the mask. None where it is not known.

    Raises
    ------
    MinutiaeError
        If the shapes differ or the step is not positive.
    """

    step: float
    orientation: NDArray[np.float32]
    mask: NDArray[np.bool_]
    ridges: NDArray[np.uint64] | None = None

    def __post_init__(self) -> None:
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                orientation = np.ascontiguousarray(self.orientation, dtype=np.float32)
                ridges = None if self.ridges is None else np.asarray(self.ridges, np.uint64)
            mask = np.ascontiguousarray(self.mask, dtype=bool)
        except (OverflowError, ValueError) as error:
            raise MinutiaeError("ridge field: a number is beyond its range") from error
        if orientation.ndim != 2 or orientation.shape != mask.shape:
            raise MinutiaeError("ridge field: orientation and mask must be 2-D and of one shape")
        if not (np.isfinite(self.step) and self.step > 0):
            raise MinutiaeError("ridge field: step must be a positive number of pixels")
        if not (np.abs(orientation[mask]) < _MOST_RADIANS).all():
            raise MinutiaeError("ridge field: orientation must be finite radians inside the mask")
        object.__setattr__(self, "step", float(self.step))
        arrays: dict[str, NDArray[Any]] = {"orientation": orientation, "mask": mask}
        if ridges is not None:
            if ridges.shape != mask.shape:
                raise MinutiaeError("ridge field: ridges and mask must be of one shape")
            arrays["ridges"] = np.ascontiguousarray(ridges * mask)
        for name, array in arrays.items():
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def __repr__(self) -> str:
        rows, columns = self.mask.shape
        ridges = ", ridges" * (self.ridges is not None)
        return f"RidgeField({rows} x {columns} cells of {self.step:g} px{ridges})"

    @property
    def bits(self) -> NDArray[np.bool_]:
        """The pictures of all cells side by side, (8 * rows, 8 * columns); 0 where not known."""
        rows, columns = self.mask.shape
        if self.ridges is None:
            return np.zeros((rows * CELL_BITS, columns * CELL_BITS), bool)
        in_bytes = self.ridges.astype("<u8").view(np.uint8).reshape(rows, columns, CELL_BITS)
        bits = np.unpackbits(in_bytes, axis=2, bitorder="little")
        cells = bits.reshape(rows, columns, CELL_BITS, CELL_BITS).swapaxes(1, 2)
        return cells.reshape(rows * CELL_BITS, columns * CELL_BITS).astype(bool)

    def mirrored(self) -> RidgeField:
        """Return the field seen from behind, left and right exchanged."""
        ridges = self.ridges
        if ridges is not None:
            bits = np.unpackbits(np.ascontiguousarray(ridges[:, ::-1]).view(np.uint8))
            in_bytes = np.packbits(bits, bitorder="little")  # each in the other order
            ridges = in_bytes.view(np.uint64).reshape(self.mask.shape)
        orientation = np.mod(np.pi - self.orientation[:, ::-1] * self.mask[:, ::-1], np.pi)
        return RidgeField(self.step, orientation, self.mask[:, ::-1], ridges)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, RidgeField):
            return NotImplemented
        ours, theirs = (() if f.ridges is None else (f.ridges,) for f in (self, other))
        return (
            self.step == other.step
            and np.array_equal(self.mask, other.mask)
            and np.array_equal(self.orientation[self.mask], other.orientation[other.mask])
            and np.array_equal(ours, theirs)
        )

    __hash__ = None  # type: ignore[assignment]


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
        If width or height is not positive.
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
        minutiae = count(len(self), "minutia", "minutiae")
        return f"Template({size}, {minutiae}{ridges})"

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
        raise MinutiaeError(f"minutiae: {name} has values that are not finite, or too large")
    return column
