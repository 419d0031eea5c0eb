"""What an explanation shows: two prints or point sets, the ring of a pair, steps, their pictures.

Pictures are by matplotlib; P is blue and filled, Q orange and hollow.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from fpmatch.drawing.scene import palette
from fpmatch.drawing.scene.ink import print_picture
from fpmatch.drawing.scene.palette import hexadecimal
from fpmatch.lab.plots.style import figure_bytes, plain_style, short_name
from fpmatch.pointset.delaunay.triangulate import triangulate
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from fpmatch.pointset.delaunay.triangulate import Triangulation
    from fpmatch.prints.reading import GivenPrint

    Floats = NDArray[np.float64]
    Letter = Literal["P", "Q"]
    Sides = tuple["Side", "Side"]
    Plane = NDArray[np.complex128]
    Numbers = NDArray[np.integer[Any]]

EASY_RING: Final = range(5, 8)  # points of a ring that is easy to read
FRAME_NAME: Final = "frame"  # of a point of a ring that is no minutia
MARKS: Final = {"P": hexadecimal(palette.PROBE_MARK), "Q": hexadecimal(palette.REFERENCE_MARK)}
FILLS: Final = {"P": MARKS["P"], "Q": "none"}
GREY, TEXT = hexadecimal(palette.NEUTRAL_INK), hexadecimal(palette.TEXT)
KEPT, LEFT = hexadecimal(palette.MATCH), hexadecimal(palette.NO_MATCH)
_WIDTH, _HEIGHT = 12.0, 5.4  # inches
_ROOM: Final = 0.4  # of the extent of a ring, around it
_LARGEST_DOT: Final = 30.0  # diameter, in points, at a weight of 1
_CIRCLE: Final = np.cos(_TURN := np.linspace(0, 2 * np.pi, 181)), np.sin(_TURN)
_TICK_PX: Final = 12.0  # of a direction, at 500 dpi
_MOST_NUMBERED: Final = 100  # pairs


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
    name: str  # of the file
    z: Plane  # (N,): x + iy as the matcher takes them, of a print at 500 dpi
    index: NDArray[np.intp]  # (N,): places among the minutiae of the template, or rows of the file
    print_: GivenPrint | None = None
    flipped: bool = False  # whether the matcher's y points up, that of the image down

    @property
    def unit(self) -> float:
        """Length shown of one of the matcher's units."""
        return 1.0 if self.print_ is None else self.print_.template.dpi / STANDARD_DPI

    @cached_property
    def mesh(self) -> Triangulation:
        """Delaunay triangulation of its points."""
        return triangulate(np.column_stack([self.z.real, self.z.imag]))

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


def clearest(rings: Mapping[int, Ring], agreement: Sequence[float]) -> int | None:
    """Return which pair has the ring that is easiest to read, of those with one; None for none.

    It is a ring without frame points, of 5 to 7 points that are far apart on the circle, of a pair
    that agrees well.
    """

    def clarity(k: int) -> tuple[bool, bool, float]:
        ring = rings[k]
        gap = min(float(np.diff(a, append=a[0] + 2 * np.pi).min()) for a in ring.angles)
        return bool(ring.paired.all()), len(ring.names[0]) in EASY_RING, gap * agreement[k]

    return max(rings, key=clarity, default=None)


def draw(panels: int, draw_on: Callable[..., None], height: float = _HEIGHT) -> bytes:
    """Return a picture of some panels as SVG; `draw_on` gets their axes."""
    from matplotlib.figure import Figure  # noqa: PLC0415

    with plain_style({"font.size": 11.0, "lines.linewidth": 1.2}):
        figure = Figure((_WIDTH, height), layout="constrained")
        draw_on(*figure.subplots(1, panels, squeeze=False)[0])
        return figure_bytes(figure, "picture.svg", dpi=100)


