"""Tables of searches of large galleries: bytes, time, mates lost."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from fpmatch.lab.evaluation.report.rate_text import percent
from research.markdown import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

STAGES: Final = ("terms", "descriptors", "ridges", "comparison")
PASSED_ON: Final = ("by_terms", "by_descriptors", "by_ridges")


def format_searching(results: Mapping[str, Any]) -> str:
    """Format what ``research/benchmarks/large_galleries.py --json`` wrote as Markdown tables."""
    return "\n\n".join(
        [
            _speed(results),
            "### Rounds",
            _rounds(results),
            _bytes(results),
            "### Mates that a search loses",
            _loss(results),
            "### Mates behind a share of the prints",
            _behind(results),
            "### Against comparing all",
            _exact(results),
        ]
    )


def format_before(results: Mapping[str, Any]) -> str:
    """Format searches of an earlier version, without rounds, ridges and embeddings, and of this."""
    head = ["prints", "wanted loss", "threshold", "Delaunay calls before", "with a mate"]
    head += ["without a mate", "mates lost before", "now", "bytes a print before", "now"]
    earlier, today = results["before"], results["large"]
    now = {_searched(s): s for s in today["speed"]}
    rows = [
        [
            _prints(s),
            f"{s['plan']['loss']:.1%}",
            _threshold(s["threshold"]),
            f"{s['calls']:,.0f}",
            *(f"{one['calls']:,.0f}" for one in (of["mated"], of)),
            *(_lost(measured["loss"], _searched(s)) for measured in (earlier, today)),
            *(f"{sum(one['bytes'].values()):,.0f}" for one in (s, of)),
        ]
        for s in earlier["speed"]
        for of in [now[_searched(s)]]
    ]
    return markdown_table([head, *rows])


def _searched(row: Mapping[str, Any]) -> tuple[int, float, float]:
    """Return the prints, the wanted loss and the threshold of a search."""
    return row["prints"], row["plan"]["loss"], row["threshold"]


def _lost(rows: Sequence[Mapping[str, Any]], searched: tuple[int, float, float]) -> str:
    """Return the share of the mates of all databases that a search loses, if it was measured."""
    of = [r for r in rows if (r["gallery"], r["wanted"], r["threshold"]) == searched]
    every = sum(r["found"] for r in of)
    return percent(sum(r["found"] * r["lost"] for r in of) / every) if every else "-"


def _speed(results: Mapping[str, Any]) -> str:
    head = [
        *("prints", "wanted loss", "threshold", "passed on by the terms", "by the descriptors"),
        *("by the ridges", "a search with a mate, Delaunay calls", "time"),
        *("without a mate, calls", "time", "a print", *STAGES, "time to open"),
    ]
    rows = [
        [
            _prints(s),
            f"{s['plan']['loss']:.1%}",
            _threshold(s["threshold"]),
            *(f"{s['plan'][name]:,}" for name in PASSED_ON),
            *(text for one in (s["mated"], s) for text in _cost(one)),
            f"{s['us_a_print']:.2f} µs",
            *(f"{s['ms'][name]:.1f} ms" for name in STAGES),
            f"{s['open_s']:.2f} s",
        ]
        for s in results["speed"]
    ]
    return markdown_table([head, *rows])


def _cost(taken: Mapping[str, Any]) -> tuple[str, str]:
    """Return the cost of a search in calls of Delaunay, and in time."""
    return f"{taken['calls']:,.0f}", f"{sum(taken['ms'].values()):.0f} ms"


def _rounds(results: Mapping[str, Any]) -> str:
    head = ["prints", "wanted loss", "threshold", "round", "ends at a score of"]
    head += ["passed on by the terms", "by the descriptors", "by the ridges"]
    head += ["searches with a mate that it ends"]
    rows = [
        [
            _prints(s),
            f"{s['plan']['loss']:.1%}",
            _threshold(s["threshold"]),
            str(number),
            _threshold(one["score"] or 0.0),
            *(f"{one[name]:,}" for name in PASSED_ON),
            percent(ended / s["mated"]["searches"]),
        ]
        for s in results["speed"]
        for number, (one, ended) in enumerate(
            zip(s["mated"]["rounds"], s["mated"]["in_rounds"], strict=True), start=1
        )
    ]
    return markdown_table([head, *rows])


def _behind(results: Mapping[str, Any]) -> str:
    """Return how many of all mates that comparing all finds rank behind shares of the prints."""
    head = ["gallery", "wanted loss", "mates"]
    head += [f"{by}, {share}" for by in results["loss"][0]["behind"] for share in ("1%", "0.1%")]
    groups: dict[tuple[int, float], list[Any]] = {}
    for row in results["loss"]:
        if not row["threshold"]:
            groups.setdefault((row["gallery"], row["wanted"]), []).append(row)
    rows = []
    for (gallery, wanted), of in groups.items():
        mates = sum(r["found"] for r in of)
        behind = [sum(r["behind"][by][k] for r in of) for by in of[0]["behind"] for k in (0, 1)]
        # behind all: no search compared the ridges of more prints than it compared whole
        shares = (percent(n / mates) if n < mates else "-" for n in behind)
        rows.append([f"{gallery:,}", f"{wanted:.1%}", str(mates), *shares])
    return markdown_table([head, *rows])


def _prints(row: Mapping[str, Any]) -> str:
    """Return the size of a gallery, and how many of its prints are different."""
    repeated = row["different"] < row["prints"]
    return f"{row['prints']:,}" + (f" ({row['different']:,} different)" if repeated else "")


def _threshold(least: float) -> str:
    return f"{least:g}" if least else "-"


def _bytes(results: Mapping[str, Any]) -> str:
    rows = [["prints", "bytes a print", "terms", "descriptors", "compact template"]]
    for s in {s["prints"]: s for s in results["speed"]}.values():
        sizes = [s["bytes"][name] for name in ("terms", "descriptors", "templates")]
        rows.append([f"{s['prints']:,}", *(f"{n:,.0f}" for n in (sum(sizes), *sizes))])
    return markdown_table(rows)


def _loss(results: Mapping[str, Any]) -> str:
    head = ["mates of", "gallery", "wanted loss", "threshold", "mates"]
    head += [
        "found if all are compared, at most",
        "lost by the terms",
        "lost in all",
        "penetration of the terms that finds 99%",
    ]
    rows = [
        [
            r["prints"],
            f"{r['gallery']:,}",
            f"{r['wanted']:.1%}",
            _threshold(r["threshold"]),
            *(str(r[key]) for key in ("mates", "found")),
            *(percent(r[key]) for key in ("lost_by_terms", "lost", "penetration_for_99_percent")),
        ]
        for r in results["loss"]
    ]
    return markdown_table([head, *rows])


def _exact(results: Mapping[str, Any]) -> str:
    head = ["mates of", "gallery", "mates", "found if all are compared", "lost of them"]
    head += ["counted as found above", "lost of them"]
    rows = [
        [
            r["prints"],
            f"{r['gallery']:,}",
            str(r["mates"]),
            *(str(r["found"]), percent(r["lost"])),
            *(str(b["found"]), percent(b["lost"])),
        ]
        for r, b in zip(results["exact"], results["bound"], strict=True)
    ]
    return markdown_table([head, *rows])
