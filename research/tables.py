"""The tables of the documentation, made of the results of measurements in ``docs/data``.

`BLOCKS` lists the blocks of pages, `PARTS` the results that they show and what measures them.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import click

from fpmatch.lab.evaluation.report.results import percent
from research.commands import PATH, ROOT, Command, read_json, write_json
from research.markdown import markdown_table, marked_block, write_marked_block
from research.points.conditions import PAPER_ROWS, TARGET_FACTORS
from research.points.matchers import MATCHERS
from research.points.random_sets import POINT_MODELS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    Row = Mapping[str, Any]
    Rows = Sequence[Row]

DATA: Final = ROOT / "docs" / "data"
RATES: Final = ("eer", "fmr100", "fmr1000", "zero_fmr")
FORMS: Final = ("with ridges", "minutiae alone")
RHOS: Final = (0.5, 0.6, 0.7, 0.9)
PUBLISHED: Final = {  # beside a matcher of point sets: the paper's table and its column
    "triangles": ("Table 2", "unit_circle_s"),
    "paper": ("Table 2", "unit_circle_s"),
    "van-wamelen": ("Table 1", "van_wamelen_s"),
}
_EDGES: Final = (100.0, 10.0, 0.1)  # milliseconds below which a time has one decimal more
_STAGES: Final = {
    "extraction": "Stages of an extraction, 388 × 374 pixels at 500 dpi",
    "matching": "Before and after it",
    "process": "One `fpmatch verify` of two images",
}


def rates_kept(evaluation: Row) -> dict[str, Any]:
    """Select what the pages show from the JSON of ``fpmatch evaluate --json``."""
    shown = ("name", *RATES)

    def kept(row: Row) -> dict[str, Any]:
        return {key: row[key] for key in shown if key in row}

    sets = [kept(row) for row in evaluation["sets"]]
    return {"sets": sets, **{name: kept(evaluation[name]) for name in ("mean", "pooled")}}


def format_databases(results: Row) -> str:
    """Return the rates of the default matcher by database, beside those of the paper's."""
    head = ["database", "EER", "FMR100", "FMR1000", "ZeroFMR"]
    body = []
    for row in results["learned"]["sets"]:
        body.append([row["name"], *(percent(row[rate]) for rate in RATES)])
    for part, matcher in (("learned", "unit-circle"), ("paper", "paper")):
        for name in ("mean", "pooled"):
            row = results[part][name]
            cells = [f"{name}, `{matcher}`", *(percent(row[rate]) for rate in RATES)]
            body.append([*(f"**{c}**" if part == "learned" else c for c in cells)])
    return markdown_table([head, *body])


def format_worth(results: Row) -> str:
    """Return what the network and the parts of the matcher are worth: EER / FMR1000 in percent."""
    enhancement = [["enhancement", "mean EER / FMR1000", "pooled"]]
    for title, part in (("the network (default)", "learned"), ("filters", "filters")):
        enhancement.append([title, *(_both(results[part][name]) for name in ("mean", "pooled"))])
    return f"{markdown_table(enhancement)}\n\n{format_ablation(results['parts'])}"


def format_features(rows: Rows) -> str:
    """Return what features and bounds are worth: rates in percent, losses in percentage points."""
    head = ["score"]
    for form in FORMS:
        head += [f"{form}: EER / FMR1000", "d'", "largest loss"]
    body = []
    for row in rows:
        cells = [row["name"]]
        for form in FORMS:
            own, lost = row[form], row[form]["lost"]
            losses = f"{100 * lost['eer']:+.2f} / {100 * lost['fmr1000']:+.2f}"
            cells += [_both(own), f"{own['d_prime']:.2f}", losses]
        body.append(cells)
    return markdown_table([head, *body])


def format_ablation(rows: Rows) -> str:
    """Return the rows that the ablation of commit f3b85a33 measured."""
    head = ["matcher", *(f"{form}: {name}" for form in FORMS for name in ("mean", "pooled"))]
    head.append(f"change of the mean EER, {FORMS[0]}")
    body = []
    for row in rows:
        change = row[FORMS[0]]["change"]
        cells = [_both(row[form][name]) for form in FORMS for name in ("mean", "pooled")]
        between = " to ".join(f"{100 * limit:+.2f}" for limit in change) if change else "–"
        body.append([row["name"], *cells, between])
    return markdown_table([head, *body])


def _both(row: Row) -> str:
    return f"{100 * row['eer']:.2f} / {100 * row['fmr1000']:.2f}"


