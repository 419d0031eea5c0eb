"""The table of rates as LaTeX or CSV, with the intervals of the text."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch.base.output import atomic_write_bytes, check_writable
from fpmatch.errors import OutputError
from fpmatch.gallery.batch.score_file import csv_lines
from fpmatch.lab.evaluation.rates.error_rates import POOLED
from fpmatch.lab.evaluation.report.text import TITLES, defined_rates, limits, percent

if TYPE_CHECKING:
    import os

TABLE_FORMATS: Final = (".tex", ".csv")
_LATEX: Final = {**{c: f"\\{c}" for c in "&%$#_{}"}, "\\": "\\textbackslash{}"} | {
    "~": "\\textasciitilde{}",
    "^": "\\textasciicircum{}",
}


def check_table(path: Path) -> None:
    """Raise an OutputError if a table cannot be written to a file of this name."""
    if path.suffix.lower() not in TABLE_FORMATS:
        raise OutputError(f"{path}: a table's name ends with {', '.join(TABLE_FORMATS)}")
    check_writable(path)


def save_table(path: str | os.PathLike[str], document: dict[str, Any]) -> None:
    """Write the rates of each matcher and database, as LaTeX (.tex) or CSV, with their intervals.

    Of several databases, all scores pooled make one more row. Rates are fractions in CSV, percent
    in LaTeX. Raises an OutputError if the file cannot be written.
    """
    matchers = document.get("matchers", [document])
    names = [*defined_rates(one["pooled"] for one in matchers), "rank_one"]
    is_csv = Path(path).suffix.lower() == ".csv"
    rows: list[list[Any]] = [["matcher", "set", "genuine", "impostor"]]
    for name in names:
        rows[0] += [name, f"{name}_low", f"{name}_high"] if is_csv else [TITLES[name]]
    for one in matchers:
        known = one.get("intervals", {"sets": [{}] * len(one["sets"]), "pooled": {}})
        parts = list(zip(one["sets"], known["sets"], strict=True))
        if len(parts) > 1:
            parts.append(({"name": POOLED, **one["pooled"]}, known["pooled"]))
        for row, intervals in parts:
            cells = [one["matcher"], row["name"], row["genuine"], row["impostor"]]
            for name in names:
                if is_csv:
                    cells += [row[name], *(intervals.get(name) or (None, None))]
                else:
                    shown = percent(row[name]).removesuffix(" %")
                    if name in intervals and row[name] is not None:
                        bound = intervals["bounds"].get(name)
                        limit = limits(intervals[name], bound).replace(" - ", "--")
                        shown += f" [{limit}]"
                    cells.append(shown)
            rows.append(cells)
    if is_csv:
        shown_rows = [["" if cell is None else cell for cell in row] for row in rows]
        atomic_write_bytes(path, csv_lines(shown_rows))
        return
    lines = [" & ".join(map(_escaped, row)) + " \\\\" for row in rows]
    columns = "ll" + "r" * (len(rows[0]) - 2)
    head = [f"\\begin{{tabular}}{{{columns}}}", "\\hline", lines[0], "\\hline"]
    end = ["\\hline", "\\multicolumn{2}{l}{Rates in \\%.} \\\\", "\\end{tabular}", ""]
    atomic_write_bytes(path, "\n".join([*head, *lines[1:], *end]).encode())


def _escaped(cell: object) -> str:
    return "".join(_LATEX.get(character, character) for character in str(cell))
