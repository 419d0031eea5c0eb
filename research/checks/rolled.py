"""The command ``check rolled``: rolled prints against flat ones of the same synthetic fingers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import click
import numpy as np

from fpmatch.gallery.index.prints.compare import similarities
from fpmatch.gallery.index.prints.prepared_prints import PreparedPrints
from fpmatch.image.extract import extract
from fpmatch.image.io.grey import GreyImage
from fpmatch.lab.evaluation.rates.error_rates import error_rates
from fpmatch.lab.evaluation.report.results import percent
from fpmatch.lab.synthesis.impression import make_impression
from fpmatch.lab.synthesis.master import make_master
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import SENSORS
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.verify import verify
from research.commands import PATH, Command
from research.ground_truth import (
    MIN_COMMON,
    ImpressionTruth,
    common_minutiae,
    measure_transform,
)
from research.markdown import markdown_table, write_marked_block

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from fpmatch.templates.minutiae import Template

SEED: Final = 1201
ROLLED: Final = ("rolled", "rolled-512x512")  # preset and sensor
FLAT: Final = ("normal", "optical-388x374")
KINDS: Final = {
    "rolled against rolled": (ROLLED, ROLLED),
    "rolled against flat": (ROLLED, FLAT),
    "flat against flat": (FLAT, FLAT),
}


class Shown(NamedTuple):
    """One impression: its template and its ground truth."""

    template: Template
    truth: ImpressionTruth


@click.command(
    cls=Command,
    epilog="""\b
Example:
  python -m research check rolled --into docs/explanation/limits.md
""",
)
@click.option("--into", metavar="PAGE.md", type=PATH, help="Write the table into this page.")
@click.option("--fingers", default=100, show_default=True, help="Synthetic fingers.")
def command(into: Path | None, fingers: int) -> None:
    """Measure comparisons of rolled and of flat prints of the same synthetic fingers.

    Each finger is printed twice rolled and twice flat, from one master. Transforms are measured
    against the ground truth, where at least 12 minutiae are visible in both prints.
    """
    prints = [_prints_of(finger) for finger in range(1, fingers + 1)]
    head = ["prints", "genuine", "impostors", "EER", "FMR1000", "match", "transform in place"]
    table = [[*head, "distance of true minutiae, px", "least possible"]]
    table += [
        _row(name, [of[one][0] for of in prints], [of[other][1] for of in prints])
        for name, (one, other) in KINDS.items()
    ]
    click.echo(markdown_table(table))
    if into:
        write_marked_block(into, "rolled-flat", markdown_table(table))


def _prints_of(finger: int) -> dict[tuple[str, str], tuple[Shown, Shown]]:
    """Make two rolled and two flat impressions of a finger."""
    master = make_master(SEED, finger, PRESETS["rolled"].master)
    shown: dict[tuple[str, str], list[Shown]] = {ROLLED: [], FLAT: []}
    for number, (preset, sensor) in enumerate((ROLLED, ROLLED, FLAT, FLAT), start=1):
        made = make_impression(master, number, PRESETS[preset], SENSORS[sensor])
        hidden = np.empty((0, 2))
        truth = ImpressionTruth(made.transform, made.minutiae, made.master, made.visible, hidden)
        shown[preset, sensor].append(Shown(extract(GreyImage(made.image), made.dpi), truth))
    return {kind: (one, other) for kind, (one, other) in shown.items()}


def _row(name: str, probes: Sequence[Shown], references: Sequence[Shown]) -> list[str]:
    """Compare each finger's probe with the references of all fingers."""
    many = PreparedPrints.pack(MATCHER.prepare(one.template) for one in references)
    prepared = [MATCHER.prepare(one.template) for one in probes]
    similarity = np.array([similarities(MATCHER, one, many) for one in prepared])
    genuine = np.eye(len(probes), dtype=bool)
    matches, errors = 0, []
    for probe, reference in zip(probes, references, strict=True):
        compared = verify(probe.template, reference.template)
        matches += compared.match
        truths = probe.truth, reference.truth
        if len(common_minutiae(*truths)[0]) >= MIN_COMMON:
            dpi = reference.template.dpi
            errors.append(measure_transform(compared.transform, *truths, dpi))
    rates = error_rates(similarity[genuine], similarity[~genuine])
    in_place = sum(error.in_place for error in errors) / len(errors)
    residual, least = np.nanmedian([error[2:] for error in errors], axis=0)
    return [
        name,
        str(len(probes)),
        f"{np.count_nonzero(~genuine):,}",
        *(percent(rate) for rate in (rates.eer, rates.fmr1000, matches / len(probes))),
        f"{percent(in_place)} of {len(errors)}",
        f"{residual:.1f}",
        f"{least:.1f}",
    ]