def ground(
    axes: Axes, side: Side, title: str = "", view: Plane | None = None, room: float = 0.06
) -> None:
    """Prepare axes for a side, or a view of it with so much room: its print, pale."""
    title = title or short_name(Path(side.name).name)
    axes.set_title(
        f"{side.letter}: {title}", color=MARKS[side.letter], loc="left", fontweight="bold"
    )
    axes.set_aspect("equal")
    xy = side.shown(side.z if view is None else view)
    low, high = (xy.min(axis=0), xy.max(axis=0)) if len(xy) else (np.zeros(2), np.ones(2))
    room *= float((high - low).max()) or 1.0
    if side.print_ is not None:
        axes.imshow(print_picture(side.print_), cmap="gray", vmin=-500, vmax=255)
        axes.set(xticks=[], yticks=[])
    axes.set_xlim(low[0] - room, high[0] + room)
    axes.set_ylim(low[1] - room, high[1] + room)
    if side.print_ is not None:
        axes.invert_yaxis()


def dots(axes: Axes, side: Side, z: Plane, size: float = 5.0, letter: str = "") -> None:
    """Draw points in a side, in the style of P or Q."""
    style = letter or side.letter
    axes.plot(
        *side.shown(z).T, "o", markersize=size + 2.0 * (style == "Q"), zorder=4,
        markeredgecolor=MARKS[style], markerfacecolor=FILLS[style],
    )  # fmt: skip


def lines(axes: Axes, ends: Floats, colour: str = GREY, width: float = 0.9) -> None:
    """Draw straight lines, by their ends (K, 2, 2)."""
    from matplotlib.collections import LineCollection  # noqa: PLC0415

    axes.add_collection(LineCollection(list(ends), colors=colour, linewidths=width))


def labels(axes: Axes, xy: Floats) -> None:
    """Write numbers at places (K, 2), each on the side away from their middle."""
    for n, (at, away) in enumerate(zip(xy, xy - xy.mean(axis=0), strict=True), start=1):
        offset = away / (np.hypot(*away) or 1.0) * (13.0, -13.0 if axes.yaxis_inverted() else 13.0)
        axes.annotate(
            str(n), at, offset, textcoords="offset points", ha="center", va="center", zorder=6
        )


def triangulation_step(sides: Sides) -> Step:
    """Show the points of both sides, minutiae with their directions, and their triangulations."""

    def both(*axes: Axes) -> None:
        for ax, side in zip(axes, sides, strict=True):
            ground(ax, side)
            lines(ax, side.shown(side.z[side.mesh.edges]), MARKS[side.letter])
            dots(ax, side, side.z)
            if side.print_ is not None:
                m = side.print_.template.minutiae
                at, angle = m.xy[side.index], m.angle[side.index]
                tick = np.column_stack([np.cos(angle), -np.sin(angle)])
                ends = np.stack([at, at + _TICK_PX * side.unit * tick], axis=1)
                lines(ax, ends, MARKS[side.letter], 3.0)

    numbers = {
        side.letter.lower(): {
            "name": short_name(Path(side.name).name),
            "index": side.index.tolist(),
            "points": side.shown(side.z).tolist(),
            "edges": len(side.mesh.edges),
            "triangles": side.mesh.triangles.tolist(),
            "closed_rings": int(side.mesh.interior.sum()),
        }
        for side in sides
    }
    picture = draw(2, both)
    return Step("triangulation", picture, {**numbers, "prints": sides[0].print_ is not None})


def links(sides: Sides, pairs: tuple[Numbers, Numbers], styles: Sequence[dict[str, Any]]) -> bytes:
    """Draw both sides with a link from each point of P to one of Q, in styles of their own."""
    from matplotlib.patches import ConnectionPatch  # noqa: PLC0415

    def both(*axes: Axes) -> None:
        for ax, side in zip(axes, sides, strict=True):
            ground(ax, side)
            dots(ax, side, side.z, 4.0)
        ends = (side.shown(side.z[of]) for side, of in zip(sides, pairs, strict=True))
        for a, b, style in zip(*ends, styles, strict=True):
            link = ConnectionPatch(a, b, "data", "data", axesA=axes[0], axesB=axes[1], **style)
            link.set_in_layout(False)
            axes[1].add_artist(link)

    return draw(2, both)


