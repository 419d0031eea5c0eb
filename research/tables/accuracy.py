"""Tables of the page on accuracy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from fpmatch.errors import DatasetError
from fpmatch.lab.evaluation.report.rate_text import percent
from research.experiments.calibration_check import format_calibration
from research.experiments.distortion import KINDS
from research.experiments.minutiae_places import format_places
from research.experiments.outcomes import format_outcomes
from research.markdown import markdown_table
from research.wolves.table import format_wolves

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    Row = Mapping[str, Any]
    from collections.abc import Mapping

FORMS: Final = ("with ridges", "minutiae alone")
_RATES: Final = ("eer", "fmr100", "fmr1000", "zero_fmr")
_KEPT: Final = (
    "name", "genuine", "impostor", *_RATES, "fmr10000", "rank_one", "extract_ms", "match_us"
)  # fmt: skip
_ABLATED: Final = {
    "synthetic": "synthetic sets, each learned from the others",
    "checked": "FVC, learned from the synthetic sets",
    "checked, learned from the others": "FVC, each learned from the other FVC sets",
}


def error_rates_kept(evaluation: Row) -> dict[str, Any]:
    """Select what the page shows from the JSON of ``fpmatch evaluate --json``."""

    def kept(row: Row) -> dict[str, Any]:
        return {key: row[key] for key in _KEPT if key in row}

    sets = [kept(row) for row in evaluation["sets"]]
    return {"sets": sets, **{name: kept(evaluation[name]) for name in ("mean", "pooled")}}


def format_accuracy(results: Row) -> str:
    """Format the parts of ``PAGES["accuracy"]`` as Markdown tables."""
    return "\n\n".join(
        [
            "### Error rates",
            "Extended protocol, EER / FMR1000 in percent.",
            _rates_table(results),
            "### Minutiae by place",
            "Known minutiae, the share of them that is found, and the share of the extracted ones "
            "that is known, within 12 px and 22.5°; `research/benchmarks/minutiae_places.py` "
            "measures it. The known minutiae are the true ones of synthetic prints, and those that "
            "LEADER found in real ones.",
            format_places(results["places"]["rows"]),
            "### What each feature is worth",
            "Mean over the databases, then pooled; EER / FMR1000 in percent.",
            _feature_table(results["ablation"]),
            "### What each part of the matcher is worth",
            "Six FVC sets and two of FVC2000; EER / FMR1000 in percent, weights learned again for "
            "each row. The changes are differences from the base, in percentage points, with 95 % "
            "bootstrap intervals over fingers. The last column has the share of scores that stay "
            "identical with the weights of the base.",
            format_ablation(results["parts"]),
            "### Scores of impostors",
            format_calibration(results["calibration"]["sets"]),
            "### Fragments and wolves",
            "How many times the stated share of impostor comparisons reaches 20 / 30 / 40, and the "
            "share of unseen prints that the worst template matches at 40. Sizes are in minutiae, "
            "for crops and composed images in pixels. `python -m research measure wolves` measures "
            "it.",
            format_wolves(results["wolves"]["rows"]),
            "### Outcomes",
            "Percent of the pairs with each outcome at the default threshold: all pairs of whole "
            "prints; parts of prints with whole ones. `python -m research measure outcomes` "
            "measures it.",
            format_outcomes(results["outcomes"]["rows"]),
            "### Distortion",
            *_distortion_tables(results["distortion_before"], results["distortion"]),
        ]
    )


def format_databases(results: Row) -> str:
    """Return the rates of the default matcher by database, beside those of the paper's."""
    head = ["database", "EER", "FMR100", "FMR1000", "ZeroFMR", "extraction", "comparison"]
    body = []
    for row in results["learned"]["sets"]:
        times = [f"{row['extract_ms']:.0f} ms", f"{row['match_us']:.0f} µs"]
        body.append([row["name"], *(percent(row[rate]) for rate in _RATES), *times])
    for part, matcher in (("learned", "unit-circle"), ("paper", "paper")):
        for name in ("mean", "pooled"):
            row = results[part][name]
            cells = [f"{name}, `{matcher}`", *(percent(row[rate]) for rate in _RATES)]
            body.append([*(f"**{c}**" if part == "learned" else c for c in cells), "", ""])
    return markdown_table([head, *body])


def format_ablation(rows: Sequence[Row]) -> str:
    """Format the rows of ``research/benchmarks/ablation.py --json``, one table per form."""
    columns = ["mean EER / FMR1000", "pooled", "change of the mean EER"]
    columns += ["change of the mean FMR1000", "identical scores"]
    return "\n\n".join(
        markdown_table(
            [[form, *columns], *([row["name"], *_ablated_cells(row[form])] for row in rows)]
        )
        for form in FORMS
    )


