"""The two prints of a case study, their minutiae, and the results of the matchers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.lab.paper_figures.marks import BENEATH, TINTS, Tint
from fpmatch.lab.paper_figures.sheet import show
from fpmatch.pointset.delaunay.triangulate import triangulate

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from fpmatch.matching.verification import Verification
    from fpmatch.pointset.delaunay.triangulate import Triangulation
    from fpmatch.templates.minutiae import Template

    Floats = NDArray[np.float64]

FADED: Final = 0.35  # share of a print's contrast that is left beneath marks
ROOM_PX: Final = 10.0  # pixels of the image around the print and its minutiae


@dataclass(frozen=True, slots=True, eq=False)
class CaseSide:
    """One print, its minutiae and their triangulation, in pixels of the image, y down."""

    letter: str  # P for the probe, Q for the reference
    name: str
    pixels: NDArray[np.uint8]
    template: Template
    mesh: Triangulation

    @classmethod
    def of(cls, letter: str, name: str, pixels: NDArray[np.uint8], template: Template) -> CaseSide:
        """Triangulate the minutiae of a print."""
        mesh = triangulate(template.minutiae.xy.astype(np.float64))
        return cls(letter, name, pixels, template, mesh)

    @property
    def points(self) -> Floats:
        """Positions of the minutiae, shape (N, 2)."""
        return self.mesh.points

    @property
    def tint(self) -> Tint:
        """Colours of the side."""
        return TINTS[self.letter]

    @property
    def title(self) -> str:
        """Letter, role and name of the print."""
        return f"{self.letter}, the {'probe' if self.letter == 'P' else 'reference'}: {self.name}"

    @property
    def view(self) -> Floats:
        """Corners of the part of the image that has ridges or minutiae, shape (2, 2)."""
        places = [self.points]
        field = self.template.field
        if field is not None and field.mask.any():
            row, column = np.nonzero(field.mask)
            cells = np.column_stack([column, row]).astype(np.float64)
            places.append(field.step * (cells + 0.5))
        every = np.vstack(places)
        if not len(every):
            return np.array([[0.0, 0.0], [self.template.width, self.template.height]])
        return np.stack([every.min(axis=0) - ROOM_PX, every.max(axis=0) + ROOM_PX])

    def show(self, axes: Axes, contrast: float = FADED) -> float:
        """Draw the part of the print that has ridges; return the length of a page's pixel in it."""
        pixel = show(axes, self.view, y_down=True)
        show_pixels(axes, np.rint(255.0 - contrast * (255.0 - self.pixels)).astype(np.uint8))
        return pixel


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """Two prints, and their comparison by the default matcher and by the paper's."""

    probe: CaseSide
    reference: CaseSide
    default: Verification
    paper: Verification

    @classmethod
    def of(
        cls,
        probe: tuple[str, NDArray[np.uint8]],
        reference: tuple[str, NDArray[np.uint8]],
        default: Verification,
        paper: Verification,
    ) -> Case:
        """Collect names and pixels of two prints, and the comparisons of their templates."""
        p = CaseSide.of("P", *probe, default.probe)
        return cls(p, CaseSide.of("Q", *reference, default.reference), default, paper)

    @property
    def sides(self) -> tuple[CaseSide, CaseSide]:
        """Both prints."""
        return self.probe, self.reference

    @property
    def results(self) -> dict[str, Verification]:
        """Both comparisons by the names of the matchers, the default one first."""
        return {f"{self.default.matcher} (default)": self.default, self.paper.matcher: self.paper}

    @property
    def default_name(self) -> str:
        """Name of the default matcher."""
        return next(iter(self.results))

    @property
    def paired_points(self) -> tuple[Floats, Floats]:
        """Positions of the default matcher's pairs in both prints, each of shape (K, 2)."""
        i, j = self.default.pairs.T
        return self.probe.points[i], self.reference.points[j]


def show_pixels(axes: Axes, pixels: NDArray[np.uint8]) -> None:
    """Draw an image, grey or RGB, in its own pixels; the panel's limits remain."""
    limits = axes.get_xlim(), axes.get_ylim()
    rows, columns = pixels.shape[:2]
    axes.imshow(
        pixels, cmap="gray", vmin=0, vmax=255, extent=(-0.5, columns - 0.5, rows - 0.5, -0.5),
        aspect="auto", interpolation="bilinear", zorder=BENEATH,
    )  # fmt: skip
    axes.set(xlim=limits[0], ylim=limits[1])
