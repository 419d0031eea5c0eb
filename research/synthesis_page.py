"""What was measured on synthetic prints, as the tables of the documentation."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

from fpmatch.errors import DatasetError
from research.image_statistics_table import TITLES
from research.markdown import markdown_table

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

PARTS: Final = ("prints", "presets")
"""What the results hold: figures of prints, and of each preset."""
MAIN_DISTANCE_PX: Final = 12.0  # of the tolerance that is shown
_EXTREMES: Final = (0, 2, 4)  # of a figure's quantiles: 5, 50 and 95 %


def read_synthesis_results(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read what was measured.

    Parameters
    ----------
    path : path
        A JSON file with an entry for each of `PARTS`.

    Returns
    -------
    dict
        Its content.

    Raises
    ------
    DatasetError
        If it cannot be read or lacks a part.
    """
    try:
        with open(path, encoding="utf-8") as file:  # noqa: PTH123 (any path-like)
            results = json.load(file)
    except OSError as error:
        raise DatasetError(f"{path}: cannot be read: {(error.strerror or '').lower()}") from error
    except ValueError as error:
        raise DatasetError(f"{path}: not a JSON file") from error
    missing = [p for p in PARTS if not isinstance(results, dict) or p not in results]
    if missing:
        raise DatasetError(f"{path}: lacks {', '.join(missing)}")
    return dict(results)


def preset_rows(evaluation: dict[str, Any]) -> list[dict[str, Any]]:
    """Take from what ``fpmatch evaluate --minutiae --json`` prints what the page shows.

    Parameters
    ----------
    evaluation : dict
        The parsed JSON; one database a preset.

    Returns
    -------
    list of dict
        One for each database, in order.
    """
    rows = []
    for row, measured in zip(evaluation["sets"], evaluation["minutiae"]["sets"], strict=True):
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


def format_synthesis_markdown(results: dict[str, Any]) -> str:
    """Return the tables of the page.

    Parameters
    ----------
    results : dict
        As `read_synthesis_results` returns it.

    Returns
    -------
    str
        Markdown: figures of prints and of presets, each under its heading.
    """
    return "\n\n".join(
        [
            "### Figures of prints",
            "Median, and in brackets the range from 5 to 95 in 100.",
            _prints_table(results["prints"]),
            "### Presets",
            _presets_table(results["presets"]),
        ]
    )


def _prints_table(prints: dict[str, Any]) -> str:
    head = ["", "prints", *(title for title, _ in TITLES.values())]
    rows = [_figures(s) for s in (*prints["sets"], *prints["against"])]
    mean = [
        sum(s["outside"][figure] for s in prints["sets"]) / len(prints["sets"]) for figure in TITLES
    ]
    outside = [f"{100 * share:.0f} %" for share in mean]
    rows.append(["*synthetic ones outside the others' span*", "", *outside])
    return markdown_table([head, *rows])


def _figures(entry: dict[str, Any]) -> list[str]:
    cells = [entry["name"], str(entry["prints"])]
    for figure, (_, digits) in TITLES.items():
        low, middle, high = (entry["quantiles"][figure][k] for k in _EXTREMES)
        cells.append(f"{middle:.{digits}f} ({low:.{digits}f}–{high:.{digits}f})")
    return cells


def _presets_table(rows: Sequence[dict[str, Any]]) -> str:
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
