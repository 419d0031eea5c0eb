"""What the pictures of a case study show: two prints, and what two matchers found on them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.paper_figures.marks import TINTS
from fpmatch.pointset.delaunay.triangulate import triangulate

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from fpmatch.matching.result import Verification
    from fpmatch.minutiae import Template
    from fpmatch.pointset.delaunay.triangulation import Triangulation

    Floats = NDArray[np.float64]

FADED: Final = 0.35  # share of a print's contrast that is left beneath marks
ROOM_PX: Final = 10.0  # pixels of the image around the print and its minutiae
BENEATH: Final = 0.0  # layer of a print


@dataclass(frozen=True, slots=True, eq=False)
class CaseSide:
    """Hold one print, its minutiae and their triangulation, in pixels of the image, y down.

    Parameters
    ----------
    letter : str
        P for the probe, Q for the reference.
    name : str
        What captions call the print.
    pixels : ndarray of uint8, shape (H, W)
        The image.
    template : Template
        Its template.
    mesh : Triangulation
        Of its minutiae.
    """

    letter: str
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
    def view(self) -> tuple[float, float, float, float]:
        """Left, top, right and bottom of the part of the image that has ridges or minutiae."""
        spots = [self.points]
        field = self.template.field
        if field is not None and field.mask.any():
            row, column = np.nonzero(field.mask)
            cells = np.column_stack([column, row]).astype(np.float64)
            spots.append(field.step * (cells + 0.5))
        every = np.vstack(spots)
        if not len(every):
            return 0.0, 0.0, float(self.template.width), float(self.template.height)
        left, top = (every.min(axis=0) - ROOM_PX).tolist()
        right, bottom = (every.max(axis=0) + ROOM_PX).tolist()
        return left, top, right, bottom


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """Hold two prints, and their comparison by the default matcher and by the paper's."""

    probe: CaseSide
    reference: CaseSide
    default: Verification
    paper: Verification

    @property
    def sides(self) -> tuple[CaseSide, CaseSide]:
        """Both prints."""
        return self.probe, self.reference

    @property
    def results(self) -> tuple[Verification, Verification]:
        """Both comparisons, the default matcher's first."""
        return self.default, self.paper


def make_case(
    probe: tuple[str, NDArray[np.uint8]],
    reference: tuple[str, NDArray[np.uint8]],
    default: Verification,
    paper: Verification,
) -> Case:
    """Put together what a case study shows.

    Parameters
    ----------
    probe, reference : (str, ndarray of uint8, shape (H, W))
        What the prints are called, and the pixels of their images.
    default, paper : Verification
        Their comparison by the default matcher and by the paper's, of the same templates.

    Returns
    -------
    Case
        What `draw_case_study` draws.
    """
    return Case(
        CaseSide.of("P", *probe, default.probe),
        CaseSide.of("Q", *reference, default.reference),
        default,
        paper,
    )


def paired_points(case: Case, result: Verification) -> tuple[Floats, Floats]:
    """Return the positions of the paired minutiae in both prints, each of shape (K, 2)."""
    i, j = result.pairs.T
    return case.probe.points[i], case.reference.points[j]


def show_box(axes: Axes, view: tuple[float, float, float, float]) -> float:
    """Fit a box of an image into a panel, y down; return the length of a page's pixel in it."""
    (x0, x1), (y1, y0) = axes.get_xlim(), axes.get_ylim()
    width, height = x1 - x0, y1 - y0
    left, top, right, bottom = view
    pixel = max((right - left) / width, (bottom - top) / height)
    x, y = (left + right) / 2, (top + bottom) / 2
    axes.set_xlim(x - width * pixel / 2, x + width * pixel / 2)
    axes.set_ylim(y + height * pixel / 2, y - height * pixel / 2)
    return pixel


def show_print(axes: Axes, side: CaseSide, contrast: float = FADED) -> float:
    """Draw the part of a print that has ridges; return the length of a page's pixel in it."""
    pixel = show_box(axes, side.view)
    faded = 255.0 - contrast * (255.0 - side.pixels)
    show_pixels(axes, np.rint(faded).astype(np.uint8))
    return pixel


def show_pixels(axes: Axes, pixels: NDArray[np.uint8]) -> None:
    """Draw an image, grey or RGB, in its own pixels, and leave the panel's limits as they are."""
    limits = axes.get_xlim(), axes.get_ylim()
    rows, columns = pixels.shape[:2]
    axes.imshow(
        pixels,
        cmap="gray",
        vmin=0,
        vmax=255,
        extent=(-0.5, columns - 0.5, rows - 0.5, -0.5),
        aspect="auto",
        interpolation="bilinear",
        zorder=BENEATH,
    )
    axes.set_xlim(*limits[0])
    axes.set_ylim(*limits[1])


def names(case: Case) -> tuple[str, str]:
    """Return what captions call the two matchers."""
    default, paper = (result.matcher for result in case.results)
    return f"{default} (default)", paper


def called(side: CaseSide) -> str:
    """Return letter and name of a print, as titles of panels have them."""
    role = "probe" if side.letter == "P" else "reference"
    return f"{side.letter}, the {role}: {side.name}"


def mark_of(side: CaseSide) -> tuple[int, int, int]:
    """Return the colour of a side's marks."""
    return TINTS[side.letter].mark
