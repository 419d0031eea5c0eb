"""The legend below the prints: a sample of each ink, line and mark, and what it means."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Final, TypeAlias

from fpmatch.drawing.fonts import text_width
from fpmatch.drawing.overlay.caption import MARGIN
from fpmatch.drawing.overlay.marks import (
    PAIR_PEN,
    PROBE_PAIRED,
    PROBE_UNPAIRED,
    REFERENCE_PAIRED,
    REFERENCE_UNPAIRED,
    MarkStyle,
    mark,
)
from fpmatch.drawing.palette import (
    NEUTRAL_INK,
    PROBE_INK,
    PROBE_MARK,
    REFERENCE_INK,
    REFERENCE_MARK,
    TEXT,
    TEXT_MUTED,
    Colour,
    mixed,
)
from fpmatch.drawing.scene.items import Item, Path, Pen, Point, Text
from fpmatch.minutiae import MinutiaKind

_Entry: TypeAlias = tuple[str, Callable[[float, float], list[Item]]]

_SIZE: Final = 14.0
_ROW: Final = 30.0
_SAMPLE: Final = 34.0
_GAP: Final = 24.0
_RIGHT: Final[Point] = (1.0, 0.0)
PROBE_EDGE: Final = Pen(PROBE_MARK, width=1.6, opacity=0.85, dash=(9.0, 6.0))
REFERENCE_EDGE: Final = Pen(REFERENCE_MARK, width=1.6, opacity=0.85, dash=(2.0, 5.0))
BESIDE_REFERENCE_PAIRED: Final = replace(REFERENCE_PAIRED, radius=6.0, tick_px=10.0)
BESIDE_REFERENCE_UNPAIRED: Final = replace(REFERENCE_UNPAIRED, radius=4.5)
BESIDE_PROBE_PAIRED: Final = replace(
    BESIDE_REFERENCE_PAIRED, colour=PROBE_MARK, role="probe paired"
)
BESIDE_PROBE_UNPAIRED: Final = replace(
    BESIDE_REFERENCE_UNPAIRED, colour=PROBE_MARK, role="probe unpaired"
)


def overlay_legend(width: float, top: float) -> tuple[list[Item], float]:
    """Compose the legend of an overlay from `top` down; returns its items and its height."""
    both = mixed((PROBE_INK, REFERENCE_INK))
    return _rows(
        [
            ("reference ridges", partial(_ridges, ink=REFERENCE_INK)),
            ("probe ridges, moved", partial(_ridges, ink=PROBE_INK)),
            ("both together", partial(_ridges, ink=both)),
            ("paired minutiae", _pair),
            ("unpaired, of reference", partial(_mark, style=REFERENCE_UNPAIRED)),
            ("unpaired, of probe", partial(_mark, style=PROBE_UNPAIRED)),
            *_kinds(),
            ("edge of probe", partial(_edge, pen=PROBE_EDGE)),
            ("edge of reference", partial(_edge, pen=REFERENCE_EDGE)),
        ],
        width,
        top,
    )


def side_by_side_legend(width: float, top: float, *, paired: bool) -> tuple[list[Item], float]:
    """Compose the legend of two prints beside each other; returns its items and its height."""
    entries: list[_Entry] = [("ridges", partial(_ridges, ink=NEUTRAL_INK))]
    if paired:
        entries += [
            ("paired, numbered, joined", partial(_mark, style=BESIDE_PROBE_PAIRED)),
            ("unpaired", partial(_mark, style=BESIDE_PROBE_UNPAIRED)),
        ]
    return _rows([*entries, *_kinds()], width, top)


def _rows(entries: list[_Entry], width: float, top: float) -> tuple[list[Item], float]:
    items: list[Item] = []
    x, y = MARGIN, top + _ROW / 2
    for words, sample in entries:
        needs = _SAMPLE + 8 + text_width(words, _SIZE)
        if x > MARGIN and x + needs > width - MARGIN:
            x, y = MARGIN, y + _ROW
        items += sample(x, y)
        items.append(Text(x + _SAMPLE + 8, y + 5, words, _SIZE, TEXT))
        x += needs + _GAP
    return items, y + _ROW / 2 - top


def _ridges(x: float, y: float, ink: Colour) -> list[Item]:
    pen = Pen(ink, width=3.4)
    return [
        Path(((x + 2, y + rise), (x + _SAMPLE - 2, y + rise)), pen) for rise in (-6.5, 0.0, 6.5)
    ]


def _mark(
    x: float, y: float, style: MarkStyle, kind: MinutiaKind = MinutiaKind.ENDING
) -> list[Item]:
    return [*mark((x + 12, y), _RIGHT, kind, style)]


def _kinds() -> list[_Entry]:
    style = replace(BESIDE_REFERENCE_PAIRED, colour=TEXT_MUTED)
    return [
        ("ending, with direction", partial(_mark, style=style)),
        ("bifurcation", partial(_mark, style=style, kind=MinutiaKind.BIFURCATION)),
    ]


def _pair(x: float, y: float) -> list[Item]:
    reference, probe = (x + 9, y + 3), (x + 17, y - 3)
    return [
        *mark(reference, _RIGHT, MinutiaKind.ENDING, REFERENCE_PAIRED),
        *mark(probe, _RIGHT, MinutiaKind.ENDING, PROBE_PAIRED),
        Path((reference, probe), PAIR_PEN),
    ]


def _edge(x: float, y: float, pen: Pen) -> list[Item]:
    return [Path(((x, y), (x + _SAMPLE, y)), pen)]
