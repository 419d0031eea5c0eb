"""``python -m research train tail``: pairs for the highest scores of the default calibration.

Templates of synthetic fingers are compared with those of a large gallery of other fingers, with
their ridges and on minutiae alone. The highest similarities are kept, of all pairs and of those
whose templates are of one sensor; `research.training.tail` fits a calibration to them.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.gallery.index.compare import PreparedPrints, similarities
from fpmatch.lab.synthesis.sensor import SENSORS
from fpmatch.matching.matchers.unit_circle import MATCHER
from research.commands import PATH, Command, write_json
from research.databases import without_ridges
from research.templates.making import make_templates

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fpmatch.templates.minutiae import Template

TAIL_FILE: Final = Path(__file__).parent / "impostor_tail.json"
SEED: Final = 22
PROBE: Final = 2**40  # number of the first finger of the probes
PRINTS, PROBES = 458_752, 440
AT_ONCE: Final = 4_096  # prints of a sensor; the sensors take the prints in turn
STORED: Final = 8.0  # similarity of the pairs that are kept
FORMS: Final = ("", ", minutiae alone")


@click.command(cls=Command)
@click.option("--prints", default=PRINTS, show_default=True, help="Of the gallery.")
@click.option("--probes", default=PROBES, show_default=True, help="Compared with each of them.")
@click.option("--into", type=PATH, default=TAIL_FILE, help="File to write.")
def command(prints: int, probes: int, into: Path) -> None:
    """Compare synthetic templates of different fingers, and keep the highest similarities.

    The same package writes the same file. The defaults take hours; `python -m research calibrate
    --tail` then fits the highest scores of the default matcher to the file.
    """
    write_json(into, impostor_pairs(prints, probes))
    click.echo(into)


def impostor_pairs(prints: int, probes: int) -> dict[str, Any]:
    """Return the highest similarities of probes and prints of other fingers, by kind of pair."""
    names = list(SENSORS)
    sought = [next(_templates(PROBE + k, 1, names[k % len(names)])) for k in range(probes)]
    kept: dict[str, tuple[list[float], list[float]]] = {form: ([], []) for form in FORMS}
    pairs_of_one_sensor = 0
    for part, first in enumerate(range(0, prints, AT_ONCE)):
        count = min(AT_ONCE, prints - first)
        made = list(_templates(first, count, names[part % len(names)]))
        same = [k % len(names) == part % len(names) for k in range(probes)]
        pairs_of_one_sensor += count * sum(same)
        for form, (of_all, of_one) in kept.items():
            many = PreparedPrints(MATCHER.prepare(_in_form(t, form)) for t in made)
            for template, is_same in zip(sought, same, strict=True):
                found = similarities(MATCHER, MATCHER.prepare(_in_form(template, form)), many)
                high = found[found >= STORED].round(4).tolist()
                of_all.extend(high)
                of_one.extend(high if is_same else ())
    kinds = []
    for form, (of_all, of_one) in kept.items():
        for name, pairs, high in (
            ("synthetic", prints * probes, of_all),
            ("synthetic, of one sensor", pairs_of_one_sensor, of_one),
        ):
            kinds.append({"name": name + form, "pairs": pairs, "similarity": sorted(high)[::-1]})
    return {"gallery": prints, "kinds": kinds}


def _templates(first: int, count: int, sensor: str) -> Iterator[Template]:
    return make_templates(SEED, range(first, first + count), sensors=[sensor])


def _in_form(template: Template, form: str) -> Template:
    return without_ridges(template) if form else template
