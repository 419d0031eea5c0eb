"""The three outcomes of comparisons: of whole prints, and of parts of them with whole prints."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Final

import click
import numpy as np

from fpmatch.gallery.index.prints.compare import similarities
from fpmatch.gallery.index.prints.prepared_prints import PreparedPrints
from fpmatch.image.extract import extract
from fpmatch.image.io.read import read_image
from fpmatch.lab.evaluation.cropping import crop_at
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.decision import (
    ENOUGH_MM2,
    decide,
    evidence_in,
    reachable_scores,
    reachable_similarities,
    ridge_area_mm2,
    solidity,
    uniformity,
)
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.result import INCONCLUSIVE, MATCH, NO_MATCH
from fpmatch.matching.verify import DEFAULT_THRESHOLD
from research.commands import Command, folders, json_file, workers, write_json
from research.databases import extract_folders, prints_of, without_ridges
from research.markdown import markdown_table
from research.partial_templates import fragment

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.databases.extraction import ExtractedSet
    from fpmatch.lab.evaluation.databases.protocol import Impression
    from fpmatch.templates.minutiae import Template

FRAGMENT_SIZES: Final = (2, 3, 4, 5, 6, 8, 10, 12)  # minutiae
CROP_SIDES_PX: Final = (64, 96, 128, 160)  # at 500 dpi
OUTCOMES: Final = (MATCH, NO_MATCH, INCONCLUSIVE)
KINDS: Final = ("genuine", "impostor")


@dataclass
class OutcomeRow:
    """Count the outcomes of genuine and of impostor pairs, in the order of `OUTCOMES`."""

    name: str
    genuine: NDArray[np.int_] = field(default_factory=lambda: np.zeros(len(OUTCOMES), int))
    impostor: NDArray[np.int_] = field(default_factory=lambda: np.zeros(len(OUTCOMES), int))

    def add(self, outcome: NDArray[np.str_], genuine: NDArray[np.bool_]) -> None:
        """Count the outcomes of some pairs."""
        for kind, chosen in ((self.genuine, genuine), (self.impostor, ~genuine)):
            kind += [np.count_nonzero(outcome[chosen] == one) for one in OUTCOMES]

    def as_json(self) -> dict[str, Any]:
        """Return the counts as JSON values."""
        return {k: v if k == "name" else v.tolist() for k, v in asdict(self).items()}


class WholePrints:
    """The prints of a database, prepared to be compared with."""

    def __init__(self, extracted: ExtractedSet) -> None:
        kept = prints_of(extracted)
        self.impressions: list[Impression] = [one for one, _ in kept]
        self.templates: list[Template] = [template for _, template in kept]
        self.finger = np.array([one.finger for one in self.impressions])
        prepared = [MATCHER.prepare(template) for template in self.templates]
        self._packed = PreparedPrints.pack(prepared)
        sides = zip(self.templates, prepared, strict=True)
        self._evidence = np.stack([evidence_in(MATCHER, *one) for one in sides])

    def outcomes(self, probe: Template) -> NDArray[np.str_]:
        """Return the outcomes of the comparisons of a probe with all prints."""
        prepared, curve = MATCHER.prepare(probe), load_calibration(MATCHER.name)
        score = curve.scores(similarities(MATCHER, prepared, self._packed))
        ours = evidence_in(MATCHER, probe, prepared)
        reachable = reachable_scores(curve, reachable_similarities(MATCHER, ours, self._evidence))
        return decide(score >= DEFAULT_THRESHOLD, reachable, DEFAULT_THRESHOLD)

    def count(self, row: OutcomeRow, number: int, probe: Template, *, ordered: bool) -> None:
        """Count the outcomes of print `number`, or of a part of it, with the prints after it."""
        others = np.arange(len(self.templates))
        others = others[others > number] if ordered else others[others != number]
        outcome = self.outcomes(probe)[others]
        row.add(outcome, self.finger[others] == self.finger[number])


def outcome_rows(sets: Sequence[ExtractedSet], count: int, seed: int) -> Iterator[OutcomeRow]:
    """Yield a row a database of whole prints, then a row a kind of parts of prints of all of them.

    Of each kind there are `count` parts of prints drawn from each database.
    """
    databases = [WholePrints(extracted) for extracted in sets]
    for extracted, prints in zip(sets, databases, strict=True):
        row = OutcomeRow(f"{extracted.dataset.name}, whole prints")
        for number, template in enumerate(prints.templates):
            prints.count(row, number, template, ordered=True)
        yield row
    for form in ("with ridges", "minutiae alone"):
        for size in FRAGMENT_SIZES:
            row = OutcomeRow(f"{size} minutiae, {form}")
            for prints, number, rng in _drawn(databases, count, (seed, size)):
                part = fragment(prints.templates[number], size, rng)
                part = part if form == "with ridges" else without_ridges(part)
                prints.count(row, number, part, ordered=False)
            yield row
    for side in CROP_SIDES_PX:
        row = OutcomeRow(f"crop of {side} px")
        for prints, number, rng in _drawn(databases, count, (seed, side)):
            prints.count(row, number, _crop(prints, number, side, rng), ordered=False)
        yield row


def _drawn(
    databases: Sequence[WholePrints], count: int, seed: tuple[int, int]
) -> Iterator[tuple[WholePrints, int, np.random.Generator]]:
    rng = np.random.default_rng(seed)
    for prints in databases:
        for number in rng.integers(len(prints.templates), size=count).tolist():
            yield prints, number, rng


def _crop(prints: WholePrints, number: int, side: int, rng: np.random.Generator) -> Template:
    """Extract a square about a place of a print, which may show no minutia."""
    template = prints.templates[number]
    assert template.field is not None
    cells = np.argwhere(template.field.mask)
    row, column = (cells[rng.integers(len(cells))] + 0.5) * template.field.step
    image = crop_at(read_image(prints.impressions[number].path), column, row, side, template.dpi)
    return extract(image, template.dpi)


def ridge_extremes(extracted: ExtractedSet) -> str:
    """Return how near the prints of a database come to what is taken for no ridges of a finger."""
    templates = [one.template for one in extracted.extractions if one.template is not None]
    shown = [one for one in templates if one.field is not None and one.field.mask.any()]
    solid = min((solidity(one.field.mask) for one in shown if one.field), default=math.nan)
    large = [one.field for one in shown if one.field and ridge_area_mm2(one) > ENOUGH_MM2]
    uniform = max(map(uniformity, large), default=math.nan)
    return (
        f"{extracted.dataset.name}: {len(shown)} prints with ridges, least solidity {solid:.3f}, "
        f"greatest uniformity on more than {ENOUGH_MM2:.0f} mm² {uniform:.3f}"
    )


def format_outcomes(rows: Sequence[Mapping[str, Any]]) -> str:
    """Format rows of `OutcomeRow.as_json` as a Markdown table, in percent of the pairs."""
    head = ["probes", *(f"{kind}: {one}" for kind in KINDS for one in OUTCOMES)]
    body = []
    for row in rows:
        shares = [100.0 * np.array(row[kind]) / max(1, sum(row[kind])) for kind in KINDS]
        body.append([row["name"], *(f"{share:.2f}" for share in np.concatenate(shares))])
    return markdown_table([head, *body])


@click.command(cls=Command)
@folders
@click.option("--parts", default=40, show_default=True, help="Of each kind and database.")
@click.option("--seed", default=0, show_default=True)
@json_file
@workers
def command(
    folders: tuple[Path, ...], parts: int, seed: int, json_file: Path | None, workers: int | None
) -> None:
    """Count the outcomes MATCH, NO MATCH and INCONCLUSIVE of genuine and of impostor pairs.

    Each DIR is an FVC-style database. All pairs of its prints are compared, and parts of prints
    with all other prints: some neighbouring minutiae with the ridges around them or without, and
    squares of the images at random places, extracted again. After the table stand the extremes of
    the prints' ridges, by which other pictures are recognised.
    """
    sets = extract_folders(folders, workers)
    rows = []
    for row in outcome_rows(sets, parts, seed):
        rows.append(row.as_json())
        click.echo(f"{len(rows)}: {row.name}", err=True)
    click.echo(format_outcomes(rows))
    for extracted in sets:
        click.echo(ridge_extremes(extracted))
    if json_file is not None:
        write_json(json_file, {"rows": rows})
