"""Tables of the page on point sets: choices that the paper leaves open."""

from __future__ import annotations

from statistics import median
from typing import TYPE_CHECKING, Any, Final

from fpmatch.pointset.paper.matcher import DEFAULT_AREA_TOLERANCE
from research.markdown import markdown_table
from research.points.conditions import TARGET_FACTORS
from research.points.summary import geometric_mean

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    import numpy as np
    from numpy.typing import NDArray

    Row = Mapping[str, Any]

RHOS: Final = (0.5, 0.6, 0.7, 0.9)
PARTS: Final = ("decision", "area", "rule", "exit")
"""The marks on the page, each with its tables."""


def count_accepted(
    name: str, similarity: NDArray[np.float64], genuine: NDArray[np.bool_]
) -> dict[str, Any]:
    """Count the pairs of a database that match, genuine and impostor, for each ρ of `RHOS`."""
    return {
        "name": name,
        "genuine": int(genuine.sum()),
        "impostor": int((~genuine).sum()),
        "accepted": [
            [int((similarity[kind] > rho).sum()) for kind in (genuine, ~genuine)] for rho in RHOS
        ],
    }


def format_paper_choices(results: Mapping[str, Any]) -> dict[str, str]:
    """Return the tables of each of `PARTS`, in Markdown, of what ``paper-choices`` measured."""
    return {
        "decision": _decision(results["prints"]),
        "area": "\n\n".join([_area_on_prints(results["prints"]), _area(results["paper"])]),
        "rule": _rule(results["paper"]),
        "exit": _exit(results["exits"]),
    }


def _decision(prints: Sequence[Row]) -> str:
    """Return the shares accepted at the default area tolerance, by database."""
    (found,) = (row for row in prints if row["area_tolerance"] == DEFAULT_AREA_TOLERANCE)
    head = ["", *(f"ρ = {rho:g}: {kind}" for rho in RHOS for kind in ("genuine", "impostor"))]
    body = [[row["name"], *_accepted(row)] for row in (*found["sets"], _together(found["sets"]))]
    return markdown_table([head, *body])


def _area_on_prints(prints: Sequence[Row]) -> str:
    head = ["area tolerance", *_shares_at(0.6), *_shares_at(0.9), "ms per comparison"]
    body = []
    for row in prints:
        accepted = _accepted(_together(row["sets"]))
        shown = [accepted[2 * RHOS.index(rho) + kind] for rho in (0.6, 0.9) for kind in (0, 1)]
        body.append([f"{row['area_tolerance']:g}", *shown, f"{row['ms']:.2f}"])
    return markdown_table([head, *body])


def _shares_at(rho: float) -> list[str]:
    return [f"ρ = {rho:g}: genuine", f"ρ = {rho:g}: impostor"]


def _together(sets: Sequence[Row]) -> dict[str, Any]:
    return {
        "name": "all",
        "genuine": sum(row["genuine"] for row in sets),
        "impostor": sum(row["impostor"] for row in sets),
        "accepted": [
            [sum(pair[kind] for pair in each) for kind in (0, 1)]
            for each in zip(*(row["accepted"] for row in sets), strict=True)
        ],
    }


def _accepted(row: Row) -> list[str]:
    pairs = row["genuine"], row["impostor"]
    return [
        f"{100 * count / total:.{digits}f} %"
        for each in row["accepted"]
        for count, total, digits in zip(each, pairs, (1, 2), strict=True)
    ]


def _groups(rows: Sequence[Row]) -> list[tuple[str, float, list[Row]]]:
    """Return model, ρ and rows of each group of conditions."""
    keys = dict.fromkeys((row["model"], row["rho"]) for row in rows)
    return [(*key, [r for r in rows if (r["model"], r["rho"]) == key]) for key in keys]


