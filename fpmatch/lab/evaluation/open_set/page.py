"""The page of a test of open-set identification, in the look of that of an evaluation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.base.output import atomic_write_bytes
from fpmatch.lab.evaluation.open_set.curves import identification_drawings
from fpmatch.lab.evaluation.open_set.report import prediction_table
from fpmatch.lab.evaluation.report.hardest import DEFAULT_COUNT, HardPair, explained_pair
from fpmatch.lab.evaluation.report.page import prepare_page, render
from fpmatch.printable import count, printable_lines

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence
    from pathlib import Path

    from fpmatch.lab.evaluation.databases.extraction import ExtractedSet
    from fpmatch.lab.evaluation.open_set.report import (
        FailedSearch,
        IdentificationReport,
        Presented,
    )

IDENTIFICATION_PAGE: Final = "identification.html"


def write_identification_page(
    folder: str | os.PathLike[str],
    reports: Sequence[IdentificationReport],
    sets: Sequence[ExtractedSet],
) -> Path:
    """Write the page into a folder, made if missing, and return its file; errors as `prepare_page`.

    `sets` are the databases that were searched for. Their images are read again for the overlays.
    """
    target = prepare_page(folder, IDENTIFICATION_PAGE)
    html = render(
        "identification.html.j2",
        drawings=identification_drawings(reports),
        sections=[
            {
                "report": report,
                "predictions": prediction_table("all searches", report.pooled.points),
                "missed": _pairs(report, report.missed, sets, mates=True),
                "false_positives": _pairs(report, report.false_positives, sets, mates=False),
            }
            for report in reports
        ],
        bounds_note=next(filter(None, (report.bounds_note() for report in reports)), ""),
        count=count,
        failures=[failure for one in sets for failure in one.failures],
        prints=sum(len(one.extractions) for one in sets),
    )
    atomic_write_bytes(target, printable_lines(html).encode())
    return target


def _pairs(
    report: IdentificationReport,
    searches: Sequence[FailedSearch],
    sets: Sequence[ExtractedSet],
    *,
    mates: bool,
) -> list[HardPair]:
    """Return probe and mate, or false candidate, of the worst searches, each print once.

    Searches with a print that gave no template are left out.
    """

    def name(one: Presented) -> str:
        impressions = sets[one.database].dataset.impressions
        return " + ".join(impressions[n].name for n in one.impressions)

    pairs: list[HardPair] = []
    seen: set[Presented] = set()
    for probe, other, score in searches:
        both = [probe] if other is None else [probe, other]
        sides = [
            (sets[one.database].dataset.impressions[n], sets[one.database].extractions[n])
            for one in both
            for n in one.impressions
        ]
        if not seen.isdisjoint(both) or any(e.template is None for _, e in sides):
            continue
        seen.update(both)
        of = ", ".join(dict.fromkeys(sets[one.database].dataset.name for one in both))
        if report.fingers == 1 and other is not None:
            pairs.append(explained_pair(report.matcher, of, sides, score, genuine=mates))
        else:
            reference = "a print of the background" if other is None else name(other)
            causes = ("not on the candidate list",) if score < 0 else ()
            pairs.append(HardPair(of, name(probe), reference, max(score, 0.0), score, causes, b""))
        if len(pairs) == DEFAULT_COUNT:
            break
    return pairs
