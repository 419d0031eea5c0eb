"""The legend below the prints: a sample of each ink, line and mark, and its meaning.

The legend of the ridge agreement stands with its page, in `ridge_page`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Final, TypeAlias

from fpmatch.drawing.overlay.caption import MARGIN
from fpmatch.drawing.overlay.marks import (
    BESIDE_PAIRED,
    BESIDE_UNPAIRED,
    EDGES,
    PAIR_PEN,
    PAIRED,
    UNPAIRED,
    MarkStyle,
    mark,
)
from fpmatch.drawing.scene import palette
from fpmatch.drawing.scene.fonts import text_width
from fpmatch.drawing.scene.items import Item, Path, Pen, Point, Text, mixed
from fpmatch.templates.minutiae import MinutiaKind

if TYPE_CHECKING:
    from fpmatch.drawing.scene.palette import Colour

Entry: TypeAlias = tuple[str, Callable[[float, float], list[Item]]]

TEXT_SIZE, _ROW, _SAMPLE, _GAP = 14.0, 30.0, 34.0, 24.0
_RIGHT: Final[Point] = (1.0, 0.0)


def overlay_legend(width: float, top: float) -> tuple[list[Item], float]:
    """Compose the legend of an overlay from `top` down; returns its items and its height."""
    both = mixed((palette.PROBE_INK, palette.REFERENCE_INK))
    entries: list[Entry] = [
        ("reference ridges", partial(ridge_sample, ink=palette.REFERENCE_INK)),
        ("probe ridges, moved", partial(ridge_sample, ink=palette.PROBE_INK)),
        ("both together", partial(ridge_sample, ink=both)),
        ("paired minutiae", _pair),
        ("unpaired, of reference", partial(mark_sample, style=UNPAIRED["reference"])),
        ("unpaired, of probe", partial(mark_sample, style=UNPAIRED["probe"])),
        *_kinds(),
        ("edge of probe", partial(_edge, pen=EDGES["probe"])),
        ("edge of reference", partial(_edge, pen=EDGES["reference"])),
    ]
    return legend_rows(entries, width, top)


def side_by_side_legend(width: float, top: float, *, paired: bool) -> tuple[list[Item], float]:
    """Compose the legend of two prints beside each other; returns its items and its height."""
    entries: list[Entry] = [("ridges", partial(ridge_sample, ink=palette.NEUTRAL_INK))]
    if paired:
        entries += [
            ("paired, numbered, joined", partial(mark_sample, style=BESIDE_PAIRED["probe"])),
            ("unpaired", partial(mark_sample, style=BESIDE_UNPAIRED["probe"])),
        ]
    return legend_rows([*entries, *_kinds()], width, top)


def legend_rows(entries: list[Entry], width: float, top: float) -> tuple[list[Item], float]:
    """Place samples with their meanings in rows from `top` down; returns items and height."""
    items: list[Item] = []
    x, y = MARGIN, top + _ROW / 2
    for meaning, sample in entries:
        needed = _SAMPLE + 8 + text_width(meaning, TEXT_SIZE)
        if x > MARGIN and x + needed > width - MARGIN:
            x, y = MARGIN, y + _ROW
        items += sample(x, y)
        items.append(Text(x + _SAMPLE + 8, y + 5, meaning, TEXT_SIZE, palette.TEXT))
        x += needed + _GAP
    return items, y + _ROW / 2 - top


def ridge_sample(x: float, y: float, ink: Colour) -> list[Item]:
    """Draw three ridges in an ink."""
    left, right, pen = x + 2, x + _SAMPLE - 2, Pen(ink, width=3.4)
    return [Path(((left, y + rise), (right, y + rise)), pen) for rise in (-6.5, 0.0, 6.5)]


def mark_sample(
    x: float, y: float, style: MarkStyle, kind: MinutiaKind = MinutiaKind.ENDING
) -> list[Item]:
    """Draw a minutia."""
    return [*mark((x + 12, y), _RIGHT, kind, style)]


def _kinds() -> list[Entry]:
    style = replace(BESIDE_PAIRED["reference"], colour=palette.TEXT_MUTED)
    return [
        ("ending, with direction", partial(mark_sample, style=style)),
        ("bifurcation", partial(mark_sample, style=style, kind=MinutiaKind.BIFURCATION)),
    ]


def _pair(x: float, y: float) -> list[Item]:
    reference, probe = (x + 9, y + 3), (x + 17, y - 3)
    return [
        *mark(reference, _RIGHT, MinutiaKind.ENDING, PAIRED["reference"]),
        *mark(probe, _RIGHT, MinutiaKind.ENDING, PAIRED["probe"]),
        Path((reference, probe), PAIR_PEN),
    ]


def _edge(x: float, y: float, pen: Pen) -> list[Item]:
    return [Path(((x, y), (x + _SAMPLE, y)), pen)]
