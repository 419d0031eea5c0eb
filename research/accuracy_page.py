"""What was measured of the default matcher's accuracy, as the tables of the documentation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from research.ablation_table import format_ablation
from research.distortion import KINDS, distortion_rows
from research.markdown import calibration_table, markdown_table
from research.minutiae_places import format_places
from research.wolf_table import format_wolves

if TYPE_CHECKING:
    from collections.abc import Mapping

PARTS: Final = (
    "learned", "filters", "paper", "ablation", "parts", "calibration", "wolves", "distortion",
    "places",
)  # fmt: skip
"""What the results hold: error rates with either enhancement, of the paper's matcher, without each
feature, without each part of the matcher, and of scores; false match rates of fragments and of
templates made to match; genuine scores against elastic distortion; and how many minutiae are found
where in a print."""
_RATES: Final = ("eer", "fmr100", "fmr1000", "zero_fmr")
_KEPT: Final = (
    "name", "genuine", "impostor", *_RATES, "fmr10000", "rank_one", "extract_ms", "match_us"
)  # fmt: skip
_ROWS: Final = {
    "synthetic": "synthetic sets, each learned from the others",
    "checked": "FVC, learned from the synthetic sets",
    "checked, learned from the others": "FVC, each learned from the other FVC sets",
}


def error_rates_kept(evaluation: Mapping[str, Any]) -> dict[str, Any]:
    """Take from what ``fpmatch evaluate --json`` prints what the page shows.

    Parameters
    ----------
    evaluation : mapping
        The parsed JSON.

    Returns
    -------
    dict
        ``"sets"``, a row a database, ``"mean"`` and ``"pooled"``.
    """

    def kept(row: Mapping[str, Any]) -> dict[str, Any]:
        return {key: row[key] for key in _KEPT if key in row}

    sets = [kept(row) for row in evaluation["sets"]]
    return {
        "sets": sets,
        "mean": kept(evaluation["mean"]),
        "pooled": kept(evaluation["pooled"]),
    }


def format_accuracy_markdown(
    results: Mapping[str, Any], distortion_before: Mapping[str, Any]
) -> str:
    """Return the tables of the page.

    Parameters
    ----------
    results : mapping
        An entry for each of `PARTS`.
    distortion_before : mapping
        What ``benchmarks/distortion.py --json`` wrote of the matcher of an earlier version.

    Returns
    -------
    str
        Markdown: error rates, what each feature is worth, the calibration, fragments and wolves,
        and the distortion.
    """
    return "\n\n".join(
        [
            "### Error rates",
            "Extended protocol, EER / FMR1000 in percent.",
            _rates_table(results),
            "### Minutiae by place",
            "Known minutiae, the share of them that is found, and the share of the extracted ones "
            "that is known, within 12 px and 22.5°; `benchmarks/minutiae_places.py` measures it. "
            "Known are the true minutiae of synthetic prints, and what LEADER found in real ones.",
            format_places(results["places"]["rows"]),
            "### What each feature is worth",
            "Mean over the databases, then pooled; EER / FMR1000 in percent.",
            _ablation_table(results["ablation"]),
            "### What each part of the matcher is worth",
            "Six FVC sets and two of FVC2000; EER / FMR1000 in percent, each row learned anew. The "
            "changes are differences from the base, in percentage points, with 95 % bootstrap "
            "intervals over fingers. Identical are scores under the weights of the base.",
            format_ablation(results["parts"]),
            "### Scores of impostors",
            calibration_table(results["calibration"]["sets"], digits=4),
            "### Fragments and wolves",
            "How many times the stated share of impostor comparisons reaches 20 / 30 / 40, and the "
            "share of unseen prints that the worst template matches at 40. Sizes are minutiae, of "
            "crops and composed images pixels. `benchmarks/wolves.py` measures it.",
            format_wolves(results["wolves"]["rows"]),
            "### Distortion",
            *_distortion_tables(distortion_before, results["distortion"]),
        ]
    )


def format_databases_markdown(results: Mapping[str, Any]) -> str:
    """Return the rates of the default matcher by database, beside those of the paper's.

    Parameters
    ----------
    results : mapping
        An entry for each of `PARTS`.

    Returns
    -------
    str
        Markdown; rates in percent, with the median times of an image and of a comparison.
    """
    head = ["database", "EER", "FMR100", "FMR1000", "ZeroFMR", "extraction", "comparison"]
    body = []
    for row in results["learned"]["sets"]:
        times = [f"{row['extract_ms']:.0f} ms", f"{row['match_us']:.0f} µs"]
        body.append([row["name"], *_percent(row), *times])
    for part, matcher in (("learned", "unit-circle"), ("paper", "paper")):
        for name in ("mean", "pooled"):
            cells = [f"{name}, `{matcher}`", *_percent(results[part][name])]
            default = part == "learned"
            body.append([*(f"**{cell}**" if default else cell for cell in cells), "", ""])
    return markdown_table([head, *body])


def _percent(row: Mapping[str, Any]) -> list[str]:
    return [f"{100 * row[name]:.2f} %" for name in _RATES]


def _rates_table(results: Mapping[str, Any]) -> str:
    names = [row["name"] for row in results["learned"]["sets"]]
    body = []
    for title, part in (("learned enhancement (default)", "learned"), ("filters", "filters")):
        found = results[part]
        rows = [*found["sets"], found["mean"], found["pooled"]]
        body.append([title, *(_both(100 * row["eer"], 100 * row["fmr1000"]) for row in rows)])
    return markdown_table([["", *names, "mean", "pooled"], *body])


def _ablation_table(ablation: Mapping[str, Any]) -> str:
    columns = [key for key in _ROWS if key in ablation["all"]]
    body = []
    for name, row in ablation.items():
        cells = [name]
        for key in columns:
            mean, pooled = row[key]["mean"], row[key]["pooled"]
            cells += [
                _both(mean["eer"], mean["fmr1000"]),
                _both(pooled["eer"], pooled["fmr1000"]),
            ]
        body.append(cells)
    head = ["features"]
    for key in columns:
        head += [f"{_ROWS[key]}: mean", "pooled"]
    return markdown_table([head, *body])


def _distortion_tables(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """Return what is measured and how, and the tables, each below its title."""
    fingers, turn, drag = now["fingers"], now["max_torsion_deg"], now["max_traction_px"]
    parts = [
        f"Genuine pairs of {fingers} synthetic fingers that are pressed with care, then turned by "
        f"up to {turn:g}° and dragged by up to {drag:g} pixels, in classes of their strain: the "
        "95th percentile, over the skin that both prints show, of the share by which a length is "
        "longer or shorter than under the nearest similarity transform. Displacement: the largest "
        "from that transform, in the median. Below threshold: the share of scores under 40. FNMR: "
        "at an FMR of 0.1 % of the impostor pairs of the same prints. `benchmarks/distortion.py` "
        "measures it; *before* is the matcher whose alignment was one similarity transform, bent "
        "smoothly."
    ]
    for pair in zip(before["conditions"], now["conditions"], strict=True):
        for kind, title in zip(KINDS, ("with ridges", "minutiae alone"), strict=True):
            of = pair[0]
            parts += [
                f"{of['name'].capitalize()}, {of['minutiae']:g} minutiae in the median, {title}; "
                f"{of['genuine']:,} genuine and {of['impostor']:,} impostor pairs.",
                markdown_table(distortion_rows(pair, kind, ("before:", "now:"))),
            ]
    return parts


def _both(eer: float, fmr1000: float) -> str:
    return f"{eer:.2f} / {fmr1000:.2f}"
