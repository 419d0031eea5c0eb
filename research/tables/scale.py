"""Tables of the page on galleries beyond one machine."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fpmatch.lab.evaluation.report.rate_text import percent
from research.markdown import markdown_table
from research.scale.constants import Constants
from research.scale.simulate import QUANTILES

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


def format_scale(results: Mapping[str, Any]) -> dict[str, str]:
    """Format the results of ``python -m research scale plan --json`` as Markdown tables by name."""
    plans = results["plans"]
    return {
        "constants": format_constants(Constants.from_dict(results["constants"])),
        "plans": _plans(plans),
        "simulation": _simulations(plans, results["loads"], results["losses"]),
        "limits": _limits(results["limits"]),
        "assumptions": _assumptions(results["assumptions"]),
    }


def format_constants(c: Constants) -> str:
    """Format measured constants."""
    d = c.delaunay_us
    rows = [["measured, one core", "processor time", "Delaunay calls"]]
    rows.append(["a Delaunay triangulation of 40 points", f"{d:.1f} µs", "1"])
    steps = {"enrolling a template": c.enrol_us, **_named(c.index_us, "index: ")}
    steps["index in all"] = c.rebuild_us
    rows += [[name, f"{us:.0f} µs", f"{us / d:.1f}"] for name, us in steps.items()]
    rows += [[f"a search of {n:,} prints", seconds(s), f"{s * 1e6 / d:,.0f}"] for n, s in c.search]
    sizes = [["a print", "bytes"]]
    sizes += [[name, f"{size:,.0f}"] for name, size in _named(c.index_bytes, "index: ").items()]
    sizes.append(["index in all", f"{c.print_bytes:,.0f}"])
    sizes.append(["database", f"{c.database_bytes:,.0f}"])
    return f"{markdown_table(rows)}\n\n{markdown_table(sizes)}"


def _named(values: Mapping[str, float], prefix: str) -> dict[str, float]:
    return {f"{prefix}{name}": value for name, value in values.items()}


def _plans(plans: Sequence[Mapping[str, Any]]) -> str:
    def row(name: str, form: str, key: str, unit: str = "") -> list[str]:
        return [name, *(f"{format(p[key], form)}{unit}" for p in plans)]

    rows = [
        ["prints", *(f"{p['prints']:,}" for p in plans)],
        row("searches a second (assumed)", ",.0f", "searches_s"),
        row("index in memory, one replica", ",.0f", "memory_gb", " GB"),
        row("database", ",.0f", "database_gb", " GB"),
        ["processor time of a search, unsharded", *(seconds(p["whole_s"]) for p in plans)],
        row("shards", ",", "shards"),
        row("replicas of each", ",", "replicas"),
        row("machines", ",", "machines"),
        row("processor time sharded / unsharded", ".2f", "fan_out"),
        ["time of a search, no queue", *(seconds(p["service_s"]) for p in plans)],
        ["utilisation", *(f"{p['utilisation']:.0%}" for p in plans)],
        row("enrolment, core-hours", ",.1f", "enrol_core_hours"),
        row("indexing, core-hours", ",.1f", "index_core_hours"),
        ["a shard: loaded from disk in", *(seconds(p["load_s"]) for p in plans)],
        ["a shard: copied from a replica in", *(seconds(p["copy_s"]) for p in plans)],
        ["a shard: rebuilt from the database in", *(seconds(p["rebuild_s"]) for p in plans)],
        row("price of a month", ",.0f", "month"),
        row("price of 1,000 searches", ".3f", "thousand_searches"),
    ]
    return markdown_table(rows)


def _simulations(
    plans: Sequence[Mapping[str, Any]],
    loads: Sequence[Sequence[Mapping[str, Any]]],
    losses: Sequence[Sequence[Mapping[str, Any]]],
) -> str:
    names = [f"{100 * q:.0f} %" for q in QUANTILES]
    load = [["prints", "searches a second", "utilisation", *names]]
    loss = [["prints", "replicas", "lost for", *(f"{n} before" for n in names[1:])]]
    loss[0] += [*(f"{n} meanwhile" for n in names[1:]), "answered without it"]
    for plan, load_rows, loss_rows in zip(plans, loads, losses, strict=True):
        prints = f"{plan['prints']:,}"
        for row in load_rows:
            rate = f"{row['factor'] * plan['searches_s']:,.0f}"
            load.append(
                [prints, rate, f"{row['utilisation']:.0%}", *map(seconds, row["quantiles_s"])]
            )
        for row in loss_rows:
            times = [*row["before_s"][1:], *row["meanwhile_s"][1:]]
            cells = [prints, str(row["replicas"]), seconds(row["down_s"]), *map(seconds, times)]
            loss.append([*cells, percent(row["partial"])])
    return f"{markdown_table(load)}\n\n{markdown_table(loss)}"


def _limits(rows: Sequence[tuple[float, str, str]]) -> str:
    table = [["reached at prints", "limit", "beyond it"]]
    table += [[_large(prints), what, then] for prints, what, then in rows]
    return markdown_table(table, left=3)


def _assumptions(values: Mapping[str, float]) -> str:
    table = [["assumed", "value"]]
    return markdown_table([*table, *([f"`{k}`", f"{v:g}"] for k, v in values.items())])


def _large(number: float) -> str:
    for size, name in ((1e9, "billion"), (1e6, "million")):
        if number >= size:
            return f"{number / size:,.1f} {name}"
    return f"{number:,.0f}"


def seconds(value: float) -> str:
    """Return a time in the unit that fits.

    Examples
    --------
    >>> seconds(0.0123), seconds(2.5), seconds(600), seconds(36000)
    ('12.3 ms', '2.50 s', '10.0 min', '10.0 h')
    """
    if value < 1.0:
        return f"{1e3 * value:.1f} ms"
    if value < 100.0:
        return f"{value:.2f} s"
    return f"{value / 60:.1f} min" if value < 6000.0 else f"{value / 3600:.1f} h"
