"""What an explanation shows: two prints or point sets, the ring of a pair, and a step."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from fpmatch.errors import FpmatchError
from fpmatch.pointset.delaunay.triangulate import triangulate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.pointset.delaunay.triangulate import Triangulation
    from fpmatch.prints.reading import GivenPrint

    Floats = NDArray[np.float64]
    Letter = Literal["P", "Q"]
    Sides = tuple["Side", "Side"]
    Plane = NDArray[np.complex128]

EASY_RING: Final = range(5, 8)  # points of a ring that is easy to read
FRAME_NAME: Final = "frame"  # of a point of a ring that is no minutia


class ExplainError(FpmatchError):
    """Two prints or point sets cannot be explained as asked."""


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """One step: the name of its text and of its picture's file, a picture as SVG, its numbers."""

    name: str
    picture: bytes | None = None
    numbers: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Side:
    """One print, or point set, of N points."""

    letter: Letter
    name: str  # of the file, as titles show it
    z: Plane  # (N,): x + iy as the matcher takes them
    index: NDArray[np.intp]  # (N,): places among the minutiae of the template, or rows of the file
    unit: float = 1.0  # length shown of one of the matcher's units
    flipped: bool = False  # whether the matcher's y points up, that of the image down
    print_: GivenPrint | None = None

    @cached_property
    def mesh(self) -> Triangulation:
        """Delaunay triangulation of its points."""
        return triangulate(np.column_stack([self.z.real, self.z.imag]))

    @property
    def edges(self) -> Plane:
        """Ends of the edges of the triangulation, shape (E, 2)."""
        return self.z[self.mesh.edges]

    def shown(self, z: Plane) -> Floats:
        """Return places (...) of the matcher in pixels of the image or units of the file, (..., 2).

        Those of an image have y pointing down.
        """
        z = np.asarray(z) * self.unit
        return np.stack([z.real, -z.imag if self.flipped else z.imag], axis=-1)


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

    @property
    def paired(self) -> NDArray[np.bool_]:
        """Which points are no frame points."""
        return np.array([name != FRAME_NAME for name in self.names[0]])

    def numbers(self) -> dict[str, Any]:
        """Return the ring, angles in degrees: places on the circle, and how far they are apart."""
        turned = self.angles[0] + self.turn
        p, q = (np.degrees(of % (2 * np.pi)).tolist() for of in (turned, self.angles[1]))
        apart = np.degrees(np.angle(np.exp(1j * (self.angles[1] - turned))))
        keys = "p", "q", "place_p", "place_q", "apart"
        rows = zip(*self.names, p, q, apart.tolist(), strict=True)
        return {
            "turn": float(np.degrees(self.turn)),
            "points": [dict(zip(keys, row, strict=True)) for row in rows],
            "frame_points": int((~self.paired).sum()),
            "spread": float(apart[self.paired].std()) if self.paired.any() else 0.0,
        }


def chosen_pair(
    asked: int | None, rings: Sequence[Ring | None], agreement: Sequence[float]
) -> int | None:
    """Return which pair's ring is shown, from 0, or refuse the one `asked` for, from 1.

    By default it is a ring without frame points, of 5 to 7 points that are far apart on the circle,
    of a pair that agrees well; None where no pair has a ring.
    """
    clarity: dict[int, tuple[bool, bool, float]] = {}
    for k, ring in enumerate(rings):
        if ring is not None:
            gap = min(float(np.diff(a, append=a[0] + 2 * np.pi).min()) for a in ring.angles)
            easy = len(ring.names[0]) in EASY_RING
            clarity[k] = bool(ring.paired.all()), easy, gap * agreement[k]
    if asked is None:
        return max(clarity, key=lambda k: clarity[k]) if clarity else None
    if asked - 1 not in clarity:
        those = ", ".join(str(k + 1) for k in clarity) or "none"
        raise ExplainError(f"--pair {asked}: pairs with a ring that is closed in both: {those}")
    return asked - 1
