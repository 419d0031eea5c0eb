"""The command ``compare-templates``."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.lab.synthesis.sensor import SENSORS
from fpmatch.lab.synthesis.templates import make_templates
from research.commands import PATH, Command, folders, json_file, print_and_write, workers
from research.databases import extract_folders, prints_of
from research.experiments.template_statistics import Group, compare_non_mates, describe
from research.tables.synthesis import format_templates

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from fpmatch.templates.minutiae import Template

SEED: Final = 31
FINGERS: Final = 60  # of each sensor
IMPRESSIONS: Final = 4
MOST_PROBES: Final = 160  # evenly chosen
REAL, DRAWN, MADE = "real", "synthetic, extracted from images", "synthetic, without images"


@click.command(
    cls=Command,
    epilog="""\b
Example:
  python -m research compare-templates fvc/fvc2002/DB?_B --drawn synthetic --json templates.json
""",
)
@folders
@click.option(
    "--drawn", metavar="DIR", type=PATH, multiple=True, help="Synthetic images (repeatable)."
)
@json_file
@workers
def command(
    folders: tuple[Path, ...], drawn: tuple[Path, ...], json_file: Path | None, workers: int | None
) -> None:
    """Compare synthetic templates that are made without images with those of real prints.

    Minutiae, mates and non-mates of the FVC-style databases DIR together, of synthetic images, and
    of templates made without images are described side by side. The probes of the non-mated pairs
    are those of the databases; the last gallery has no ridge images.
    """
    given = [_extracted(REAL, folders, workers)]
    given += [_extracted(DRAWN, drawn, workers)] if drawn else []
    results = compare([*given, made_group()])
    print_and_write(format_templates(results), results, json_file)


def compare(groups: Sequence[Group]) -> dict[str, Any]:
    """Return the statistics of groups, of which the first is real and the last made."""
    real, made = groups[0], groups[-1]
    chosen = slice(0, None, max(1, len(real.templates) // MOST_PROBES))
    probes = Group("probes", real.templates[chosen], real.finger[chosen])
    galleries = [*groups, replace(made, name=f"{made.name} and ridges", templates=_bare(made))]
    return {
        "groups": [describe(group) for group in groups],
        "non_mates": compare_non_mates(probes, galleries),
    }


def made_group() -> Group:
    """Return templates made without images, by all sensors."""
    templates: list[Template] = []
    finger: list[object] = []
    for k, sensor in enumerate(SENSORS):
        numbers = range(k * FINGERS, (k + 1) * FINGERS)
        templates += make_templates(SEED, numbers, IMPRESSIONS, sensors=[sensor])
        finger += [number for number in numbers for _ in range(IMPRESSIONS)]
    return Group(MADE, templates, finger)


def _bare(group: Group) -> list[Template]:
    """Return the templates of a group without ridge images."""
    return [
        replace(t, field=None if t.field is None else replace(t.field, ridges=None))
        for t in group.templates
    ]


def _extracted(name: str, folders: Sequence[Path], workers: int | None) -> Group:
    templates, finger = [], []
    for k, found in enumerate(extract_folders(folders, workers)):
        for impression, template in prints_of(found):
            templates.append(template)
            finger.append((k, impression.finger))
    return Group(name, templates, finger)