def _area(rows: Sequence[Row]) -> str:
    """Return similar ring pairs, speed-up and true positives of each area tolerance."""
    head = ["model", "rho", "area tolerance", "similar ring pairs", "speed-up", "TP"]
    base = {_condition(r): r["median_ms"] for r in rows if r["area_tolerance"] == 0.1}
    body = []
    for model, rho, group in _groups(rows):
        for area in dict.fromkeys(row["area_tolerance"] for row in group):
            own = [row for row in group if row["area_tolerance"] == area]
            passing = [100 * row["passing"] for row in own]
            faster = [base[_condition(row)] / row["median_ms"] for row in own]
            body.append(
                [
                    *(model, f"{rho:g}", f"{area:g}"),
                    f"{min(passing):.1f} to {max(passing):.1f} %",
                    f"{geometric_mean(faster):.1f} ({min(faster):.1f} to {max(faster):.1f})",
                    _share(own, "true_positives"),
                ]
            )
    return markdown_table([head, *body])


def _rule(rows: Sequence[Row]) -> str:
    """Return the decisions by the paper's rule and by two other rules."""
    head = ["model", "rho"]
    for rule in ("more than ρ", "ρ or more", "80 % of ⌈ρm⌉"):
        head += [f"{rule}: TP", f"{rule}: FP"]
    keys = (
        "true_positives",
        "false_positives",
        "true_positives_at_rho",
        "false_positives_at_rho",
        "true_positives_80",
        "false_positives_80",
    )
    usual = [row for row in rows if row["area_tolerance"] == DEFAULT_AREA_TOLERANCE]
    body = [
        [model, f"{rho:g}", *(_share(group, key) for key in keys)]
        for model, rho, group in _groups(usual)
    ]
    return markdown_table([head, *body, ["all", "", *(_share(usual, key) for key in keys)]])


def _exit(rows: Sequence[Row]) -> str:
    """Return true positives and times by the largest number of proposals."""
    head = [
        "proposals per point of Q, at most",
        *(f"patch, {name}: TP" for name, _ in _KINDS),
        *(f"clutter, n = {factor}m: TP" for factor in TARGET_FACTORS),
        *(f"patch, {name}: independent / genuine time" for name, _ in _KINDS),
        "patch: slower than the paper's method",
    ]
    usual = {_condition(row): row for row in rows if not row["proposals_per_point"]}
    body = []
    for each in dict.fromkeys(row["proposals_per_point"] for row in rows):
        own = [row for row in rows if row["proposals_per_point"] == each]
        patch = [row for row in own if row["model"] == "patch"]
        kinds = [[row for row in patch if row["rho"] in rhos] for _, rhos in _KINDS]
        clutter = [
            [r for r in own if r["model"] == "clutter" and r["n"] == factor * r["m"]]
            for factor in TARGET_FACTORS
        ]
        ratios = [
            _range([row["independent_ms"] / usual[_condition(row)]["median_ms"] for row in kind])
            for kind in kinds
        ]
        slower = sum(row["independent_ms"] > row["paper_ms"] for row in patch)
        body.append(
            [
                f"{each}" if each else "the default",
                *(_share(group, "true_positives") for group in (*kinds, *clutter)),
                *ratios,
                f"{slower} of {len(patch)}",
            ]
        )
    slowest = [
        f"{_range([r['longest_ms'] / r['median_ms'] for r in usual.values() if _is(r, rhos)])} "
        f"({name})"
        for name, rhos in _KINDS
    ]
    trials = sorted({row["trials"] for row in rows})
    return (
        f"{markdown_table([head, *body])}\n\n"
        f"In the patch cells the slowest of {' or '.join(map(str, trials))} genuine pairs takes "
        f"{' and '.join(slowest)} times as long as the median one."
    )


_KINDS: Final = (("ρ ≥ 0.9", (0.9, 0.95)), ("ρ = 0.6", (0.6,)))


def _is(row: Row, rhos: tuple[float, ...]) -> bool:
    return row["model"] == "patch" and row["rho"] in rhos


def _range(values: Sequence[float]) -> str:
    """Return the median, and in brackets the smallest and the largest."""
    return f"{median(values):.1f} ({min(values):.1f} to {max(values):.1f})" if values else "-"


def _condition(row: Row) -> tuple[Any, ...]:
    return row["model"], row["rho"], row["m"], row["n"]


def _share(rows: Iterable[Row], key: str) -> str:
    counted = list(rows)
    return f"{sum(r[key] for r in counted):,}/{sum(r['trials'] for r in counted):,}"