def ring_steps(
    ring: Ring,
    which: int,
    weights: Floats,
    circle: dict[str, Any],
    weighed: dict[str, Any],
    images: tuple[complex | None, complex | None] = (None, None),
) -> list[Step]:
    """Show a ring on the unit circle, and the weights of its centre in one of its sides.

    `circle` and `weighed` are further numbers of the two steps, `images` those of the centres.
    """

    def draw_ring(*axes: Axes) -> None:
        for k, side in enumerate(ring.sides):
            _ring_on(axes[k], ring, k, weights)
            style: Any = {"color": MARKS[side.letter], "markerfacecolor": FILLS[side.letter]}
            style["markersize"] = (7.0, 12.0)[k]
            turn = np.exp(1j * (0.0 if k else ring.turn))
            z = turn * np.exp(1j * np.append(ring.angles[k], ring.angles[k][0]))
            axes[2].plot(z.real, z.imag, "o-", **style)
            if (image := images[k]) is not None:
                axes[2].plot((turn * image).real, (turn * image).imag, "*", **style)
        axes[2].set(aspect="equal", xlim=(-1.35, 1.35), ylim=(-1.35, 1.35), xticks=[], yticks=[])
        axes[2].set_title(f"Unit circle, P rotated by {np.degrees(ring.turn):.1f}°", loc="left")
        axes[2].plot(*_CIRCLE, color=GREY, zorder=0)
        labels(axes[2], np.column_stack([np.cos(ring.angles[1]), np.sin(ring.angles[1])]))

    letter = ring.sides[which].letter
    return [
        Step("unit_circle", draw(3, draw_ring), {**circle, **ring.numbers()}),
        Step("weights", None, {"first": letter, "weights": weights.tolist(), **weighed}),
    ]


def _ring_on(axes: Axes, ring: Ring, which: int, weights: Floats) -> None:
    """Draw a ring in its side, its points numbered, as large as their weights, and its spokes."""
    side, z, centre = ring.sides[which], ring.points[which], ring.centres[which]
    ground(axes, side, "the ring", np.append(z, centre), _ROOM)
    lines(axes, side.shown(ring.edges[which]))
    xy, middle = side.shown(z), side.shown(np.array(centre))
    colour = MARKS[side.letter]
    axes.fill(*xy.T, facecolor=(colour, 0.12), edgecolor=colour, linewidth=2.0)
    lines(axes, np.stack([xy, np.broadcast_to(middle, xy.shape)], axis=1), colour)
    sizes = _LARGEST_DOT * np.sqrt(weights)
    for point, size, paired in zip(z, sizes, ring.paired, strict=True):
        if paired:
            dots(axes, side, np.array([point]), size)
        else:
            axes.plot(*side.shown(point), "x", color=GREY, markersize=size)
    axes.plot(*middle, "*", markersize=13, color=TEXT, zorder=5)
    labels(axes, xy)


def superposed(sides: Sides, moved: Plane, pairs: tuple[Numbers, Numbers]) -> bytes:
    """Draw the first side's points, moved into the second, over its points; link pairs."""
    first, second = sides
    i, j = pairs

    def one(axes: Axes) -> None:
        ground(axes, second, f"{first.letter} is mapped here", np.append(moved, second.z))
        lines(axes, second.shown(np.stack([moved[i], second.z[j]], axis=1)), TEXT, 1.6)
        dots(axes, second, second.z, 6.0)
        dots(axes, second, moved[i], 4.0, first.letter)
        axes.plot(*second.shown(np.delete(moved, i)).T, "x", color=MARKS[first.letter])
        if 0 < len(i) <= _MOST_NUMBERED:
            labels(axes, second.shown(second.z[j]))

    return draw(1, one, 7.5)
