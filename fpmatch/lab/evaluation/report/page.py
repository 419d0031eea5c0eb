"""The page of error rates, which needs no other file and no network."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch._version import __version__
from fpmatch.base.folders import make_folder
from fpmatch.base.html import page_templates
from fpmatch.base.output import atomic_write_bytes, check_writable
from fpmatch.drawing.overlay.draw import draw
from fpmatch.drawing.scene.raster import reduced, webp_bytes
from fpmatch.errors import FpmatchError
from fpmatch.lab.evaluation.report.figures import det_curves, det_figure, score_figure
from fpmatch.lab.evaluation.report.text import as_text
from fpmatch.lab.plots.style import PLOT_DPI, check_matplotlib, figure_bytes, plain_style
from fpmatch.matching.verify import verify
from fpmatch.printable import count, printable_lines

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from matplotlib.figure import Figure

    from fpmatch.lab.evaluation.report.results import RatesReport, SetRates

PAGE_NAME: Final = "index.html"
HARDEST: Final = 6  # pairs of a kind
_PICTURE_WIDTH: Final = 900


def prepare_page(folder: str | os.PathLike[str]) -> Path:
    """Make the folder of a page, and return its file, as `write_page` will write it.

    Raises an `OutputError` if matplotlib is not installed, or the page cannot be written there.
    """
    check_matplotlib("a report")
    target = Path(folder) / PAGE_NAME
    make_folder(target.parent)
    check_writable(target)
    return target


def write_page(path: Path, results: Sequence[RatesReport], document: dict[str, Any]) -> None:
    """Write the page into the file that `prepare_page` returned.

    `document` is what `report_document` returns of the results. The images of the databases are
    read again for the overlays.
    """
    curves = det_curves(results)
    matchers = document.get("matchers", [document])
    baselines = [one["baseline"] for one in matchers if "baseline" in one]
    environment = page_templates("fpmatch.lab.evaluation.report")
    environment.filters["image"] = lambda data: base64.b64encode(data).decode("ascii")
    with plain_style():
        html = environment.get_template("page.html.j2").render(
            version=__version__,
            first=results[0],
            prints=matchers[0]["pooled"]["prints"],
            text=as_text(document),
            det=_svg(det_figure(curves)) if curves else b"",
            matchers=[_section(one) for one in results],
            comparisons=[*baselines, *document.get("against_first", ())],
        )
    atomic_write_bytes(path, printable_lines(f"{html.lstrip()}\n").encode())


def _section(report: RatesReport) -> dict[str, Any]:
    """Return what the section on one matcher shows."""
    return {
        "name": report.matcher,
        "scores": _svg(score_figure(report)) if report.genuine and report.impostor else b"",
        "hardest_genuine": hardest_pairs(report, genuine=True),
        "hardest_impostors": hardest_pairs(report, genuine=False),
    }


def _svg(figure: Figure) -> bytes:
    return figure_bytes(figure, "figure.svg", PLOT_DPI)


def hardest_pairs(
    report: RatesReport, most: int = HARDEST, *, genuine: bool
) -> list[dict[str, Any]]:
    """Find the genuine pairs least similar, or the impostor pairs most similar, and draw them.

    The hardest come first. Each print comes once, so that one bad print does not fill the list;
    pairs with a print that gave no template are left out. The images must still be there; of scores
    from a file, the pairs are only named.
    """
    pairs, sign = [], 1 if genuine else -1
    for row in report.sets:
        if row.scores.prints:
            of_kind = (row.scores.trials.genuine == genuine) & row.scores.compared
            pairs += [(row, k) for k in np.flatnonzero(of_kind).tolist()]
    pairs.sort(key=lambda pair: sign * float(pair[0].scores.trials.similarity[pair[1]]))
    hardest: list[dict[str, Any]] = []
    seen: set[tuple[str, int]] = set()
    for row, k in pairs:
        sides = {(row.name, int(side[k])) for side in (row.scores.probe, row.scores.reference)}
        if seen.isdisjoint(sides):
            seen |= sides
            hardest.append(_hard_pair(report.matcher, row, k))
        if len(hardest) >= most:
            break
    return hardest


def _hard_pair(matcher: str, row: SetRates, k: int) -> dict[str, Any]:
    """Return names, similarity and, where the prints are known, a picture and a note on a pair."""
    scores = row.scores
    names = [scores.prints[side[k]] for side in (scores.probe, scores.reference)]
    similarity = float(scores.trials.similarity[k]) * (-1 if scores.distances else 1)
    pair = {"set": row.name, "names": names, "similarity": similarity, "note": ""}
    if row.source is None:
        return pair
    try:
        prints = [row.source.read(name) for name in names]
        v = verify(*(template for template, _ in prints), matcher=matcher)
        drawn = draw(prints[0][1], prints[1][1], v)
    except FpmatchError as error:  # not a matcher of the package, or not calibrated
        return pair | {"note": f"not drawn: {error}"}
    note = f"{count(len(v.pairs), 'pair')} of minutiae, overlap {v.overlap:.0%}"
    note += f"; {v.reason}" if v.reason else ""
    picture = webp_bytes(reduced(drawn, width=_PICTURE_WIDTH, height=drawn.shape[0]))
    return pair | {"score": v.score, "note": note, "picture": picture}
