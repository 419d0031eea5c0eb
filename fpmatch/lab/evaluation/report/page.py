"""The page of an evaluation, which needs no other file and no network."""

from __future__ import annotations

import base64
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch._version import __version__
from fpmatch.base.folders import make_folder
from fpmatch.base.html import page_templates
from fpmatch.base.output import atomic_write_bytes, check_writable
from fpmatch.gallery.batch.decision import calibration_of, matches, rho_of
from fpmatch.lab.evaluation.report.figures import matcher_figures, pooled_figures
from fpmatch.lab.evaluation.report.hardest import hardest_pairs
from fpmatch.lab.evaluation.report.rate_text import (
    RATE_TITLES,
    change_limits,
    decidability,
    decisions_sentence,
    defined_rates,
    limits,
    percent,
    points,
)
from fpmatch.lab.evaluation.report.results import split_scores
from fpmatch.lab.plots.style import check_matplotlib
from fpmatch.matching.decision import DEFAULT_THRESHOLD
from fpmatch.printable import printable_lines

if TYPE_CHECKING:
    import os

    from fpmatch.lab.evaluation.report.analysis import Analysis, Report
    from fpmatch.lab.evaluation.report.results import RatesReport

PAGE_NAME: Final = "index.html"
_FILTERS: Final = (change_limits, decidability, decisions_sentence, limits, percent, points)
_IMPOSTOR_PAIRS: Final = {
    "extended": "every two impressions of different fingers",
    "fvc": "the first impressions of every two different fingers",
    "list": "those of a list of pairs",
}


def prepare_page(folder: str | os.PathLike[str], name: str = PAGE_NAME) -> Path:
    """Make the folder of a page, and return its file, as `write_page` will write it.

    Raises an `OutputError` if matplotlib is not installed, or the page cannot be written there.
    """
    check_matplotlib("a report")
    target = Path(folder) / name
    make_folder(target.parent)
    check_writable(target)
    return target


def write_page(folder: str | os.PathLike[str], report: Report) -> Path:
    """Write the page into a folder, made if missing, and return its file; errors as `prepare_page`.

    The images of the databases are read again for the overlays.
    """
    target = prepare_page(folder)
    atomic_write_bytes(target, printable_lines(page(report)).encode())
    return target


def page(report: Report) -> str:
    """Return the HTML that `write_page` writes."""
    results = [one.report for one in report.analyses]
    first = results[0]
    return render(
        "page.html.j2",
        analyses=report.analyses,
        comparisons=report.comparisons,
        first=first,
        fingers=sum(row.scores.trials.fingers for row in first.sets),
        timed=any(math.isfinite(row.extract_ms) for row in first.sets),
        totals=[first.prints, len(first.failures), first.genuine, first.impostor],
        impostor_pairs=_IMPOSTOR_PAIRS.get(first.protocol, ""),
        rates_of_all=defined_rates(one.pooled for one in results),
        figures_of_all=pooled_figures(results) if len(results) > 1 else None,
        matchers=[_section(one, number) for number, one in enumerate(report.analyses)],
        tones={"better": "good", "worse": "bad"},
        several=len(first.sets) > 1,
        limits_of=lambda rates, name: rates.of(name) if rates else (None, None),
        bounds_note=report.note_on_bounds,
    )


def render(template: str, **values: Any) -> str:
    """Return the HTML of a page by its template, with the filters and the look of all pages."""
    environment = page_templates("fpmatch.lab.evaluation.report")
    environment.filters |= {
        "base64": lambda content: base64.b64encode(content).decode("ascii"),
        **{function.__name__: function for function in _FILTERS},
        "thousands": lambda number: f"{number:,}",
        "title_of": RATE_TITLES.__getitem__,
    }
    return environment.get_template(template).render(version=__version__, **values).lstrip() + "\n"


def _section(analysis: Analysis, number: int) -> dict[str, Any]:
    """Return what the section on one matcher shows."""
    report = analysis.report
    return {
        "analysis": analysis,
        "names": defined_rates([*(row.rates for row in report.sets), report.pooled]),
        "decisions": _default_decisions(report),
        "figures": matcher_figures(report, number),
        "calibration": calibration_of(report.matcher),
        "hardest_genuine": hardest_pairs(report, genuine=True),
        "hardest_impostors": hardest_pairs(report, genuine=False),
    }


def _default_decisions(report: RatesReport) -> str:
    """Return the errors of `verify` with its defaults, in a sentence; "" without a rule."""
    rho = rho_of(report.matcher)
    if rho is None and calibration_of(report.matcher) is None:
        return ""
    genuine, impostor = split_scores(report.sets)
    missed = int((~matches(report.matcher, genuine)).sum())
    matched = int(matches(report.matcher, impostor).sum())
    rule = (
        f"At the default threshold of {DEFAULT_THRESHOLD:g}"
        if rho is None
        else f"Where more than a share rho = {rho:g} of the minutiae must be paired"
    )

    def share(count: int, total: int) -> str:
        return f" ({100 * count / total:.3g} %)" if total else ""

    return (
        f"{rule}, {missed:,} of {genuine.size:,} genuine pairs do not match"
        f"{share(missed, genuine.size)}, and {matched:,} of {impostor.size:,} "
        f"impostor pairs do{share(matched, impostor.size)}."
    )
