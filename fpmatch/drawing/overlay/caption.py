"""The band above the prints: decision, score on its scale, evidence, transform and reason."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from fpmatch.drawing.scene import palette
from fpmatch.drawing.scene.fonts import text_width, wrapped
from fpmatch.drawing.scene.items import Box, Group, Item, Path, Pen, Text
from fpmatch.printable import rotation_text
from fpmatch.prints.report import decision_in_words, odds

if TYPE_CHECKING:
    from fpmatch.matching.verification import Verification

Fact = tuple[str, str]  # a label and its value

MARGIN: Final = 24.0
_LEAST_PAGE_WIDTH: Final = 800.0
_BADGE_HEIGHT: Final = 44.0
_VERDICT_SIZE, _SCORE_SIZE, _VALUE_SIZE, _LABEL_SIZE, _REASON_SIZE = 24.0, 30.0, 17.0, 13.0, 17.0
_REASON_LINES: Final = 4
_FACT_GAP: Final = 26.0
_FACT_HEIGHT: Final = 46.0
_GAUGE_HEIGHT: Final = 8.0
_MAX_SCORE: Final = 100.0


def header(verification: Verification, panel: tuple[float, float]) -> tuple[Group, Box]:
    """Compose the band of a page with a panel of this width and height.

    Returns its items, whose clip is the band, and the place of the panel below it.
    """
    width = max(_LEAST_PAGE_WIDTH, panel[0] + 2 * MARGIN)
    y = MARGIN
    items = _first_row(verification, width, y)
    placed, y = _flow(facts(verification), width, y + _BADGE_HEIGHT + 16)
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
    band = Box(0, 0, width, y + 6)
    ground = Path(band.corners, Pen(fill=palette.BAND), closed=True)
    place = Box((width - panel[0]) // 2, math.ceil(band.bottom + 16), *panel)
    return Group((ground, *items), band, "caption"), place


def facts(verification: Verification) -> list[list[Fact]]:
    """Return the evidence for or against a match, and the transform of the probe where it is known.

    Facts are (label, value); unknown values are "-".
    """
    v, explained = verification, verification.evidence
    compared, transform = explained.compared, explained.transform
    ours, theirs = len(v.probe.minutiae), len(v.reference.minutiae)
    rate = odds(v.fmr) + (", extrapolated" if v.extrapolated else "")
    evidence = [("False match rate", rate)] if v.identical is None else []
    paired = f"{len(explained.pairs)} (probe {ours}, reference {theirs})"
    evidence.append(("Minutiae paired", paired))
    moved: list[Fact] = []
    if transform is not None:
        agreement, overlap = (
            f"{100 * share:.0f} %" if math.isfinite(share) else "-"
            for share in (explained.agreement, explained.overlap)
        )
        area = "" if compared is None else f", {compared.area_mm2:.0f} mm²"
        evidence += [("Agreement", agreement), ("Overlap", overlap + area)]
        if compared is not None and compared.ridge_agreement is not None:
            evidence.append(("Ridge agreement", f"{compared.ridge_agreement:.2f}"))
        rms_px = explained.rms_px
        moved = [
            ("Rotation of probe", rotation_text(transform.rotation_deg)),
            ("Scale", f"{transform.scale:.3f}"),
            ("Shift x, y", f"{transform.tx:+.1f}, {transform.ty:+.1f} px"),
            ("Residual", f"{rms_px:.1f} px rms" if math.isfinite(rms_px) else "-"),
        ]
    return [[*evidence, ("Matcher", v.matcher)], moved]


def _first_row(v: Verification, width: float, y: float) -> list[Item]:
    """Compose the decision, the score, and the score on its scale beside the threshold."""
    colour, muted = palette.DECISION[v.decision], palette.TEXT_MUTED
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


def _flow(rows: list[list[Fact]], width: float, y: float) -> tuple[list[Item], float]:
    """Place facts beside each other, a row of the page for each of `rows` unless all fit in one."""
    sized = [
        [(max(text_width(a, _LABEL_SIZE), text_width(b, _VALUE_SIZE)), a, b) for a, b in row]
        for row in rows
    ]
    everything = [fact for row in sized for fact in row]
    if sum(needed + _FACT_GAP for needed, *_ in everything) <= width - 2 * MARGIN:
        sized = [everything]
    items: list[Item] = []
    for row in filter(None, sized):
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
    return items, y