def _ablated_cells(found: Row) -> list[str]:
    return [
        *(_both(found[k]["eer"], found[k]["fmr1000"], 100) for k in ("mean", "pooled")),
        *(_interval(found["change"][rate]) for rate in ("eer", "fmr1000")),
        f"{100 * found['identical']:.1f} %",
    ]


def _interval(change: Sequence[float] | None) -> str:
    """Return an interval of a difference, in percentage points."""
    return "–" if change is None else " to ".join(f"{100 * limit:+.2f}" for limit in change)


def _rates_table(results: Row) -> str:
    names = [row["name"] for row in results["learned"]["sets"]]
    body = []
    for title, part in (("learned enhancement (default)", "learned"), ("filters", "filters")):
        found = results[part]
        rows = [*found["sets"], found["mean"], found["pooled"]]
        body.append([title, *(_both(row["eer"], row["fmr1000"], 100) for row in rows)])
    return markdown_table([["", *names, "mean", "pooled"], *body])


def _feature_table(ablation: Row) -> str:
    columns = [key for key in _ABLATED if key in ablation["all"]]
    rows = [
        ["features", *(head for key in columns for head in (f"{_ABLATED[key]}: mean", "pooled"))]
    ]
    for name, row in ablation.items():
        kinds = [row[key][kind] for key in columns for kind in ("mean", "pooled")]
        rows.append([name, *(_both(kind["eer"], kind["fmr1000"]) for kind in kinds)])
    return markdown_table(rows)


def _distortion_tables(before: Row, now: Row) -> list[str]:
    """Return a description of the measurement, and the tables, each below its title."""
    fingers, turn, drag = now["fingers"], now["max_torsion_deg"], now["max_traction_px"]
    parts = [
        f"Genuine pairs of {fingers} synthetic fingers that are pressed with care, then turned by "
        f"up to {turn:g}° and dragged by up to {drag:g} pixels, in classes of their strain: the "
        "95th percentile, over the skin that both prints show, of the share by which a length is "
        "longer or shorter than under the nearest similarity transform. Displacement: the largest "
        "from that transform, in the median. Below threshold: the share of scores under 40. FNMR: "
        "at an FMR of 0.1 % of the impostor pairs of the same prints. "
        "`research/benchmarks/distortion.py` measures it; *before* is the matcher whose alignment "
        "was one similarity transform, bent smoothly."
    ]
    for pair in zip(before["conditions"], now["conditions"], strict=True):
        for kind, form in zip(KINDS, FORMS, strict=True):
            of = pair[0]
            parts += [
                f"{of['name'].capitalize()}, {of['minutiae']:g} minutiae in the median, {form}; "
                f"{of['genuine']:,} genuine and {of['impostor']:,} impostor pairs.",
                markdown_table(distortion_rows(pair, kind, ("before:", "now:"))),
            ]
    return parts


def _both(eer: float, fmr1000: float, factor: float = 1) -> str:
    return f"{factor * eer:.2f} / {factor * fmr1000:.2f}"


def strain_class(row: Mapping[str, Any]) -> str:
    """Name a class of strain in percent.

    Examples
    --------
    >>> strain_class({"from": 0.05, "to": 0.1}), strain_class({"from": 0.4, "to": None})
    ('5 to 10 %', '40 % or more')
    """
    if row["to"] is None:
        return f"{100 * row['from']:.0f} % or more"
    return f"{100 * row['from']:.0f} to {100 * row['to']:.0f} %"


def distortion_rows(
    conditions: Sequence[Mapping[str, Any]], kind: str, names: Sequence[str] = ("",)
) -> list[list[str]]:
    """Return one condition, measured once or several times, as rows of a table below a head."""
    columns = ("median score", "below threshold", "FNMR")
    head = ["strain", "displacement", "pairs"]
    head += [f"{name} {column}".strip() for column in columns for name in names]
    rows = [head]
    for same in zip(*(condition["classes"] for condition in conditions), strict=False):
        if len({(row["from"], row["pairs"], row["displacement_px"]) for row in same}) != 1:
            raise DatasetError("the measurements of distortion are not of the same pairs")
        cells = [
            strain_class(same[0]),
            f"{same[0]['displacement_px']:.1f} px",
            f"{same[0]['pairs']}",
        ]
        cells += [f"{row[kind]['score']:.1f}" for row in same]
        cells += [percent(row[kind]["below_threshold"]) for row in same]
        cells += [percent(row[kind]["fnmr"]) for row in same]
        rows.append(cells)
    return rows
