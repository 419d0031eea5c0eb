"""What every page has: a caption above its panels, minutiae as marks, and a legend below.

The caption states the decision, the score on its scale, evidence, transform and reason. The shape
of a mark shows the kind of a minutia, a tick its direction, the weight the pairing.
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple, TypeAlias

import numpy as np

from fpmatch.drawing.scene import palette
from fpmatch.drawing.scene.items import (
    Box,
    Circle,
    Group,
    Item,
    Path,
    Pen,
    Scene,
    Text,
    directions,
    moved,
    text_width,
    wrapped,
    zoomed,
)
from fpmatch.printable import count, rotation_text
from fpmatch.prints.report import decision_in_words, odds, outcome
from fpmatch.templates.minutiae import MinutiaKind

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import ArrayLike

    from fpmatch.drawing.scene.items import Matrix, Point
    from fpmatch.matching.verify import Verification
    from fpmatch.templates.minutiae import Minutiae

Entry: TypeAlias = "tuple[str, Iterable[Path | Circle]]"
"""A meaning, and its sample in a box 34 wide whose middle of the left side is (0, 0)."""

MARGIN: Final = 24.0
LARGEST_PANEL_SIDE: Final = 2000.0  # page pixels
_LARGEST_ZOOM: Final = 3.0
_COMFORTABLE_SIDE: Final = 1000.0  # page pixels of a panel
_BORDER_PX: Final = 6.0  # reference pixels of paper around what is shown
_LEAST_PAGE_WIDTH: Final = 800.0
_BADGE_HEIGHT: Final = 44.0
_VERDICT_SIZE, _SCORE_SIZE, _VALUE_SIZE, _LABEL_SIZE, _REASON_SIZE = 24.0, 30.0, 17.0, 13.0, 17.0
_REASON_LINES: Final = 4
_FACT_GAP, _FACT_HEIGHT = 26.0, 46.0
_GAUGE_HEIGHT: Final = 8.0
_MAX_SCORE: Final = 100.0
FRAME_PEN: Final = Pen(palette.PANEL_EDGE, width=1.0)
LEGEND_SIZE, _ROW, SAMPLE_WIDTH, _GAP = 14.0, 30.0, 34.0, 24.0

_SQUARE_SHARE: Final = math.sqrt(math.pi) / 2  # half the side of a square as large as the circle


class MarkStyle(NamedTuple):
    """The style of the minutiae of one side; lengths in page pixels."""

    pen: Pen  # of the shape's outline and of the tick
    radius: float  # of an ending's circle; squares and diamonds have about the same area
    tick_px: float  # beyond the shape
    role: str  # the SVG class


PAIRED: Final = {
    side: MarkStyle(Pen(colour, width=2.2, halo=halo), radius, tick, f"{side} paired")
    for side, colour, halo, radius, tick in (
        ("reference", palette.REFERENCE_MARK, 1.4, 7.5, 11.0),
        ("probe", palette.PROBE_MARK, 0.8, 4.0, 12.0),
    )
}
UNPAIRED: Final = {
    side: MarkStyle(Pen(colour, width=1.3, halo=1.0), radius, 8.0, f"{side} unpaired")
    for side, colour, radius in (
        ("reference", palette.REFERENCE_FAINT, 5.0),
        ("probe", palette.PROBE_FAINT, 3.4),
    )
}
PAIR_PEN: Final = Pen(palette.PAIR_LINK, width=2.0, halo=1.2)
EDGES: Final = {
    "reference": Pen(palette.REFERENCE_FAINT, width=1.6, dash=(2.0, 5.0)),
    "probe": Pen(palette.PROBE_FAINT, width=1.6, dash=(9.0, 6.0)),
}
BESIDE_PAIRED: Final = {
    side: style._replace(pen=style.pen._replace(halo=1.4), radius=6.0, tick_px=10.0)
    for side, style in PAIRED.items()
}
BESIDE_UNPAIRED: Final = {side: style._replace(radius=4.5) for side, style in UNPAIRED.items()}
_SAMPLE: Final = MarkStyle(Pen(palette.TEXT_MUTED, width=2.2, halo=1.4), 6.0, 10.0, "sample")


def mark(point: Point, direction: Point, kind: int, style: MarkStyle) -> tuple[Path, Path | Circle]:
    """Draw one minutia on the page: its tick, then its shape.

    The shape is a circle for an ending, a square for a bifurcation, a diamond for any other kind;
    `direction` is a unit vector.
    """
    (x, y), (dx, dy) = point, direction
    r, end = style.radius, style.radius + style.tick_px
    line = ((x + r * dx, y + r * dy), (x + end * dx, y + end * dy))
    tick = Path(line, style.pen, role=f"tick {style.role}")
    if kind == MinutiaKind.ENDING:
        return tick, Circle(point, r, style.pen, f"ending {style.role}")
    half = r * _SQUARE_SHARE
    if kind == MinutiaKind.BIFURCATION:
        square = Box(x, y, 0, 0).grown(half).corners
        return tick, Path(square, style.pen, True, f"bifurcation {style.role}")
    half *= math.sqrt(2)
    diamond = ((x, y - half), (x + half, y), (x, y + half), (x - half, y))
    return tick, Path(diamond, style.pen, True, f"other {style.role}")


def marks(
    minutiae: Minutiae, index: Iterable[int], matrix: Matrix, style: MarkStyle
) -> list[Path | Circle]:
    """Draw the minutiae at `index`, whose pixels `matrix` maps to the page."""
    points, ways = moved(matrix, minutiae.xy), directions(matrix, minutiae.angle)
    kinds = minutiae.kind.tolist()
    return [shape for i in index for shape in mark(points[i], ways[i], kinds[i], style)]


RIDGE_SAMPLES: Final = {
    ink: [Path(((2, y), (SAMPLE_WIDTH - 2, y)), Pen(ink, width=3.4)) for y in (-6.5, 0.0, 6.5)]
    for ink in (palette.REFERENCE_INK, palette.PROBE_INK, palette.BOTH_INKS, palette.NEUTRAL_INK)
}
_sample = partial(mark, (12.0, 0.0), (1.0, 0.0))
ending_sample = partial(_sample, MinutiaKind.ENDING)
KIND_SAMPLES: Final[tuple[Entry, ...]] = (
    ("ending, with direction", ending_sample(_SAMPLE)),
    ("bifurcation", _sample(MinutiaKind.BIFURCATION, _SAMPLE)),
)


def comfortable_zoom(side: float, comfortable: float) -> float:
    """Return the magnification at which marks are crisp and the page fits a screen.

    A view whose longer `side`, in pixels of its print, is less than `comfortable` page pixels is
    magnified towards them; a larger one is shrunk only where it would exceed the largest panel.
    """
    zoom = min(max(comfortable / side, 1.0), _LARGEST_ZOOM)
    return min(zoom, LARGEST_PANEL_SIDE / side)


def panel_for(verification: Verification, shown: ArrayLike) -> tuple[Group, Box, Matrix]:
    """Return the caption of a page that shows all of `shown`, (N, 2), pixels of the reference.

    With it come the place of the panel, and the matrix of the pixels.
    """
    left, top = (np.min(shown, axis=0) - _BORDER_PX).tolist()
    width, height = (np.ptp(shown, axis=0) + 2 * _BORDER_PX).tolist()
    zoom = comfortable_zoom(max(width, height), _COMFORTABLE_SIDE)
    caption, place = header(verification, (round(width * zoom), round(height * zoom)))
    return caption, place, zoomed(zoom, (left, top), (place.x, place.y))


def header(verification: Verification, panel: tuple[float, float]) -> tuple[Group, Box]:
    """Compose the caption of a page with a panel of this width and height.

    Returns its items, whose clip is the band, and the place of the panel below it.
    """
    v, width = verification, max(_LEAST_PAGE_WIDTH, panel[0] + 2 * MARGIN)
    items = _decision(v, width)
    y = MARGIN + _BADGE_HEIGHT + 16
    rows = [
        [(max(text_width(a, _LABEL_SIZE), text_width(b, _VALUE_SIZE)), a, b) for a, b in row]
        for row in facts(v)
    ]
    everything = [fact for row in rows for fact in row]
    if sum(needed + _FACT_GAP for needed, *_ in everything) <= width - 2 * MARGIN:
        rows = [everything]
    for row in filter(None, rows):
        x = MARGIN
        for needed, label, value in row:
            if x > MARGIN and x + needed > width - MARGIN:
                x, y = MARGIN, y + _FACT_HEIGHT
            items += [
                Text(x, y + 13, label, _LABEL_SIZE, palette.TEXT_MUTED),
                Text(x, y + 33, value, _VALUE_SIZE, palette.TEXT, role="fact"),
            ]
            x += needed + _FACT_GAP
        y += _FACT_HEIGHT
    if v.reason:
        label = "Why" if v.shortage is None else "Missing"
        lines = wrapped(f"{label}: {v.reason}", _REASON_SIZE, width - 2 * MARGIN)
        if len(lines) > _REASON_LINES:
            lines = [*lines[: _REASON_LINES - 1], lines[_REASON_LINES - 1] + " …"]
        y += 4
        for line in lines:
            y += _REASON_SIZE + 6
            colour = palette.DECISION[v.decision]
            items.append(Text(MARGIN, y - 4, line, _REASON_SIZE, colour, role="reason"))
        y += 6
    band = Box(0, 0, width, y + 6)
    ground = Path(band.corners, Pen(fill=palette.BAND), closed=True)
    place = Box((width - panel[0]) // 2, math.ceil(band.bottom + 16), *panel)
    return Group((ground, *items), band, "caption"), place


def _decision(v: Verification, width: float) -> list[Item]:
    """Compose the decision, the score, and the score on its scale beside the threshold."""
    colour, muted, y = palette.DECISION[v.decision], palette.TEXT_MUTED, MARGIN
    decision, score = decision_in_words(v), f"{v.score:.1f}"
    badge = Box(MARGIN, y, text_width(decision, _VERDICT_SIZE) + 40, _BADGE_HEIGHT)
    middle, score_x = badge.x + badge.width / 2, badge.right + 24
    score_width = max(text_width(score, _SCORE_SIZE), text_width("Score", _LABEL_SIZE))
    bar_x = score_x + score_width + 32
    bar = Box(bar_x, y + 25, width - MARGIN - bar_x, _GAUGE_HEIGHT)
    score_end, threshold_x = (
        bar.x + bar.width * (min(max(value / _MAX_SCORE, 0), 1) if math.isfinite(value) else 0)
        for value in (v.score, v.threshold)
    )
    reached = bar._replace(width=score_end - bar.x)
    threshold = f"threshold {v.threshold:.1f}"
    half = text_width(threshold, _LABEL_SIZE) / 2
    label_x = min(max(threshold_x, bar.x + half), bar.right - half)
    needle = ((threshold_x, bar.y - 9), (threshold_x, bar.bottom + 4))
    return [
        Path(badge.corners, Pen(fill=colour), closed=True),
        Text(middle, y + 31, decision, _VERDICT_SIZE, palette.PAPER, "middle", 0.5, role="verdict"),
        Text(score_x, y + 10, "Score", _LABEL_SIZE, muted),
        Text(score_x, y + 40, score, _SCORE_SIZE, palette.TEXT, bold=0.4, role="score"),
        Text(label_x, bar.y - 15, threshold, _LABEL_SIZE, muted, "middle"),
        Path(bar.corners, Pen(fill=palette.PANEL_EDGE), closed=True),
        Path(reached.corners, Pen(fill=colour), closed=True),
        Path(needle, Pen(palette.TEXT, width=2.0)),
        Text(bar.x, bar.y + 24, "0", _LABEL_SIZE, muted),
        Text(bar.right, bar.y + 24, "100", _LABEL_SIZE, muted, "end"),
    ]


def facts(verification: Verification) -> list[list[tuple[str, str]]]:
    """Return the evidence for or against a match, and the transform of the probe where it is known.

    Facts are (label, value); unknown values are "-".
    """
    v = verification
    compared, transform = v.compared, v.transform
    ours, theirs = len(v.probe.minutiae), len(v.reference.minutiae)
    rate = odds(v.fmr) + (", extrapolated" if v.extrapolated else "")
    evidence = [("False match rate", rate)] if v.identical is None else []
    paired = f"{len(v.pairs)} (probe {ours}, reference {theirs})"
    evidence.append(("Minutiae paired", paired))
    moved: list[tuple[str, str]] = []
    if transform is not None:
        agreement, overlap = (
            f"{100 * share:.0f} %" if v.overlap else "-" for share in (v.agreement, v.overlap)
        )
        area = "" if compared is None else f", {compared.area_mm2:.0f} mm²"
        evidence += [("Agreement", agreement), ("Overlap", overlap + area)]
        if compared is not None and compared.ridge_agreement is not None:
            evidence.append(("Ridge agreement", f"{compared.ridge_agreement:.2f}"))
        rms_px = v.rms_px
        moved = [
            ("Rotation of probe", rotation_text(transform.rotation_deg)),
            ("Scale", f"{transform.scale:.3f}"),
            ("Shift x, y", f"{transform.tx:+.1f}, {transform.ty:+.1f} px"),
            ("Residual", f"{rms_px:.1f} px rms" if math.isfinite(rms_px) else "-"),
        ]
    return [[*evidence, ("Matcher", v.matcher)], moved]


def page(
    verification: Verification,
    caption: Group,
    shown: Iterable[Item],
    entries: Iterable[Entry],
    bottom: float,
    *panels: Box,
) -> Scene:
    """Compose a page: a `caption`, items in panels, each with a frame, a legend below `bottom`."""
    v, width = verification, caption.clip.width
    frames = [Path(box.grown(0.5).corners, FRAME_PEN, closed=True) for box in panels]
    x, y = MARGIN, bottom + 10 + _ROW / 2
    legend: list[Item] = []
    for meaning, sample in entries:
        needed = SAMPLE_WIDTH + 8 + text_width(meaning, LEGEND_SIZE)
        if x > MARGIN and x + needed > width - MARGIN:
            x, y = MARGIN, y + _ROW
        for shape in sample:
            if isinstance(shape, Circle):
                legend.append(shape._replace(centre=(x + shape.centre[0], y + shape.centre[1])))
            else:
                legend.append(shape._replace(points=tuple((x + a, y + b) for a, b in shape.points)))
        legend.append(Text(x + SAMPLE_WIDTH + 8, y + 5, meaning, LEGEND_SIZE, palette.TEXT))
        x += needed + _GAP
    height = math.ceil(y + _ROW / 2 + 12)
    below = Group(tuple(legend), Box(0, bottom, width, height - bottom), "legend")
    rate = f"false match rate {odds(v.fmr)}, " if v.identical is None else ""
    description = (
        f"{outcome(v)}: score {v.score:.1f}, threshold {v.threshold:.1f}, {rate}"
        f"{count(len(v.pairs), 'pair')} of minutiae"
    )
    items = caption, *frames, *shown, below
    return Scene(math.ceil(width), height, items, description)
