"""Tables of how often pairs of different fingers reach the highest scores."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from fpmatch.matching.calibration import fmr_to_score, load_calibration
from fpmatch.matching.registry import DEFAULT_MATCHER
from research.markdown import markdown_table
from research.training.tail import kinds_of, similarity_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fpmatch.matching.calibration import Calibration
    from research.training.tail import ImpostorKind

SCORES: Final = (40, 45, 50, 55, 60, 65, 70)
GALLERIES: Final = (10_000, 100_000, 1_000_000)
STATED: Final = (1.0, 0.1)  # different fingers of a search that score as high by chance


def format_tail(results: Mapping[str, Any]) -> str:
    """Format the pairs at each score, and what a search states beside what is observed."""
    kinds, calibration = kinds_of(results), load_calibration(DEFAULT_MATCHER)
    rows = [["pairs of different fingers", "pairs", *(f"at {score}" for score in SCORES)]]
    for kind in kinds:
        cells = [_times(kind, calibration, score) for score in SCORES]
        rows.append([kind.name, f"{kind.pairs:,}", *cells])
    searches = [["gallery", "by chance", "score", *(kind.name for kind in kinds)]]
    for size in GALLERIES:
        for stated in STATED:
            score = fmr_to_score(stated / size)
            observed = [_observed(kind, calibration, score, size) for kind in kinds]
            searches.append([f"{size:,}", f"{stated:g}", f"{score:.0f}", *observed])
    return f"{markdown_table(rows)}\n\n{markdown_table(searches)}"


def _times(kind: ImpostorKind, calibration: Calibration, score: float) -> str:
    """Return how many times the stated share of pairs reaches a score, and how many do."""
    at = similarity_of(calibration, score)
    return f"{kind.fmr(at) * 10 ** (score / 10):.2f} ({kind.above(at):,})"


def _observed(kind: ImpostorKind, calibration: Calibration, score: float, size: int) -> str:
    """Return how many fingers of a gallery reach a score: of those that no pair does, at most."""
    at = similarity_of(calibration, score)
    if kind.above(at):
        return f"{kind.fmr(at) * size:.2g}"
    return f"< {3.0 / kind.pairs / kind.compares(at) * size:.2g}"