def format_points(results: Row) -> str:
    """Return times and answers by matcher and model, beside the paper's times.

    "-" stands where no cell was run.
    """
    cells = {
        (one["model"], one["matcher"], one["row"], one["factor"]): one for one in results["cells"]
    }
    tables = []
    for model in POINT_MODELS:
        for matcher in [name for name in MATCHERS if {key[:2] for key in cells} & {(model, name)}]:
            source, column = PUBLISHED[matcher]
            head = ["m", "rho"]
            for factor in TARGET_FACTORS:
                head += [f"n = {factor}m: {name}" for name in ("mean, ms", "paper", "TP", "FP")]
            body = []
            for index, row in enumerate(PAPER_ROWS):
                line = [str(row.m), f"{row.rho:g}"]
                of_row = [cells.get((model, matcher, index, factor)) for factor in TARGET_FACTORS]
                for cell, seconds in zip(of_row, getattr(row, column), strict=True):
                    line += _cell(cell, seconds)
                if any(of_row):
                    body.append(line)
            title = f"### {matcher}, {model} model, beside the paper's {source}"
            tables.append(f"{title}\n\n{markdown_table([head, *body], left=0)}")
    return "\n\n".join(tables)


def _cell(cell: Row | None, paper_s: float) -> list[str]:
    if cell is None:
        return ["-", format_ms(1e3 * paper_s), "-", "-"]
    return [
        format_ms(cell["mean_ms"]),
        format_ms(1e3 * paper_s),
        f"{cell['true_positives']}/{cell['trials']}",
        f"{cell['false_positives']}/{cell['independent_trials']}",
    ]


def format_ms(milliseconds: float) -> str:
    """Return a time in milliseconds with about three digits, without its unit.

    Examples
    --------
    >>> [format_ms(time) for time in (0.62, 9.996, 99.96, 1000)]
    ['0.62', '10.0', '100', '1000']
    """
    decimals = sum(float(f"{milliseconds:.3g}") < edge for edge in _EDGES)
    return f"{milliseconds:.{decimals}f}"


def format_decision(rows: Rows) -> str:
    """Return the shares of prints that match by the paper's method, by database and ρ."""
    head = ["", *(f"ρ = {rho:g}: {kind}" for rho in RHOS for kind in ("genuine", "impostor"))]
    together = {
        "name": "all",
        **{kind: sum(row[kind] for row in rows) for kind in ("genuine", "impostor")},
        "accepted": [
            [sum(pair[kind] for pair in each) for kind in (0, 1)]
            for each in zip(*(row["accepted"] for row in rows), strict=True)
        ],
    }
    body = []
    for row in [*rows, together]:
        pairs = (row["genuine"], 1), (row["impostor"], 2)
        shares = [
            f"{100 * count / total:.{digits}f} %"
            for each in row["accepted"]
            for count, (total, digits) in zip(each, pairs, strict=True)
        ]
        body.append([row["name"], *shares])
    return markdown_table([head, *body])


def format_ratios(results: Row) -> str:
    """Return the measures of ``scripts/bench --json``."""
    body = [
        [
            row["name"],
            f"{row['value']:.3g} {row['unit']}",
            row["target"].replace(">=", "≥").replace("<=", "≤"),
            "yes" if row["ok"] else "**no**",
            row["ours"],
            row["yardstick"],
        ]
        for row in results["figures"]
    ]
    return markdown_table([["", "measured", "target", "met", "ours", "beside"], *body])


def format_stages(results: Row) -> str:
    """Return the times of the stages in milliseconds, a table for each part."""
    tables = []
    for part, title in _STAGES.items():
        times = dict(results["stages"][part])
        if part != "matching":  # whose rows are not steps of one process
            times["together"] = sum(times.values())
        body = [[name, f"{format_ms(value)} ms"] for name, value in times.items()]
        tables += [f"### {title}", markdown_table([["", "CPU time"], *body])]
    return "\n\n".join(tables)


def format_headline(results: Row) -> str:
    """Return the headline measures: of fpmatch, and of another where one is measured."""
    learned, paper = results["learned"], results["paper"]
    speed = {row["name"]: row for row in results["figures"]}
    start, comparison = speed["cold start of verify"], speed["comparison of sample prints"]
    rows = [
        [
            f"equal error rate, mean of {len(learned['sets'])} FVC set B databases, all pairs",
            percent(learned["mean"]["eer"]),
            f"the paper's method as printed: {percent(paper['mean']['eer'])}",
        ],
        [
            "`fpmatch verify` of two images, whole process",
            start["ours"],
            f"only importing numpy and OpenCV: {start['yardstick'].rpartition(': ')[2]}",
        ],
        ["extraction of one print", speed["extraction"]["ours"], speed["extraction"]["yardstick"]],
        ["comparison of two extracted prints", comparison["ours"], comparison["yardstick"]],
    ]
    head = ["figure", "fpmatch", "for comparison"]
    return markdown_table([head, *([name, f"**{ours}**", other] for name, ours, other in rows)])


