"""The band above the prints: decision, score on its scale, evidence, transform and reason."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from fpmatch.drawing.scene import palette
from fpmatch.drawing.scene.fonts import text_width, wrapped
from fpmatch.drawing.scene.items import Box, Item, Path, Pen, Text
from fpmatch.printable import rotation_text
from fpmatch.prints.report import decision_in_words, odds

if TYPE_CHECKING:
    from fpmatch.drawing.scene.palette import Colour
    from fpmatch.matching.verification import Verification

Fact = tuple[str, str]  # a label and its value

MARGIN: Final = 24.0
_BADGE_HEIGHT: Final = 44.0
_VERDICT_SIZE, _SCORE_SIZE, _VALUE_SIZE, _LABEL_SIZE, _REASON_SIZE = 24.0, 30.0, 17.0, 13.0, 17.0
_REASON_LINES: Final = 4
_FACT_GAP: Final = 26.0
_FACT_HEIGHT: Final = 46.0
_GAUGE_HEIGHT: Final = 8.0
_MAX_SCORE: Final = 100.0


def evidence(verification: Verification) -> list[Fact]:
    """Return the evidence for or against a match, as (label, value)."""
    v = verification
    ours, theirs = len(v.probe.minutiae), len(v.reference.minutiae)
    compared = v.compared
    rate = odds(v.fmr) + (", extrapolated" if v.extrapolated else "")
    facts = [
        *([("False match rate", rate)] if v.identical is None else []),
        ("Minutiae paired", f"{len(v.pairs)} (probe {ours}, reference {theirs})"),
    ]
    if v.transform is not None:
        area = "" if compared is None else f", {compared.area_mm2:.0f} mm²"
        overlap = _percent(v.overlap) + area
        facts += [("Agreement", _percent(v.agreement)), ("Overlap", overlap)]
        if compared is not None and compared.ridge_agreement is not None:
            facts.append(("Ridge agreement", f"{compared.ridge_agreement:.2f}"))
    return [*facts, ("Matcher", v.matcher)]


def transform_facts(verification: Verification) -> list[Fact]:
    """Return the transform of the probe as (label, value); none without it."""
    transform, rms_px = verification.transform, verification.rms_px
    if transform is None:
        return []
    return [
        ("Rotation of probe", rotation_text(transform.rotation_deg)),
        ("Scale", f"{transform.scale:.3f}"),
        ("Shift x, y", f"{transform.tx:+.1f}, {transform.ty:+.1f} px"),
        ("Residual", f"{rms_px:.1f} px rms" if math.isfinite(rms_px) else "-"),
    ]


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if math.isfinite(share) else "-"


def header(verification: Verification, width: float) -> tuple[list[Item], float]:
    """Compose the band for a page of `width`; returns its items, and its height in pixels."""
    y = MARGIN
    items = _first_row(verification, width, y)
    y += _BADGE_HEIGHT + 16
    placed, y = _flow([evidence(verification), transform_facts(verification)], width, y)
    items += placed
    if verification.reason:
        y += 4
        label = "Why" if verification.shortage is None else "Missing"
        lines = wrapped(f"{label}: {verification.reason}", _REASON_SIZE, width - 2 * MARGIN)
        if len(lines) > _REASON_LINES:
            lines = [*lines[: _REASON_LINES - 1], lines[_REASON_LINES - 1] + " …"]
        colour = palette.DECISION[verification.decision]
        for line in lines:
            y += _REASON_SIZE + 2
            items.append(Text(MARGIN, y, line, _REASON_SIZE, colour, role="reason"))
            y += 4
        y += 6
    y += 6
    return [_filled(Box(0, 0, width, y), palette.BAND), *items], y


def _filled(box: Box, colour: Colour) -> Path:
    return Path(box.corners, Pen(fill=colour), closed=True)


def _first_row(verification: Verification, width: float, y: float) -> list[Item]:
    """Compose the decision, the score, and the score on its scale beside the threshold."""
    v = verification
    colour = palette.DECISION[v.decision]
    decision, score = decision_in_words(v), f"{v.score:.1f}"
    badge = Box(MARGIN, y, text_width(decision, _VERDICT_SIZE) + 40, _BADGE_HEIGHT)
    middle = MARGIN + badge.width / 2
    score_x = badge.right + 24
    score_width = max(text_width(score, _SCORE_SIZE), text_width("Score", _LABEL_SIZE))
    gauge_x = score_x + score_width + 32
    gauge = Box(gauge_x, y + 25, width - MARGIN - gauge_x, _GAUGE_HEIGHT)
    return [
        _filled(badge, colour),
        Text(middle, y + 31, decision, _VERDICT_SIZE, palette.PAPER, "middle", 0.5, role="verdict"),
        Text(score_x, y + 10, "Score", _LABEL_SIZE, palette.TEXT_MUTED),
        Text(score_x, y + 40, score, _SCORE_SIZE, palette.TEXT, bold=0.4, role="score"),
        *_gauge(v, gauge, colour),
    ]


def _gauge(v: Verification, bar: Box, colour: Colour) -> list[Item]:
    score, threshold = (
        bar.x + bar.width * (min(max(value / _MAX_SCORE, 0), 1) if math.isfinite(value) else 0)
        for value in (v.score, v.threshold)
    )
    label = f"threshold {v.threshold:.1f}"
    half = text_width(label, _LABEL_SIZE) / 2
    label_x = min(max(threshold, bar.x + half), bar.right - half)
    return [
        Text(label_x, bar.y - 15, label, _LABEL_SIZE, palette.TEXT_MUTED, "middle"),
        _filled(bar, palette.PANEL_EDGE),
        _filled(Box(bar.x, bar.y, score - bar.x, bar.height), colour),
        Path(((threshold, bar.y - 9), (threshold, bar.bottom + 4)), Pen(palette.TEXT, width=2.0)),
        Text(bar.x, bar.y + 24, "0", _LABEL_SIZE, palette.TEXT_MUTED),
        Text(bar.right, bar.y + 24, "100", _LABEL_SIZE, palette.TEXT_MUTED, "end"),
    ]


def _flow(rows: list[list[Fact]], width: float, y: float) -> tuple[list[Item], float]:
    """Place facts beside each other, a row of the page for each of `rows` unless all fit in one."""
    everything = [fact for row in rows for fact in row]
    if sum(_fact_width(fact) + _FACT_GAP for fact in everything) <= width - 2 * MARGIN:
        rows = [everything]
    items: list[Item] = []
    for row in filter(None, rows):
        x = MARGIN
        for label, value in row:
            needed = _fact_width((label, value))
            if x > MARGIN and x + needed > width - MARGIN:
                x, y = MARGIN, y + _FACT_HEIGHT
            items += [
                Text(x, y + 13, label, _LABEL_SIZE, palette.TEXT_MUTED),
                Text(x, y + 33, value, _VALUE_SIZE, palette.TEXT, role="fact"),
            ]
            x += needed + _FACT_GAP
        y += _FACT_HEIGHT
    return items, y


def _fact_width(fact: Fact) -> float:
    label, value = fact
    return max(text_width(label, _LABEL_SIZE), text_width(value, _VALUE_SIZE))
