"""Tables of the false match rates of fragments and adversarial templates."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from scipy.stats import poisson

from fpmatch.matching.calibration import score_to_fmr
from research.experiments.calibration_check import LARGEST_FACTOR
from research.markdown import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

LARGEST_SHARE: Final = 0.01
"""The largest share of unseen prints that one template may match."""

LEAST_SCORE: Final = 30.0  # at which templates that were searched for are held to the rates,
LARGEST_SEARCHED: Final = 3.0  # which they reach at most so many times as often
BY_CHANCE: Final = 0.025

WHOLE: Final = "whole print"
"""The kind of template that has no size."""

_NAMED: Final = ("kind", "size", "probes", "references")


def factors_kept(row: Mapping[str, Any]) -> bool:
    """Return whether impostors reach no score too often, see `is_beyond`."""
    return not any(is_beyond(row, at) for at in row["scores"])


def is_beyond(row: Mapping[str, Any], at: Mapping[str, Any]) -> bool:
    """Return whether impostors reach a score more than twice as often as stated.

    A template that was searched for is held to 30 and 40, and to three times, beyond what chance
    explains in the few comparisons of one template.
    """
    if not row["adversarial"]:
        return bool(at["factor"] > LARGEST_FACTOR)
    expected = LARGEST_SEARCHED * score_to_fmr(at["score"]) * row["impostors"]
    unlikely = poisson.sf(at["reached"] - 1, expected) < BY_CHANCE
    return bool(at["score"] >= LEAST_SCORE and unlikely)


def share_kept(row: Mapping[str, Any]) -> bool:
    """Return whether the worst template matches few enough unseen prints."""
    return bool(row["worst_share"] <= LARGEST_SHARE)


def format_wolves(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return a table in Markdown: a row a kind and size, two columns a pair of forms."""
    pairs = list(dict.fromkeys((row["probes"], row["references"]) for row in rows))
    lines = list(dict.fromkeys((row["kind"], row["size"]) for row in rows))
    found = {tuple(row[name] for name in _NAMED): row for row in rows}
    head = ["templates", "size"]
    for probes, references in pairs:
        head += [f"{probes}, against {references}", "worst"]
    cells = [head]
    for kind, size in lines:
        line = [kind, _size(size)]
        for pair in pairs:
            row = found.get((kind, size, *pair))
            line += ["", ""] if row is None or not row["impostors"] else _short(row)
        cells.append(line)
    return markdown_table(cells)


def _size(size: int) -> str:
    return str(size) if size else ""


def _short(row: Mapping[str, Any]) -> list[str]:
    """Return the ratios at the scores, and the share of unseen prints that the worst matches."""
    times = " / ".join(f"{at['factor']:.3g}" for at in row["scores"])
    return [times, f"{100 * row['worst_share']:.2f} %"]
