"""Tables of the page on identification: open-set rates, several fingers, the tail of impostors."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any, Final

from fpmatch.gallery.index.loss import DEFAULT_LOSS
from fpmatch.lab.evaluation.open_set.rates import IdentificationPoint
from fpmatch.lab.evaluation.open_set.report import stated_table
from fpmatch.lab.evaluation.rates.intervals import ExactBound, Interval
from fpmatch.lab.evaluation.report.rate_text import bounds_note, limits, percent
from fpmatch.matching.calibration import fmr_to_score, load_calibration
from fpmatch.matching.registry import DEFAULT_MATCHER
from fpmatch.printable import count
from research.markdown import markdown_table
from research.training.tail import kinds_of, similarity_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from fpmatch.matching.calibration import Calibration
    from research.training.tail import ImpostorKind


SEARCHED: Final = {
    "alone": "",
    "background": "in a background of 10,000 fingers",
    "hundred_thousand": "in a background of 131,072 fingers",
    "million": "in a background of a million fingers",
    "million_careful": "in a background of a million fingers, with a loss of .1 %",
    "rolled_hundred_thousand": "of rolled prints, in a background of 131,072 fingers",
    "rolled_million": "of rolled prints, in a background of a million fingers",
}
"""The parts of the page: which prints are searched for, and where."""


_KEPT: Final = ("fingers", "enrolled", "background", "preselected", "loss")


def tests_kept(document: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return what the page shows of ``fpmatch evaluate-identification --json``."""
    return [
        {
            **{
                key: test[key]
                for key in ("fingers", "enrolled", "background", "preselected", "loss")
            },
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
    """Format kept tests as Markdown: all databases of each, single databases, and predictions."""
    tests = [(part, test) for part in SEARCHED for test in results.get(part, ())]
    points = tests[0][1]["pooled"]["fnir_at_fpir"]
    fpirs = [f"FPIR {100 * point['fpir']:.6g} %" for point in points]
    rows = [["FNIR at", "rank 1", *fpirs, f"95 % interval at {fpirs[-1]}"]]
    predictions, bounds = [], []
    for part, test in tests:
        pooled = test["pooled"]
        last, bound = (pooled["fnir_at_fpir"][-1][key] for key in ("interval", "bound"))
        bounds.append(bound and ExactBound(**bound))
        rows.append(
            [
                _gallery(part, test),
                percent(pooled["rank"]["1"]),
                *(percent(point["fnir"]) for point in pooled["fnir_at_fpir"]),
                limits(None if last is None else Interval(*last), bounds[-1]),
            ]
        )
        head, cells = stated_table(fpirs[-1], [_point(pooled["fnir_at_fpir"][-1])])
        predictions.append((_gallery(part, test), *cells[1:]))
    shown = [markdown_table(rows), bounds_note(bounds), _by_database(tests, fpirs[-1])]
    return "\n\n".join(filter(None, [*shown, markdown_table([head, *predictions])]))


def _gallery(part: str, test: Mapping[str, Any]) -> str:
    """Return what is searched for, and in what gallery."""
    kind = "rolled, " if part.startswith("rolled") else ""
    low, high = test["enrolled"]
    enrolled = f"{high:,}" if low == high else f"{low:,} to {high:,}"
    loss = test.get("loss") or DEFAULT_LOSS
    careful = f", loss {100 * loss:g} %" if loss < DEFAULT_LOSS else ""
    return f"{kind}{count(test['fingers'], 'finger')}, {enrolled} subjects{careful}"


def _by_database(tests: Sequence[tuple[str, Mapping[str, Any]]], fpir: str) -> str:
    """Format the FNIR of each database of flat prints at the highest FPIR, in each gallery."""
    flat = [(part, test) for part, test in tests if not part.startswith("rolled")]
    rows = [[f"FNIR at {fpir}", *(_gallery(*one) for one in flat)]]
    for sets in zip(*(test["sets"] for _, test in flat), strict=True):
        fnirs = (percent(row["fnir_at_fpir"][-1]["fnir"]) for row in sets)
        rows.append([sets[0]["name"], *fnirs])
    return markdown_table(rows)


def _point(kept: Mapping[str, Any]) -> IdentificationPoint:
    return IdentificationPoint(**{f.name: kept[f.name] for f in fields(IdentificationPoint)})


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
