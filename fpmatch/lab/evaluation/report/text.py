"""The document of a report as tables of text, LaTeX and CSV."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from fpmatch.base.output import atomic_write_bytes, check_writable
from fpmatch.errors import OutputError
from fpmatch.gallery.batch.score_file import csv_lines
from fpmatch.printable import count, text_table

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

RATE_TITLES: Final = {
    "eer": "EER",
    "fmr100": "FMR100",
    "fmr1000": "FMR1000",
    "fmr10000": "FMR10000",
    "zero_fmr": "ZeroFMR",
    "zero_fnmr": "ZeroFNMR",
}
TOO_FEW: Final = "too few fingers"
_UNITS: Final = {
    "finger": "fingers",
    "subject": "subjects",
    "pair of fingers": "for the EER disjoint pairs of fingers",
}
_LEAST_P: Final = 0.0001
_IDENTICAL_SHOWN: Final = 3
_LATEX: Final = {ord(sign): f"\\{sign}" for sign in "&%$#_{}"} | {
    ord(sign): f"\\text{word}{{}}"
    for sign, word in (("\\", "backslash"), ("~", "asciitilde"), ("^", "asciicircum"))
}


def as_text(document: dict[str, Any]) -> str:
    """Return the report as tables; several matchers are compared with the first at the end."""
    matchers = document.get("matchers", [document])
    parts, bounds = [], []
    for one in matchers:
        named = len(matchers) > 1 or ":" in one["matcher"]  # which states parameters
        parts.append(f"matcher {one['matcher']}\n" * named + rates_table(one))
        if "intervals" in one:
            parts.append(_interval_table(one))
            bounds += [bound for _, part in parts_of(one) for bound in part["bounds"].values()]
        if "fnmr_at_fmr" in one:
            parts.append(_points_table(one))
            bounds += [point["bound"] for point in one["fnmr_at_fmr"]]
        if "baseline" in one:
            parts.append(comparison_text(one["baseline"], one["baseline"]["name"]))
    if len(matchers) > 1:
        against = document["against_first"]
        parts += [comparison_text(one, matchers[0]["matcher"]) for one in against]
    return "\n\n".join(filter(None, [*parts, bounds_note(bounds)]))


def percent(rate: float | None) -> str:
    """Write a rate in percent, "-" where there is none."""
    return "-" if rate is None else f"{100 * rate:.2f} %"


def limits(interval: Sequence[float] | None, bound: dict[str, Any] | None = None) -> str:
    """Write an interval in percent, and of a limit by Clopper and Pearson its trials.

    Examples
    --------
    >>> limits([0.01, 0.025]), limits([0.0, 0.2589], {"units": 10}), limits(None)
    ('1.00 - 2.50 %', 'at most 25.89 % (0 of 10)', 'too few fingers')
    """
    if interval is None:
        return TOO_FEW
    low, high = interval
    if bound is None:
        return f"{100 * low:.2f} - {100 * high:.2f} %"
    units = bound["units"]
    if low > 0:
        return f"at least {100 * low:.2f} % ({units} of {units})"
    return f"at most {100 * high:.2f} % (0 of {units})"


def bounds_note(bounds: Iterable[dict[str, Any] | None]) -> str:
    """Return the method of limits and what they count, "" where all are of the bootstrap."""
    units = {one["unit"] for one in bounds if one is not None}
    if not units:
        return ""
    counted = ", ".join(text for unit, text in _UNITS.items() if unit in units)
    return f"0 of n, n of n: 95 % bound by Clopper-Pearson, one-sided; n counts {counted}"


def points(difference: float) -> str:
    """Write a difference of rates in percentage points, without a minus before zero.

    Examples
    --------
    >>> points(-0.00001), points(0.0123)
    ('+0.00', '+1.23')
    """
    return f"{round(100 * difference, 2) + 0.0:+.2f}"


def defined_rates(rates: Iterable[dict[str, Any]]) -> list[str]:
    """Return the names of the rates that are defined at least once."""
    every = list(rates)
    return [name for name in RATE_TITLES if any(row[name] is not None for row in every)]


def parts_of(document: dict[str, Any], *, mean: bool = True) -> list[tuple[Any, Any]]:
    """Return the rates and the intervals, {} without, of each database and of several together."""
    known = document.get("intervals", {})
    sets = document["sets"]
    parts = list(zip(sets, known.get("sets", [{}] * len(sets)), strict=True))
    if len(parts) > 1:
        for name in ("mean", "pooled") if mean else ("pooled",):
            parts.append(({"name": name, **document[name]}, known.get(name, {})))
    return parts


def rates_table(document: dict[str, Any]) -> str:
    """Return a line a database, and of several their mean and all scores pooled, in percent.

    FMR10000 is left out where no database has enough pairs for it. A note on pairs of identical
    prints follows.
    """
    sets = document["sets"]
    defined = defined_rates([*sets, document["pooled"]])
    names = [name for name in RATE_TITLES if name != "fmr10000" or name in defined]
    titles = [RATE_TITLES[name] for name in names]
    rows = [("database", "genuine", "impostor", *titles, "d'", "failed")]
    for row, _ in parts_of(document):
        counts = [str(row.get(name, "")) for name in ("name", "genuine", "impostor", "failures")]
        d_prime = "-" if row["d_prime"] is None else f"{row['d_prime']:.2f}"
        rows.append((*counts[:3], *(percent(row[name]) for name in names), d_prime, counts[3]))
    identical = [row["identical"] for row in sets if row.get("identical", {}).get("count")]
    if not identical:
        return text_table(rows)
    number = sum(one["count"] for one in identical)
    named = [" with ".join(pair) for one in identical for pair in one["pairs"]][:_IDENTICAL_SHOWN]
    more = " and others" * (number > len(named))
    note = f"{count(number, 'pair')} of identical prints, which distort rates: {', '.join(named)}"
    return f"{text_table(rows)}\n\n{note}{more}"


def comparison_text(c: dict[str, Any], name: str) -> str:
    """Return the comparison with the run `name`: p-value, and the rates before and now.

    The table has the EER of each database, then all rates of mean and pooled scores; of one
    database all its rates.
    """
    before, now = c["before"], c["now"]
    by = f", by matcher {before}" if before not in {"", now, name} else ""
    lines = [
        f"{now} compared with {name}{by}: {c['pooled']['pairs']:,} pairs in both, "
        f"{c['identical']:,} with the same similarity"
    ]
    if (d := c["decisions"]) is not None:
        p = d["mcnemar_p"]
        lines.append(
            f"McNemar's exact test: p {f'= {p:.2g}' if p >= _LEAST_P else f'< {_LEAST_P:g}'}; at a "
            f"false match rate of {100 * d['fmr']:g} %, of {d['genuine']:,} genuine pairs "
            f"{len(d['gained']):,} match now and did not, {len(d['lost']):,} did and do not"
        )
    columns = ("before", "now") if before in {"", now} else (before, now)
    rows: list[tuple[str, ...]] = [(" ", "pairs", *columns, "points", "95 % interval", "")]
    several = len(c["sets"]) > 1
    for part in (*c["sets"], *([c["mean"], c["pooled"]] if several else [])):
        only_eer = several and part["name"] not in {"mean", "pooled"}
        for rate in [one for one in RATE_TITLES if one in part][: 1 if only_eer else None]:
            d = part[rate]
            interval = d["change_interval"]
            shown = "-" if interval is None else " to ".join(map(points, interval))
            values = percent(d["before"]), percent(d["now"]), points(d["now"] - d["before"])
            title = f"{part['name']} {RATE_TITLES[rate]}", f"{part['pairs']:,}"
            rows.append((*title, *values, shown, d["verdict"]))
    lines.append(text_table(rows))
    if c["only_before"] or c["only_now"]:
        lines.append(
            f"left out: {c['only_before']:,} pairs that only the earlier run compared, "
            f"{c['only_now']:,} that only this one did"
        )
    return "\n".join(lines)


def _interval_table(document: dict[str, Any]) -> str:
    """Return the lines of the rates with the intervals of those that have one."""
    parts = parts_of(document)
    if not any(part.get(name) for name in RATE_TITLES for _, part in parts):
        return f"95 % intervals: none, there are {TOO_FEW}"
    names = [name for name in parts[0][1] if any(row.get(name) is not None for row, _ in parts)]
    rows = [("95 % intervals", *(RATE_TITLES[name] for name in names))]
    for row, part in parts:
        cells = [
            "-" if row.get(name) is None else limits(part[name], part["bounds"].get(name))
            for name in names
        ]
        rows.append((row["name"], *cells))
    return text_table(rows)


def _points_table(document: dict[str, Any]) -> str:
    """Return a line a database and FMR: the FNMR, its interval, and the threshold."""
    rows = [("FNMR at FMR", "", "FNMR", "95 % interval", "threshold", "score")]
    for p in document["fnmr_at_fmr"]:
        measured = "intervals" in document and p["fnmr"] is not None
        interval = limits(p["interval"], p["bound"]) if measured else "-"
        threshold = "-" if p["threshold"] is None else f"{p['threshold']:.6g}"
        score = "-" if p["score"] is None else f"{p['score']:.1f}"
        at = f"{100 * p['fmr']:.6g} %", percent(p["fnmr"]), interval
        rows.append((p["name"], *at, threshold, score))
    return text_table(rows)


def check_table(path: Path) -> None:
    """Raise an OutputError if a table cannot be written to a file of this name."""
    if path.suffix.lower() not in {".tex", ".csv"}:
        raise OutputError(f"{path}: a table's name ends with .tex, .csv")
    check_writable(path)


def save_table(path: Path, document: dict[str, Any]) -> None:
    """Write the rates of each matcher and database, as LaTeX (.tex) or CSV, with their intervals.

    Of several databases, all scores pooled make one more row. Rates are fractions in CSV, percent
    in LaTeX. Raises an OutputError if the file cannot be written.
    """
    matchers = document.get("matchers", [document])
    names = defined_rates(one["pooled"] for one in matchers)
    limits = [f"{name}{end}" for name in names for end in ("", "_low", "_high")]
    rows: list[list[Any]] = [["matcher", "set", "genuine", "impostor", *limits]]
    for one in matchers:
        for row, known in parts_of(one, mean=False):
            cells = [one["matcher"], row["name"], row["genuine"], row["impostor"]]
            for name in names:
                cells += [row[name], *(known.get(name) or (None, None))]
            rows.append(["" if cell is None else cell for cell in cells])
    is_csv = path.suffix.lower() == ".csv"
    atomic_write_bytes(path, csv_lines(rows) if is_csv else _latex(rows).encode())


def _latex(rows: list[list[Any]]) -> str:
    """Return rows of CSV as a table, a rate and its limits in one cell."""
    table = [[*rows[0][:4], *(RATE_TITLES[name] for name in rows[0][4::3])]]
    for row in rows[1:]:
        table.append(row[:4])
        for k in range(4, len(row), 3):
            rate, low, high = ("" if c == "" else f"{100 * c:.2f}" for c in row[k : k + 3])
            table[-1].append(f"{rate} [{low}--{high}]" if low else rate)
    lines = [" & ".join(str(cell).translate(_LATEX) for cell in row) + r" \\" for row in table]
    head = rf"\begin{{tabular}}{{ll{'r' * (len(table[0]) - 2)}}}", r"\hline", lines[0], r"\hline"
    end = r"\hline", r"\multicolumn{2}{l}{Rates in \%.} \\", r"\end{tabular}", ""
    return "\n".join([*head, *lines[1:], *end])
