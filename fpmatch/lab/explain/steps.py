"""What steps of an explanation show: two prints or point sets, the ring of a pair, and a step."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from fpmatch.drawing.scene import palette
from fpmatch.drawing.scene.items import Box, bounds
from fpmatch.errors import FpmatchError
from fpmatch.pointset.delaunay.triangulate import triangulate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.drawing.scene.items import Scene
    from fpmatch.drawing.scene.palette import Colour
    from fpmatch.matching.prints.prepared import PreparedTemplate
    from fpmatch.pointset.delaunay.triangulate import Triangulation
    from fpmatch.pointset.paper.one_rings import PreparedPoints
    from fpmatch.prints.reading import GivenPrint

    Floats = NDArray[np.float64]
    Letter = Literal["P", "Q"]
    Sides = tuple["Side", "Side"]
    Plane = NDArray[np.complex128]


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
    print_: GivenPrint | None = None

    @classmethod
    def of_prepared(cls, letter: Letter, given: GivenPrint, prepared: PreparedTemplate) -> Side:
        """Take a print as the default matcher prepares it."""
        z = prepared.points[0] + 1j * prepared.points[1]
        index = prepared.index.astype(np.intp)
        return cls(letter, Path(given.name).name, z, index, 1.0 / prepared.to_500dpi, True, given)

    @classmethod
    def of_points(
        cls, letter: Letter, name: str, prepared: PreparedPoints, given: GivenPrint | None = None
    ) -> Side:
        """Take points as the paper's matcher does: a set, or positions of minutiae at 500 dpi."""
        z = prepared.points.view(np.complex128).ravel()
        every = np.arange(len(z))
        if given is None:
            return cls(letter, Path(name).name, z, every)
        unit = given.template.dpi / 500.0
        return cls(letter, Path(name).name, z, every, unit, False, given)

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
            t = self.print_.template
            image = Box(-0.5, -0.5, t.width, t.height)
            return bounds(corners or [*image.corners]).grown(PRINT_MARGIN_PX)
        box = bounds(corners or [(0.0, 0.0)])
        return box.grown(SET_MARGIN * max(box.width, box.height) or 1.0)


EASY_RING: Final = range(5, 8)  # points of a ring that is easy to read
FRAME_NAME: Final = "frame"  # of a point that is no minutia


class ExplainError(FpmatchError):
    """Two prints or point sets cannot be explained as asked."""


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """One step: a sentence, an equation as HTML, a picture as a scene or SVG, a table.

    `name` is that of the picture's file.
    """

    name: str
    title: str
    sentence: str
    equation: str = ""
    picture: Scene | bytes | None = None
    table: Sequence[Sequence[str]] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Ring:
    """The ring of a pair, d points in each side, and its places on the unit circle."""

    sides: Sides
    centres: tuple[complex, complex]
    points: tuple[Plane, Plane]  # (d,) each; a point of P corresponds to that of Q
    names: tuple[list[str], list[str]]  # places of the points in template or file
    edges: tuple[Plane, Plane]  # (E, 2) each: ends of the edges of the meshes around
    angles: tuple[Floats, Floats]  # (d,) each: eq. (3), in radians
    turn: float  # in radians, by which P's circle is rotated onto Q's

    def __len__(self) -> int:
        return len(self.points[0])

    @property
    def apart(self) -> Floats:
        """Angles in radians from the places of P, after the rotation, to the places of Q."""
        off = np.exp(1j * (self.angles[1] - self.angles[0] - self.turn))
        return np.asarray(np.angle(off))

    def numbers(self) -> dict[str, Any]:
        """Return the ring for JSON, angles in degrees."""
        each = {
            side.letter.lower(): {
                "centre": side.given(np.array([centre]))[0],
                "points": side.given(points),
                "names": names,
                "angles_deg": np.degrees(angles).tolist(),
            }
            for side, centre, points, names, angles in zip(
                self.sides, self.centres, self.points, self.names, self.angles, strict=True
            )
        }
        return {"turn_deg": float(np.degrees(self.turn)), **each}


def chosen_pair(
    asked: int | None, rings: Sequence[Ring | None], agreement: Sequence[float]
) -> int | None:
    """Return which pair's ring is shown, from 0, or refuse the one `asked` for, from 1.

    By default it is a ring of 5 to 7 points that is easy to read, of a pair that agrees well;
    None where no pair has a ring.
    """
    there = [k for k, ring in enumerate(rings, start=1) if ring is not None]
    if asked is None:
        ranked = [(*_clarity(rings[k - 1], agreement[k - 1]), -k) for k in there]
        return -max(ranked)[-1] - 1 if ranked else None
    if not 1 <= asked <= len(rings):
        known = f"pairs are numbered 1 to {len(rings)}" if rings else "there is no pair"
        raise ExplainError(f"--pair {asked}: {known}")
    if asked not in there:
        others = f"these pairs have one: {', '.join(map(str, there))}" if there else "no pair has"
        raise ExplainError(f"--pair {asked}: it has no ring that is closed in both; {others}")
    return asked - 1


def _clarity(ring: Ring | None, agreement: float) -> tuple[bool, bool, float]:
    """Rank a ring: of minutiae alone, of a good size, its places far apart."""
    assert ring is not None
    inside = FRAME_NAME not in ring.names[0]
    arcs = min(float(np.diff(a, append=a[0] + 2 * np.pi).min()) for a in ring.angles)
    return inside, len(ring) in EASY_RING, arcs * agreement


def crossed_side(points: Plane, centre: complex) -> tuple[int, complex]:
    """Return which side the line from point 0 through the centre crosses, and where.

    A side is that after its point; the ring goes once round the centre, either way.
    """
    away = points - centre
    turned = (away[0].conjugate() * away).imag * np.sign((away[0].conjugate() * away[1]).imag)
    r = int(((turned >= 0) & (np.roll(turned, -1) < 0)).argmax())
    s = (r + 1) % len(points)
    share = turned[r] / (turned[r] - turned[s])
    return r, complex(points[r] + share * (points[s] - points[r]))
