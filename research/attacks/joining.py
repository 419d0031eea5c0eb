"""Two prints joined into one: their minutiae and ridges in a template, their pixels in an image."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import TemplateError
from fpmatch.templates.minutiae import Minutiae, Template
from fpmatch.templates.ridge_field import RidgeField

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.image.preprocess.arrays import Grey

SIDE_BY_SIDE: Final = "side by side"
TOUCHING: Final = "side by side, the ridges touching"
ON_TOP: Final = "on top of each other"
ALTERNATING: Final = "on top of each other, the ridges of either in every second cell"
CUT: Final = "cut along a line through the middle"
KINDS: Final = (SIDE_BY_SIDE, TOUCHING, ON_TOP, ALTERNATING, CUT)
IMAGE_KINDS: Final = tuple(kind for kind in KINDS if kind != ALTERNATING)


@dataclass(frozen=True)
class Joint:
    """How two prints are joined: the second is moved, and a line may divide both."""

    kind: str
    x: int  # shift of the second, pixels
    y: int
    middle: tuple[float, float]  # of the first, through which the line runs
    turn: float  # direction of the line, radians

    @classmethod
    def of(cls, a: Template, b: Template, kind: str, turn: float = 0.0) -> Joint:
        """Place two prints with ridge fields of one resolution, by whole cells."""
        one, other, step = _ridges(a), _ridges(b), _field_of(a).step
        if kind == SIDE_BY_SIDE:
            x, y = math.ceil(a.width / step) * step, 0.0
        elif kind == TOUCHING:
            x = one[:, 0].max() - other[:, 0].min() + step
            y = one.mean(axis=0)[1] - other.mean(axis=0)[1]
        else:
            x, y = one.mean(axis=0) - other.mean(axis=0)
        x, y = (round(round(float(side) / step) * step) for side in (x, y))
        middle_x, middle_y = one.mean(axis=0).tolist()
        return cls(kind, x, y, (middle_x, middle_y), turn)

    def first(self, x: NDArray[Any], y: NDArray[Any]) -> NDArray[np.bool_]:
        """Return which points are of the first print alone; all where no line divides them."""
        if self.kind != CUT:
            return np.ones(np.shape(x), bool)
        x, y = x - self.middle[0], y - self.middle[1]
        side = x * math.sin(self.turn) + y * math.cos(self.turn)
        return np.asarray(side < 0)

    def templates(self, a: Template, b: Template) -> Template:
        """Return the template with minutiae and ridges of both."""
        moved = Minutiae(
            b.minutiae.x + self.x,
            b.minutiae.y + self.y,
            *(getattr(b.minutiae, name) for name in ("angle", "kind", "quality")),
        )
        size = max(a.width, b.width + self.x), max(a.height, b.height + self.y)
        within = (moved.x >= 0) & (moved.y >= 0)
        if self.kind == CUT:
            within &= ~self.first(moved.x, moved.y)
        ours = a.minutiae.take(self.first(a.minutiae.x, a.minutiae.y))
        theirs = moved.take(within)
        columns = (
            np.concatenate([getattr(m, name) for m in (ours, theirs)])
            for name in ("x", "y", "angle", "kind", "quality")
        )
        return Template(Minutiae(*columns), *size, a.dpi, self._fields(_field_of(a), _field_of(b)))

    def images(self, a: Grey, b: Grey) -> Grey:
        """Return the image with the pixels of both, the darker one where both have some."""
        one, other = _on_one_sheet(a, b, self.y, self.x, 255)
        y, x = np.ogrid[: one.shape[0], : one.shape[1]]
        if self.kind == CUT:
            return np.asarray(np.where(self.first(x, y), one, other))
        return np.asarray(np.minimum(one, other))

    def _fields(self, a: RidgeField, b: RidgeField) -> RidgeField:
        rows, columns = (round(side / a.step) for side in (self.y, self.x))

        def both(name: str) -> tuple[NDArray[Any], NDArray[Any]]:
            return _on_one_sheet(getattr(a, name), getattr(b, name), rows, columns, 0)

        ours, theirs = both("mask")
        row, column = np.ogrid[: ours.shape[0], : ours.shape[1]]
        first = self.first((column + 0.5) * a.step, (row + 0.5) * a.step)
        if self.kind == ALTERNATING:
            first = (row + column) % 2 == 0
        if self.kind == CUT:
            mask = np.where(first, ours, theirs)
        else:
            mask, first = ours | theirs, ours & (first | ~theirs)
        orientation, ridges = (np.where(first, *both(name)) for name in ("orientation", "ridges"))
        return RidgeField(a.step, orientation, mask, ridges)


def _ridges(one: Template) -> NDArray[np.float64]:
    """Return x and y of the cells with ridges, (N, 2)."""
    field = _field_of(one)
    return np.asarray((np.argwhere(field.mask)[:, ::-1] + 0.5) * field.step, np.float64)


def _field_of(one: Template) -> RidgeField:
    """Return the ridge field of a template that has one."""
    if one.field is None:
        raise TemplateError("no ridges: it cannot be joined")
    return one.field


def _on_one_sheet(
    a: NDArray[Any], b: NDArray[Any], rows: int, columns: int, empty: int
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return two arrays on sheets of one size, the second moved; `empty` is around them."""
    sheet = max(a.shape[0], b.shape[0] + rows), max(a.shape[1], b.shape[1] + columns)
    one, other = (np.full(sheet, empty, array.dtype) for array in (a, b))
    one[: a.shape[0], : a.shape[1]] = a
    part = b[max(-rows, 0) :, max(-columns, 0) :]
    top, left = max(rows, 0), max(columns, 0)
    other[top : top + part.shape[0], left : left + part.shape[1]] = part
    return one, other
