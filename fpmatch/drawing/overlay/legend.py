"""The legend below the prints: a sample of each ink, line and mark, and its meaning."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import pairwise
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
from fpmatch.drawing.scene.items import Box, Item, Path, Pen, Point, Text, mixed
from fpmatch.templates.minutiae import MinutiaKind

if TYPE_CHECKING:
    from fpmatch.drawing.scene.palette import Colour

_Entry: TypeAlias = tuple[str, Callable[[float, float], list[Item]]]

_SIZE, _ROW, _SAMPLE, _GAP = 14.0, 30.0, 34.0, 24.0
_RIGHT: Final[Point] = (1.0, 0.0)
_STEPS: Final = 64  # of the scale of colours
_AGREEMENTS: Final = (
    *((0.0, "0"), (0.2, "0.2: usual of different fingers")),
    *((0.6, "0.6"), (0.8, "0.8"), (1.0, "1: the ridges coincide")),
)


def overlay_legend(width: float, top: float, *, warped: bool = False) -> tuple[list[Item], float]:
    """Compose the legend of an overlay from `top` down; returns its items and its height."""
    both = mixed((palette.PROBE_INK, palette.REFERENCE_INK))
    probe = "probe ridges, warped" if warped else "probe ridges, moved"
    entries: list[_Entry] = [
        ("reference ridges", partial(_ridges, ink=palette.REFERENCE_INK)),
        (probe, partial(_ridges, ink=palette.PROBE_INK)),
        ("both together", partial(_ridges, ink=both)),
        ("paired minutiae", _pair),
        ("unpaired, of reference", partial(_mark, style=UNPAIRED["reference"])),
        ("unpaired, of probe", partial(_mark, style=UNPAIRED["probe"])),
        *_kinds(),
        ("edge of probe", partial(_edge, pen=EDGES["probe"])),
        ("edge of reference", partial(_edge, pen=EDGES["reference"])),
    ]
    return _rows(entries, width, top)


def side_by_side_legend(width: float, top: float, *, paired: bool) -> tuple[list[Item], float]:
    """Compose the legend of two prints beside each other; returns its items and its height."""
    entries: list[_Entry] = [("ridges", partial(_ridges, ink=palette.NEUTRAL_INK))]
    if paired:
        entries += [
            ("paired, numbered, joined", partial(_mark, style=BESIDE_PAIRED["probe"])),
            ("unpaired", partial(_mark, style=BESIDE_UNPAIRED["probe"])),
        ]
    return _rows([*entries, *_kinds()], width, top)


def ridge_legend(
    width: float, top: float, *, mean: float, area_mm2: float
) -> tuple[list[Item], float]:
    """Compose the scale of colours of the ridge agreement; returns its items and its height."""
    bar = Box(MARGIN + 70, top + 30, width - 2 * MARGIN - 140, 16)
    steps = [bar.x + bar.width * k / _STEPS for k in range(_STEPS + 1)]
    items: list[Item] = []
    for k, (left, right) in enumerate(pairwise(steps)):
        colour = palette.agreement((k + 0.5) / _STEPS)
        box = Box(left, bar.y, right - left, bar.height)
        items.append(Path(box.corners, Pen(colour, colour), closed=True))
    items.append(Path(bar.corners, Pen(palette.TEXT_MUTED), closed=True))
    above = f"agreement of the ridges of this comparison: {mean:.2f} on {area_mm2:.0f} mm²"
    items += _tick(bar, mean, above, bar.y - 12, palette.TEXT)
    for value, words in _AGREEMENTS:
        items += _tick(bar, value, words, bar.bottom + 22, palette.TEXT_MUTED)
    entries: list[_Entry] = [
        ("reference ridges", partial(_ridges, ink=palette.NEUTRAL_INK)),
        ("paired minutia of reference", partial(_mark, style=BESIDE_PAIRED["reference"])),
        ("not compared", partial(_not_compared)),
    ]
    rows, height = _rows(entries, width, bar.bottom + 32)
    return [*items, *rows], bar.bottom + 32 + height - top


def _not_compared(x: float, y: float) -> list[Item]:
    box = Box(x + 8, y - 8, 16, 16)
    return [Path(box.corners, Pen(palette.PANEL_EDGE, palette.PAPER), closed=True)]


def _tick(bar: Box, value: float, words: str, baseline: float, colour: Colour) -> list[Item]:
    """Mark a value of a scale of 0 to 1, with words above or below it."""
    x = bar.x + bar.width * min(max(value, 0.0), 1.0)
    half = text_width(words, _SIZE) / 2
    middle = min(max(x, MARGIN + half), bar.right + 70 - half)
    ends = (bar.y - 8, bar.bottom) if baseline < bar.y else (bar.y, bar.bottom + 6)
    line = Path(((x, ends[0]), (x, ends[1])), Pen(palette.TEXT, width=2.0))
    return [line, Text(middle, baseline, words, _SIZE, colour, "middle")]


def _rows(entries: list[_Entry], width: float, top: float) -> tuple[list[Item], float]:
    items: list[Item] = []
    x, y = MARGIN, top + _ROW / 2
    for meaning, sample in entries:
        needed = _SAMPLE + 8 + text_width(meaning, _SIZE)
        if x > MARGIN and x + needed > width - MARGIN:
            x, y = MARGIN, y + _ROW
        items += sample(x, y)
        items.append(Text(x + _SAMPLE + 8, y + 5, meaning, _SIZE, palette.TEXT))
        x += needed + _GAP
    return items, y + _ROW / 2 - top


def _ridges(x: float, y: float, ink: Colour) -> list[Item]:
    left, right, pen = x + 2, x + _SAMPLE - 2, Pen(ink, width=3.4)
    return [Path(((left, y + rise), (right, y + rise)), pen) for rise in (-6.5, 0.0, 6.5)]


def _mark(
    x: float, y: float, style: MarkStyle, kind: MinutiaKind = MinutiaKind.ENDING
) -> list[Item]:
    return [*mark((x + 12, y), _RIGHT, kind, style)]


def _kinds() -> list[_Entry]:
    style = replace(BESIDE_PAIRED["reference"], colour=palette.TEXT_MUTED)
    return [
        ("ending, with direction", partial(_mark, style=style)),
        ("bifurcation", partial(_mark, style=style, kind=MinutiaKind.BIFURCATION)),
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
