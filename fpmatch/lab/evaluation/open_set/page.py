"""The page of a test of open-set identification, in the look of that of an evaluation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.base.output import atomic_write_bytes
from fpmatch.lab.evaluation.open_set.curves import identification_drawings
from fpmatch.lab.evaluation.open_set.report import RATIOS, stated_table
from fpmatch.lab.evaluation.report.hardest import DEFAULT_COUNT, HardPair, explained_pair
from fpmatch.lab.evaluation.report.page import prepare_page, render
from fpmatch.printable import count, printable_lines

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence
    from pathlib import Path

    from fpmatch.lab.evaluation.databases.extraction import ExtractedSet
    from fpmatch.lab.evaluation.open_set.report import IdentificationReport

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
                "stated": stated_table("all searches", report.pooled.points),
                "missed": _failed(report, sets, mates=True),
                "false_positives": _failed(report, sets, mates=False),
            }
            for report in reports
        ],
        ratios=RATIOS,
        bounds_note=next(filter(None, (report.bounds_note() for report in reports)), ""),
        count=count,
        failures=[failure for one in sets for failure in one.failures],
        prints=sum(len(one.extractions) for one in sets),
    )
    atomic_write_bytes(target, printable_lines(html).encode())
    return target


def _failed(
    report: IdentificationReport, sets: Sequence[ExtractedSet], *, mates: bool
) -> list[HardPair]:
    """Return probe and mate, or false candidate, of the worst searches that fail, each print once.

    They fail at the highest of the FPIRs. Searches with a print without template are left out.
    """
    s, point = report.searches, report.pooled.loosest
    if point is None or point.by_chance is None:
        return []
    probes, others, scores, chance = (
        (s.mated, s.mate, s.score, s.chance)
        if mates
        else (s.nonmated, s.first, s.highest, s.least_chance)
    )
    failed = (chance >= point.by_chance) == mates
    pairs: list[HardPair] = []
    seen: set[int] = set()
    for k in np.argsort(-chance if mates else chance, kind="stable"):
        numbers = [int(n) for n in (probes[k], others[k]) if n >= 0]
        if not failed[k] or not seen.isdisjoint(numbers) or len(pairs) == DEFAULT_COUNT:
            continue
        both, score = [report.presented[n] for n in numbers], float(scores[k])
        prints = [
            [(sets[of].dataset.impressions[n], sets[of].extractions[n]) for n in impressions]
            for of, impressions in both
        ]
        if any(extraction.template is None for one in prints for _, extraction in one):
            continue
        seen |= {*numbers}
        named = ", ".join(dict.fromkeys(sets[of].dataset.name for of, _ in both))
        if report.fingers == 1 and len(both) == 2:
            pair = [one[0] for one in prints]
            pairs.append(explained_pair(report.matcher, named, pair, score, genuine=mates))
            continue
        names = [" + ".join(impression.name for impression, _ in one) for one in prints]
        reference = names[1] if names[1:] else "a print of the background"
        causes = ("not on the candidate list",) if score < 0 else ()
        pairs.append(HardPair(named, names[0], reference, max(score, 0.0), score, causes, b""))
    return pairs
