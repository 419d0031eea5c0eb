"""`RidgeField`: the coarse ridge orientation field of a print, with pictures of its ridges.

Pixels and angles follow the conventions of `fpmatch.templates.minutiae`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import MinutiaeError

if TYPE_CHECKING:
    from numpy.typing import NDArray

CELL_BITS: Final = 8
"""Bits along a side of the picture of the ridges in a cell of a `RidgeField`."""
_REVERSED: Final = np.packbits(  # the order of the bits of each byte
    np.unpackbits(np.arange(256, dtype=np.uint8)[:, None], axis=1), axis=1, bitorder="little"
).ravel()
_MOST_RADIANS: Final = 1e6  # of an orientation: more is no angle, and overflows integers


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
        set_read_only(self, orientation=orientation, mask=mask)
        object.__setattr__(self, "step", float(self.step))
        if ridges is not None:
            if ridges.shape != mask.shape:
                raise MinutiaeError("ridge field: ridges and mask must be of one shape")
            set_read_only(self, ridges=np.ascontiguousarray(ridges * mask))

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
            in_bytes = np.ascontiguousarray(ridges[:, ::-1]).view(np.uint8)
            ridges = _REVERSED[in_bytes].view(np.uint64)
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


def set_read_only(owner: object, **arrays: NDArray[Any]) -> None:
    """Set attributes of a frozen object to arrays that cannot be written."""
    for name, array in arrays.items():
        array.setflags(write=False)
        object.__setattr__(owner, name, array)
