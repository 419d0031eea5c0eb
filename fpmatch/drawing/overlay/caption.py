"""The words and the legend that stand above and below the prints."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, TypeAlias

from fpmatch.drawing.fonts import text_width, wrapped
from fpmatch.drawing.palette import (
    BAND,
    MATCH,
    NO_MATCH,
    PANEL_EDGE,
    PAPER,
    TEXT,
    TEXT_MUTED,
)
from fpmatch.drawing.scene.items import Item, Path, Pen, Text
from fpmatch.drawing.words import odds, verdict

if TYPE_CHECKING:
    from fpmatch.matching.result import Verification

Fact: TypeAlias = tuple[str, str]
"""A label and its value."""

MARGIN: Final = 24.0
_BADGE_HEIGHT: Final = 44.0
_VERDICT_SIZE: Final = 24.0
_SCORE_SIZE: Final = 30.0
_VALUE_SIZE: Final = 17.0
_LABEL_SIZE: Final = 13.0
_REASON_SIZE: Final = 17.0
_REASON_LINES: Final = 4
_FACT_GAP: Final = 26.0
_FACT_HEIGHT: Final = 46.0
_GAUGE_HEIGHT: Final = 8.0
_MAX_SCORE: Final = 100.0


def evidence(verification: Verification) -> list[Fact]:
    """Return what speaks for or against a match, as (label, value)."""
    v = verification
    n_probe, n_reference = len(v.probe.minutiae), len(v.reference.minutiae)
    found = [
        ("False match rate", odds(v.fmr) + (", extrapolated" if v.extrapolated else "")),
        ("Minutiae paired", f"{len(v.pairs)} (probe {n_probe}, reference {n_reference})"),
    ]
    if v.transform is not None:
        found += [("Agreement", _percent(v.agreement)), ("Overlap", _overlap(v))]
        found += _ridges(v)
    return [*found, ("Matcher", v.matcher)]


def movement(verification: Verification) -> list[Fact]:
    """Return how the probe was moved, as (label, value); empty where no transform was found."""
    v = verification
    if v.transform is None:
        return []
    return [
        ("Rotation of probe", _turn(v.transform.rotation_deg)),
        ("Scale", f"{v.transform.scale:.3f}"),
        ("Shift x, y", f"{v.transform.tx:+.1f}, {v.transform.ty:+.1f} px"),
        ("Residual", f"{v.rms_px:.1f} px rms" if math.isfinite(v.rms_px) else "-"),
    ]


def _overlap(v: Verification) -> str:
    area = "" if v.compared is None else f", {v.compared.area_mm2:.0f} mm2"
    return f"{_percent(v.overlap)}{area}"


def _ridges(v: Verification) -> list[Fact]:
    if v.compared is None or v.compared.ridge_agreement is None:
        return []
    added = f"{v.compared.ridge_score:+.1f} of the score"
    return [("Ridge agreement", f"{v.compared.ridge_agreement:.2f}, {added}")]


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if math.isfinite(share) else "-"


def _turn(degrees: float) -> str:
    """Put a rotation of the image, whose y points down, in words."""
    if abs(degrees) < 0.05:
        return "0.0°"
    return f"{abs(degrees):.1f}° {'clockwise' if degrees > 0 else 'counter-clockwise'}"


def header(verification: Verification, width: float) -> tuple[list[Item], float]:
    """Compose the band above the prints.

    Parameters
    ----------
    verification : Verification
        What it says.
    width : float
        Width of the page in pixels.

    Returns
    -------
    items : list of Item
        Placed from the page's top-left corner.
    height : float
        Height of the band in pixels.
    """
    items: list[Item] = []
    y = MARGIN
    items += _first_row(verification, width, y)
    y += _BADGE_HEIGHT + 16
    placed, y = _flow([evidence(verification), movement(verification)], width, y)
    items += placed
    if verification.reason:
        y += 4
        lines = wrapped(f"Why: {verification.reason}", _REASON_SIZE, width - 2 * MARGIN)
        if len(lines) > _REASON_LINES:
            lines = [*lines[: _REASON_LINES - 1], lines[_REASON_LINES - 1] + " …"]
        colour = TEXT if verification.match else NO_MATCH
        for line in lines:
            y += _REASON_SIZE + 2
            items.append(Text(MARGIN, y, line, _REASON_SIZE, colour, role="reason"))
            y += 4
        y += 6
    y += 6
    return [_rectangle(0, 0, width, y, Pen(fill=BAND)), *items], y


def _first_row(verification: Verification, width: float, y: float) -> list[Item]:
    """Compose verdict, score, and the score on its scale beside the threshold."""
    v = verification
    colour = MATCH if v.match else NO_MATCH
    words = verdict(v)
    badge_width = text_width(words, _VERDICT_SIZE) + 40
    score = f"{v.score:.1f}"
    score_x = MARGIN + badge_width + 24
    score_width = max(text_width(score, _SCORE_SIZE), text_width("Score", _LABEL_SIZE))
    gauge_x = score_x + score_width + 32
    return [
        _rectangle(MARGIN, y, badge_width, _BADGE_HEIGHT, Pen(fill=colour)),
        Text(
            MARGIN + badge_width / 2,
            y + 31,
            words,
            _VERDICT_SIZE,
            PAPER,
            "middle",
            0.5,
            role="verdict",
        ),
        Text(score_x, y + 10, "Score", _LABEL_SIZE, TEXT_MUTED),
        Text(score_x, y + 40, score, _SCORE_SIZE, TEXT, bold=0.4, role="score"),
        *_gauge(v, gauge_x, y, width - MARGIN - gauge_x),
    ]


def _gauge(verification: Verification, x: float, y: float, width: float) -> list[Item]:
    v = verification
    reached = x + width * _share_of_scale(v.score)
    asked = x + width * _share_of_scale(v.threshold)
    words = f"threshold {v.threshold:.1f}"
    half = text_width(words, _LABEL_SIZE) / 2
    bar = y + 25
    colour = MATCH if v.match else NO_MATCH
    return [
        Text(
            min(max(asked, x + half), x + width - half),
            y + 10,
            words,
            _LABEL_SIZE,
            TEXT_MUTED,
            "middle",
        ),
        _rectangle(x, bar, width, _GAUGE_HEIGHT, Pen(fill=PANEL_EDGE)),
        _rectangle(x, bar, reached - x, _GAUGE_HEIGHT, Pen(fill=colour)),
        Path(((asked, bar - 9), (asked, bar + _GAUGE_HEIGHT + 4)), Pen(TEXT, width=2.0)),
        Text(x, bar + 24, "0", _LABEL_SIZE, TEXT_MUTED),
        Text(x + width, bar + 24, "100", _LABEL_SIZE, TEXT_MUTED, "end"),
    ]


def _share_of_scale(score: float) -> float:
    return min(max(score / _MAX_SCORE, 0.0), 1.0) if math.isfinite(score) else 0.0


def _flow(rows: list[list[Fact]], width: float, y: float) -> tuple[list[Item], float]:
    """Set labelled values side by side; rows stay apart unless all fit in one."""
    everything = [fact for row in rows for fact in row]
    if sum(_fact_width(fact) + _FACT_GAP for fact in everything) <= width - 2 * MARGIN:
        rows = [everything]
    items: list[Item] = []
    for row in filter(None, rows):
        x = MARGIN
        for label, value in row:
            needs = _fact_width((label, value))
            if x > MARGIN and x + needs > width - MARGIN:
                x, y = MARGIN, y + _FACT_HEIGHT
            items += [
                Text(x, y + 13, label, _LABEL_SIZE, TEXT_MUTED),
                Text(x, y + 33, value, _VALUE_SIZE, TEXT, role="fact"),
            ]
            x += needs + _FACT_GAP
        y += _FACT_HEIGHT
    return items, y


def _fact_width(fact: Fact) -> float:
    label, value = fact
    return max(text_width(label, _LABEL_SIZE), text_width(value, _VALUE_SIZE))


def _rectangle(x: float, y: float, width: float, height: float, pen: Pen) -> Path:
    right, bottom = x + width, y + height
    return Path(((x, y), (right, y), (right, bottom), (x, bottom)), pen, closed=True)