def format_searching(results: Row) -> str:
    """Return what searches of large galleries cost, and the mates that they lose.

    Turned probes of all databases stand in one row.
    """
    head = ["prints", "effort", "compared", "without a mate: Delaunay calls", "time"]
    cost = [[*head, "compared", "with a mate: Delaunay calls", "time"]]
    for s in results["speed"]:
        row = [f"{s['prints']:,}", str(s["effort"])]
        for kind in ("", "mated_"):
            compared, calls, ms = (s[kind + key] for key in ("compared", "calls", "ms"))
            row += [f"{compared:,.0f}", f"{calls:,.0f}", f"{ms:.0f} ms"]
        cost.append(row)
    efforts = sorted({r["effort"] for r in results["loss"]})
    counts: dict[tuple[int, int, str], Counter[Any]] = {}
    for r in results["loss"]:
        for name in {"all", "all" if r["turned"] else r["name"]}:
            count = counts.setdefault((r["prints"], r["turned"], name), Counter())
            count[r["effort"]] += round(r["lost"] * r["found"])
            if r["effort"] == efforts[0]:
                count.update(mates=r["mates"], ranked=r["found"])
    lost = [f"lost at effort {effort}" for effort in efforts]
    mates = [["prints", "mates of", "turned by", "first if all are compared", *lost]]
    order = sorted(counts, key=lambda key: (key[0], key[1], key[2] == "all"))
    for prints, turned, name in order:
        count = counts[prints, turned, name]
        shares = [percent(count[effort] / max(1, count["ranked"])) for effort in efforts]
        ranked = f"{count['ranked']} of {count['mates']}"
        mates.append([f"{prints:,}", name, f"{turned}°", ranked, *shares])
    return f"{markdown_table(cost)}\n\n{markdown_table(mates)}"


class Part(NamedTuple):
    """Describe results: their file in ``docs/data``, the key in it, and what measures them."""

    file: str
    key: str | None
    source: str
    keep: Callable[[Any], Any] = lambda measured: measured


EVALUATION: Final = "fpmatch evaluate DIR... --json"
PARTS: Final = {
    "learned": Part("accuracy.json", "learned", EVALUATION, rates_kept),
    "filters": Part("accuracy.json", "filters", f"{EVALUATION} --enhance filters", rates_kept),
    "paper": Part("accuracy.json", "paper", f"{EVALUATION} --matcher paper", rates_kept),
    "parts": Part(
        "accuracy.json", "parts", "research/benchmarks/ablation.py of commit f3b85a33, --json"
    ),
    "features": Part("accuracy.json", "features", "research/benchmarks/ablation.py DIR... --json"),
    "figures": Part("performance.json", "figures", "scripts/bench --json", lambda m: m["figures"]),
    "stages": Part("performance.json", "stages", "research/benchmarks/stages.py --json"),
    "points": Part("points.json", None, "python -m research measure points --json"),
    "decision": Part("decision.json", None, "python -m research measure decision DIR... --json"),
    "searching": Part("searching.json", None, "research/benchmarks/large_galleries.py --json"),
}
BLOCKS: Final[Mapping[tuple[str, str], Callable[[Row], str]]] = {
    ("README.md", "headline"): format_headline,
    ("docs/explanation/accuracy.md", "databases"): format_databases,
    ("docs/explanation/accuracy.md", "worth"): format_worth,
    ("docs/explanation/accuracy.md", "features"): lambda results: format_features(
        results["features"]
    ),
    ("docs/explanation/point_sets.md", "measured"): lambda results: format_points(
        results["points"]
    ),
    ("docs/explanation/point_sets.md", "decision"): lambda results: format_decision(
        results["decision"]
    ),
    ("docs/explanation/performance.md", "figures"): format_ratios,
    ("docs/explanation/performance.md", "stages"): format_stages,
    ("docs/explanation/searching.md", "measured"): lambda results: format_searching(
        results["searching"]
    ),
}
"""The function that formats each block, by page and mark, of the results of all parts."""


def keep_result(name: str, measured: Path) -> None:
    """Put a file of measured results in place of what is kept of a part."""
    part = PARTS[name]
    found, target = part.keep(read_json(measured)), DATA / part.file
    write_json(target, found if part.key is None else {**read_json(target), part.key: found})


@click.command(
    cls=Command,
    epilog="\b\nParts:\n" + "\n".join(f"  {name:<10} {p.source}" for name, p in PARTS.items()),
)
@click.option(
    "--keep",
    "given",
    metavar="PART FILE",
    type=(click.Choice(list(PARTS)), PATH),
    multiple=True,
    help="Keep these results of a part (repeatable).",
)
@click.option("--check", is_flag=True, help="Compare the pages with the results; write nothing.")
@click.pass_context
def command(context: click.Context, given: tuple[tuple[str, Path], ...], check: bool) -> None:
    """Write the tables of README and docs, of the results in docs/data.

    The exit status is 1 where a page lacks a block, or, with --check, where it differs.
    """
    for name, path in given:
        keep_result(name, path)
    files = {part.file: read_json(DATA / part.file) for part in PARTS.values()}
    results = {
        name: files[part.file] if part.key is None else files[part.file][part.key]
        for name, part in PARTS.items()
    }
    wrong = False
    for (page, mark), format_block in BLOCKS.items():
        path, block = ROOT / page, format_block(results).strip()
        shown = marked_block(path.read_text("utf-8"), mark) if path.exists() else None
        if shown is None:
            click.echo(f"{page}: has no block {mark}")
        elif shown != block:
            click.echo(f"{page}: {mark} {'differs' if check else 'written'}")
            if not check:
                write_marked_block(path, mark, block)
        wrong |= shown is None or (check and shown != block)
    context.exit(int(wrong))
