"""The tables of two prints joined into one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from research.markdown import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

_FORMS: Final = ("ridges", "alone")
_SHARES: Final = {  # columns: of comparisons with one print of each finger, or with several
    "match": "match both",
    "any": "match both, any of up to seven impressions",
    "most": "the same, of the database with the most",
    "noticed": "noticed",
    "unnoticed": "match both, not noticed",
}
_MEDIA: Final = {  # whether images were joined, whether of templates without an image
    "templates of images": (False, False),
    "synthetic templates": (False, True),
    "images": (True, False),
}


def joined_kept(measured: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the page shows: means over databases, in per cent, and the false alarms."""
    rows = []
    for medium, (images, synthetic) in _MEDIA.items():
        of_medium = [
            row
            for row in measured["joined"]
            if (row["images"], row["synthetic"]) == (images, synthetic)
        ]
        for kind in dict.fromkeys(row["kind"] for row in of_medium):
            of_kind = [row for row in of_medium if row["kind"] == kind]
            shares = {name: [_share(of_kind, form, name) for form in _FORMS] for name in _SHARES}
            rows.append({"medium": medium, "kind": kind, **shares})
    return {"rows": rows, "ordinary": measured["ordinary"]}


def format_joined(kept: Mapping[str, Any]) -> str:
    """Return what joined prints match, and false alarms, as Markdown."""
    head = ["joined as", "how", *_SHARES.values()]
    rows = [
        [row["medium"], row["kind"], *(_both(row[name]) for name in _SHARES)]
        for row in kept["rows"]
    ]
    return "\n\n".join(
        [
            "In per cent, with ridges / as minutiae alone; each database counts the same.",
            markdown_table([head, *rows]),
            markdown_table(_false_alarms(kept["ordinary"])),
        ]
    )


def _both(shares: Sequence[int | None]) -> str:
    return "" if None in shares else " / ".join(map(str, shares))


def _share(rows: Sequence[Mapping[str, Any]], form: str, name: str) -> int | None:
    """Return the mean over databases, or the most of any, in per cent; None where none has it."""
    key = "any" if name == "most" else name
    values = [100 * row[key] for row in rows if row["form"] == form and row[key] is not None]
    if not values:
        return None
    percent: float = max(values) if name == "most" else sum(values) / len(values)
    return round(percent)


def _false_alarms(ordinary: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    rows = [["ordinary prints", "prints", "noticed, with ridges", "as minutiae alone"]]
    numbers = ("prints", *_FORMS)
    rows += [[one["source"], *(f"{one[name]:,}" for name in numbers)] for one in ordinary]
    totals = [sum(one[name] for one in ordinary) for name in numbers]
    return [*rows, ["all", *(f"{total:,}" for total in totals)]]
