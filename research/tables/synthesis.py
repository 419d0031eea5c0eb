"""Tables of the page on synthetic prints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from fpmatch.lab.evaluation.report.rate_text import percent
from research.experiments.image_statistics import EXTREMES, format_statistics
from research.experiments.template_statistics import RATES
from research.experiments.template_statistics import TITLES as TEMPLATE_TITLES
from research.experiments.two_sample import format_accuracies
from research.markdown import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

MAIN_DISTANCE_PX: Final = 12.0  # of the tolerance that is shown


def preset_rows(evaluation: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the rows of the page from ``fpmatch evaluate --ground-truth --json``."""
    rows = []
    for row, measured in zip(evaluation["sets"], evaluation["ground_truth"]["sets"], strict=True):
        agreement = next(a for a in measured["agreement"] if a["distance_px"] == MAIN_DISTANCE_PX)
        rows.append(
            {
                "name": row["name"],
                "eer": row["eer"],
                "prints": measured["prints"],
                **{key: agreement[key] for key in ("precision", "recall", "f1")},
                **{key: measured["transforms"][key] for key in ("judged", "match", "in_place")},
            }
        )
    return rows


def format_synthesis(results: Mapping[str, Any]) -> str:
    """Return the tables in Markdown: statistics of the images, and error rates of the presets."""
    return "\n\n".join(
        [
            "### Statistics of the images",
            "Median, and in brackets the range from 5 to 95 in 100.",
            format_statistics(results["prints"]),
            *_two_sample(results["prints"]),
            "### Presets",
            _presets_table(results["presets"]),
        ]
    )


def _two_sample(prints: Mapping[str, Any]) -> list[str]:
    """Return the table of the two-sample test, with its title, where it was measured."""
    if not all("two_sample" in one for one in prints["sets"]):
        return []
    return ["### Two-sample test", format_accuracies(prints["sets"])]


def _presets_table(rows: Sequence[Mapping[str, Any]]) -> str:
    head = ["", "prints", "precision", "recall", "F1", "genuine judged", "MATCH", "in place", "EER"]
    body = [
        [
            row["name"],
            str(row["prints"]),
            *(f"{row[key]:.3f}" for key in ("precision", "recall", "f1")),
            str(row["judged"]),
            *(f"{100 * row[key]:.1f} %" for key in ("match", "in_place")),
            f"{100 * row['eer']:.2f} %",
        ]
        for row in rows
    ]
    return markdown_table([head, *body])


def format_templates(results: Mapping[str, Any]) -> str:
    """Return the tables in Markdown: minutiae and mates, then non-mates."""
    groups = results["groups"]
    rows = [["", *(group["name"] for group in groups)]]
    rows.append(["prints", *(str(group["prints"]) for group in groups)])
    for name, (title, digits) in TEMPLATE_TITLES.items():
        cells = []
        for group in groups:
            found = group["quantiles"].get(name)
            low, middle, high = (found[k] for k in EXTREMES) if found else (0.0, 0.0, 0.0)
            shown = f"{middle:.{digits}f} ({low:.{digits}f}–{high:.{digits}f})"
            cells.append(shown if found else "-")
        rows.append([title, *cells])
    return f"{markdown_table(rows)}\n\n{_non_mates(results)}"


def _non_mates(results: Mapping[str, Any]) -> str:
    head = ["real probes with prints that are", "pairs"]
    head += ["similarity, median", "99 %", "99.9 %", "prefilter, median", "99 %", "99.9 %"]
    head += [f"FMR where that of real ones is {percent(rate)}" for rate in RATES]
    rows = [head]
    for r in results["non_mates"]:
        scores = [f"{r[name][k]:.2f}" for name in ("similarity", "prefilter") for k in (0, 2, 3)]
        rates = [f"{100 * rate:.3f} %" for rate in r["fmr"]]
        rows.append([r["gallery"], f"{r['pairs']:,}", *scores, *rates])
    return markdown_table(rows)
