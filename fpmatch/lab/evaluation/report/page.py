"""The page of error rates, which needs no other file and no network."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch._version import __version__
from fpmatch.base.folders import make_folder
from fpmatch.base.html import page_templates
from fpmatch.base.output import atomic_write_bytes, check_writable
from fpmatch.gallery.batch.decision import calibration_of, matches, rho_of
from fpmatch.lab.evaluation.report.figures import det_curves, det_figure, score_figure
from fpmatch.lab.evaluation.report.hardest import hardest_pairs
from fpmatch.lab.evaluation.report.results import split_scores
from fpmatch.lab.evaluation.report.text import as_text, comparison_text, decisions_sentence
from fpmatch.lab.plots.style import PLOT_DPI, check_matplotlib, figure_bytes, plain_style
from fpmatch.matching.decision import DEFAULT_THRESHOLD
from fpmatch.printable import printable_lines

if TYPE_CHECKING:
    import os

    from matplotlib.figure import Figure

    from fpmatch.lab.evaluation.report.analysis import Report
    from fpmatch.lab.evaluation.report.results import RatesReport

PAGE_NAME: Final = "index.html"


def prepare_page(folder: str | os.PathLike[str]) -> Path:
    """Make the folder of a page, and return its file, as `write_page` will write it.

    Raises an `OutputError` if matplotlib is not installed, or the page cannot be written there.
    """
    check_matplotlib("a report")
    target = Path(folder) / PAGE_NAME
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
    curves = det_curves(results)
    environment = page_templates("fpmatch.lab.evaluation.report")
    environment.filters["image"] = lambda data: base64.b64encode(data).decode("ascii")
    with plain_style():
        return (
            environment.get_template("page.html.j2")
            .render(
                version=__version__,
                first=results[0],
                text=as_text(report),
                det=_svg(det_figure(curves)) if curves else b"",
                matchers=[_section(one) for one in results],
                comparisons=[
                    {
                        "title": f"{c.now} against {c.before or 'the baseline'}",
                        "text": comparison_text(c, c.before or "the baseline"),
                        "decisions": c.decisions,
                        "sentence": "" if c.decisions is None else decisions_sentence(c.decisions),
                    }
                    for c in (
                        *(one.baseline for one in report.analyses if one.baseline is not None),
                        *report.comparisons,
                    )
                ],
            )
            .lstrip()
            + "\n"
        )


def _section(report: RatesReport) -> dict[str, Any]:
    """Return what the section on one matcher shows."""
    genuine, impostor = split_scores(report.sets)
    return {
        "name": report.matcher,
        "decisions": _default_decisions(report),
        "scores": _svg(score_figure(report)) if genuine.size and impostor.size else b"",
        "hardest_genuine": hardest_pairs(report, genuine=True),
        "hardest_impostors": hardest_pairs(report, genuine=False),
    }


def _svg(figure: Figure) -> bytes:
    return figure_bytes(figure, "figure.svg", PLOT_DPI)


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

    def share(number: int, total: int) -> str:
        return f" ({100 * number / total:.3g} %)" if total else ""

    return (
        f"{rule}, {missed:,} of {genuine.size:,} genuine pairs do not match"
        f"{share(missed, genuine.size)}, and {matched:,} of {impostor.size:,} "
        f"impostor pairs do{share(matched, impostor.size)}."
    )
