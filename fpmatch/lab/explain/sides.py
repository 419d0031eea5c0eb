"""The two prints or point sets of an explanation, as the matcher takes them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from fpmatch.drawing.overlay.page import Print
from fpmatch.drawing.scene import palette
from fpmatch.drawing.scene.items import Box, bounds
from fpmatch.pointset.delaunay.triangulate import triangulate

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.drawing.scene.palette import Colour
    from fpmatch.matching.prints.prepare import PreparedTemplate
    from fpmatch.pointset.delaunay.triangulate import Triangulation
    from fpmatch.pointset.paper.prepared_points import PreparedPoints
    from fpmatch.prints.reading import GivenPrint

    Letter = Literal["P", "Q"]
    Sides = tuple["Side", "Side"]
    Plane = NDArray[np.complex128]
    Floats = NDArray[np.float64]

MARKS: Final[dict[str, Colour]] = {"P": palette.PROBE_MARK, "Q": palette.REFERENCE_MARK}
INKS: Final[dict[str, Colour]] = {"P": palette.PROBE_INK, "Q": palette.REFERENCE_INK}
PRINT_MARGIN_PX: Final = 8.0
SET_MARGIN: Final = 0.04  # of the extent of a point set


@dataclass(frozen=True, eq=False)
class Side:
    """One print, or point set, of N points; a print has an image or a white ground.

    What is shown has y down: pixels of the image, or the units of the file with y turned.
    """

    letter: Letter
    name: str
    z: Plane  # (N,): x + iy as the matcher takes them
    index: NDArray[np.intp]  # (N,): places among the minutiae of the template, rows of the file
    unit: float = 1.0  # length shown of one of the matcher's units
    up: bool = True  # whether y of the matcher's points up
    print_: Print | None = None

    @classmethod
    def of_prepared(cls, letter: Letter, given: GivenPrint, prepared: PreparedTemplate) -> Side:
        """Take a print as the default matcher prepares it."""
        z = prepared.points[0] + 1j * prepared.points[1]
        index, print_ = prepared.index.astype(np.intp), Print(given.pixels, given.template)
        return cls(letter, Path(given.name).name, z, index, 1.0 / prepared.to_500dpi, True, print_)

    @classmethod
    def of_points(
        cls, letter: Letter, name: str, prepared: PreparedPoints, given: GivenPrint | None = None
    ) -> Side:
        """Take points as the paper's matcher does: a set, or positions of minutiae at 500 dpi."""
        z = prepared.points.view(np.complex128).ravel()
        every = np.arange(len(z))
        if given is None:
            return cls(letter, Path(name).name, z, every)
        unit, print_ = given.template.dpi / 500.0, Print(given.pixels, given.template)
        return cls(letter, Path(name).name, z, every, unit, False, print_)

    @property
    def mark(self) -> Colour:
        """Colour of points and lines."""
        return MARKS[self.letter]

    @property
    def ink(self) -> Colour:
        """Colour of areas."""
        return INKS[self.letter]

    @property
    def noun(self) -> str:
        """What its points are."""
        return "point" if self.print_ is None else "minutia"

    @property
    def nouns(self) -> str:
        """The same in the plural."""
        return "points" if self.print_ is None else "minutiae"

    @cached_property
    def mesh(self) -> Triangulation:
        """Delaunay triangulation of its points."""
        return triangulate(np.column_stack([self.z.real, self.z.imag]))

    @property
    def edges(self) -> Plane:
        """Ends of the edges of the triangulation, shape (E, 2)."""
        return self.z[self.mesh.edges]

    def shown(self, z: Plane) -> Floats:
        """Return places in the matcher's frame as they are shown, shape (K, 2)."""
        z = np.atleast_1d(z) * self.unit
        return np.column_stack([z.real, -z.imag if self.up else z.imag])

    def given(self, z: Plane) -> list[list[float]]:
        """Return places in the pixels of the image, or in the units of the file."""
        y_up = (1.0, -1.0) if self.print_ is None else (1.0, 1.0)
        rows: list[list[float]] = (self.shown(z) * y_up).tolist()
        return rows

    @cached_property
    def view(self) -> Box:
        """The part that is shown: what has ridges or points."""
        corners = [(x, y) for x, y in self.shown(self.z).tolist()]
        field = None if self.print_ is None else self.print_.template.field
        if field is not None and field.mask.any():
            row, column = (of * field.step for of in np.nonzero(field.mask))
            corners += [(float(column.min()), float(row.min()))]
            corners += [(float(column.max() + field.step), float(row.max() + field.step))]
        if self.print_ is not None:
            return bounds(corners or list(self.print_.box.corners)).grown(PRINT_MARGIN_PX)
        box = bounds(corners or [(0.0, 0.0)])
        return box.grown(SET_MARGIN * max(box.width, box.height) or 1.0)
