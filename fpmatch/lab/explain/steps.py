"""A step of the method as the page shows it, and the ring of a pair, which several steps show."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.drawing.scene.items import Scene
    from fpmatch.lab.explain.sides import Plane, Sides

    Floats = NDArray[np.float64]

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
