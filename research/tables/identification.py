"""Tables of the page on identification: FNIR by FPIR and rank, for one finger and two."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

from fpmatch.lab.evaluation.open_set.rates import IdentificationPoint
from fpmatch.lab.evaluation.open_set.report import prediction_table
from fpmatch.lab.evaluation.rates.intervals import ExactBound, Interval
from fpmatch.lab.evaluation.report.rate_text import bounds_note, limits, percent
from fpmatch.printable import count
from research.markdown import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


def tests_kept(document: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return what the page shows of ``fpmatch evaluate-identification --json``."""
    return [
        {
            **{key: test[key] for key in ("fingers", "enrolled", "background", "preselected")},
            "sets": [_rates_kept(row) for row in test["sets"]],
            "pooled": _rates_kept({"name": "pooled", **test["pooled"]}),
        }
        for test in document["tests"]
    ]


def _rates_kept(row: Mapping[str, Any]) -> dict[str, Any]:
    kept = {key: row[key] for key in ("name", "mated", "nonmated", "fnir_at_fpir")}
    return kept | {
        "rank": {str(rank): row["fnir_at_rank"][rank - 1] for rank in (1, 10)},
        "rank_one_interval": row["rank_intervals"][0],
    }


def format_identification(results: Mapping[str, Sequence[Mapping[str, Any]]]) -> str:
    """Format kept tests as Markdown: alone, and in backgrounds."""
    parts = ("alone", "background", "million")
    tests = [test for part in parts for test in results.get(part, ())]
    return "\n\n".join(
        f"{_caption(test)}\n\n{_rates(test)}\n\n{_predictions(test['pooled'])}" for test in tests
    )


def _caption(test: Mapping[str, Any]) -> str:
    low, high = test["enrolled"]
    enrolled = f"{high:,}" if low == high else f"{low:,} to {high:,}"
    of = f", {test['background']:,} of them synthetic" if test["background"] else ""
    return f"**{count(test['fingers'], 'finger')}**, {enrolled} subjects in the gallery{of}:"


def _rates(test: Mapping[str, Any]) -> str:
    points = test["pooled"]["fnir_at_fpir"]
    fpirs = [f"FPIR {100 * point['fpir']:.6g} %" for point in points]
    head = ["FNIR at", "rank 1", *fpirs, f"95 % interval at {fpirs[-1]}"]
    rows, bounds = [], []
    for row in (*test["sets"], test["pooled"]):
        last, bound = (row["fnir_at_fpir"][-1][key] for key in ("interval", "bound"))
        bounds.append(bound and ExactBound(**bound))
        rows.append(
            [
                row["name"],
                percent(row["rank"]["1"]),
                *(percent(point["fnir"]) for point in row["fnir_at_fpir"]),
                limits(None if last is None else Interval(*last), bounds[-1]),
            ]
        )
    return "\n\n".join(filter(None, [markdown_table([head, *rows]), bounds_note(bounds)]))


def _predictions(pooled: Mapping[str, Any]) -> str:
    names = [field.name for field in fields(IdentificationPoint)]
    points = [
        IdentificationPoint(**{name: point[name] for name in names})
        for point in pooled["fnir_at_fpir"]
    ]
    return markdown_table(prediction_table("all databases", points))


def format_fusion(results: Sequence[Mapping[str, Any]]) -> str:
    """Format what ``python -m research measure fused-fingers --json`` wrote as a Markdown table."""
    head = ["measured rate / stated rate", *(f"score {s:g}" for s in results[0]["scores"])]
    rows = []
    for one in results:
        pairs = f"{one['pairs']:,} pairs"
        of = "neighbouring" if one["apart"] == 1 else f"{one['apart']} apart"
        rows.append([f"two fingers, {of}, {pairs}", *(f"{r:.2f}" for r in one["two_fingers"])])
        rows.append([f"the first of them, {of}", *(f"{r:.2f}" for r in one["one_finger"])])
    largest = max(one["rank_correlation"] for one in results)
    text = f"The rank correlation of both scores is at most {largest:.2f} in a database."
    return f"{markdown_table([head, *rows])}\n\n{text}"
