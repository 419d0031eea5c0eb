"""The command that trains the index of large galleries: rarity of its terms, and losses."""

from __future__ import annotations

from itertools import islice, product
from typing import TYPE_CHECKING, Final

import click
import numpy as np

import fpmatch
from fpmatch.indexing.loss import LossTable, combined_scores
from fpmatch.indexing.model import MODEL_FILE, IndexModel
from fpmatch.indexing.segment import MAX_PRINTS, Segment
from fpmatch.indexing.terms import print_terms, probe_terms
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.candidate_list import normalized_prefilter_scores
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.packed_templates import PackedTemplates
from fpmatch.output import check_writable
from fpmatch.synthesis.sensor import SENSORS
from fpmatch.synthesis.templates import make_templates
from research.commands import PATH, Command, write_json

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.matching.prepare import PreparedTemplate

PRESETS: Final = ("clean", "easy", "normal", "stretched")  # which lose as many mates as FVC
SEED: Final = 901
GALLERY_SEED: Final = 931
PRINTS: Final = (10_000, 100_000, 1_000_000, 10_000_000)  # of galleries
BUDGETS: Final = (0.15, 0.3, 0.5, 0.8)
LOSSES: Final = (0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2)


@click.command(
    cls=Command,
    epilog="""\b
Example:
  python -m research train index
""",
)
@click.option("--into", type=PATH, default=MODEL_FILE, help="File to write.")
@click.option("--mates", default=3000, show_default=True, help="Pairs of prints of one finger.")
@click.option("--others", default=8000, show_default=True, help="Prints they are ranked among.")
def command(into: Path, mates: int, others: int) -> None:
    """Train the index of large galleries on synthetic prints.

    The shares of the terms are counted in the prints of other fingers. Then each mate is ranked
    among these prints, by its votes with each budget of postings, and by votes and bit descriptors.
    A mate counts in galleries in which a comparison with all prints is expected to find it: those
    of fewer prints than the inverse of its FMR. The same package writes the same file.
    """
    into.parent.mkdir(parents=True, exist_ok=True)
    check_writable(into)
    if not 0 < others <= MAX_PRINTS:
        raise click.BadParameter(f"between 1 and {MAX_PRINTS} prints", param_hint="--others")
    with click.progressbar(gallery_prints(others), length=others, label="prints") as counted:
        prints = list(counted)
    terms = np.concatenate([print_terms(print_)[0] for print_ in prints])
    model = IndexModel.of_edges(terms, len(prints))
    with click.progressbar(mated_prints(mates), length=mates, label="mates") as pairs:
        table = measure(model, prints, pairs)
    provenance = {
        "presets": PRESETS,
        "mates": mates,
        "others": others,
        "seeds": [SEED, GALLERY_SEED],
        "version": fpmatch.__version__,
        "command": "python -m research train index",
    }
    loss = table.document()
    write_json(into, {"provenance": provenance, **model.document(), "loss": loss})
    click.echo(into)


def gallery_prints(count: int) -> Iterator[PreparedTemplate]:
    """Yield prints of different synthetic fingers."""
    return (print_ for (print_,) in _impressions(GALLERY_SEED, count, 1))


def mated_prints(count: int) -> Iterator[tuple[PreparedTemplate, ...]]:
    """Yield two prints each of synthetic fingers."""
    return _impressions(SEED, count, 2)


def _impressions(seed: int, count: int, impressions: int) -> Iterator[tuple[PreparedTemplate, ...]]:
    """Yield so many prints each of fingers, of all presets and sensors in turn."""
    families = list(product(PRESETS, sorted(SENSORS)))
    fingers = range(-(-count // len(families)))
    made = [
        make_templates(seed + k, fingers, impressions, preset=preset, sensors=(sensor,))
        for k, (preset, sensor) in enumerate(families)
    ]
    for k in range(count):
        templates = islice(made[k % len(made)], impressions)
        yield tuple(map(MATCHER.prepare, templates))


def measure(
    model: IndexModel,
    prints: list[PreparedTemplate],
    pairs: Iterable[tuple[PreparedTemplate, ...]],
) -> LossTable:
    """Return the shares of `prints` that rank before mates."""
    several = PackedTemplates.pack(prints)
    gallery = segment_of(prints)
    calibration = load_calibration(MATCHER.name)
    score, rank = [], []
    for mate, probe in pairs:
        score.append(calibration.score(MATCHER.compare(probe, mate).similarity))
        rank.append(ranks(model, gallery, several, probe, mate))
    return table_of(np.array(score), np.array(rank))


def ranks(
    model: IndexModel,
    gallery: Segment,
    several: PackedTemplates,
    probe: PreparedTemplate,
    mate: PreparedTemplate,
) -> NDArray[np.float64]:
    """Return the shares of the gallery that rank before a mate, (2, B), by stage and budget."""
    alone, packed = segment_of([mate]), PackedTemplates.pack([mate])
    descriptors = normalized_prefilter_scores(probe, several)
    of_mate = normalized_prefilter_scores(probe, packed)
    found = np.empty((2, len(BUDGETS)))
    for k, budget in enumerate(BUDGETS):
        terms = probe_terms(probe, budget, model)
        votes, own = gallery.votes(terms), alone.votes(terms)
        found[0, k] = (votes >= own).mean()
        found[1, k] = (combined_scores(descriptors, votes) >= combined_scores(of_mate, own)).mean()
    return found


def table_of(score: NDArray[np.float64], rank: NDArray[np.float64]) -> LossTable:
    """Return the table of mates with these scores (M,), and ranks (M, 2, B)."""
    shares = np.empty((2, len(PRINTS), len(BUDGETS), len(LOSSES)))
    for k, prints in enumerate(PRINTS):
        found = rank[score >= 10 * np.log10(prints)]
        found = found if len(found) else np.ones((1, *rank.shape[1:]))
        wanted = 1 - np.array(LOSSES)
        quantiles = np.quantile(found, wanted, axis=0, method="higher")  # (L, 2, B)
        shares[:, k] = quantiles.transpose(1, 2, 0)
    axes = (np.array(axis, np.float64) for axis in (PRINTS, BUDGETS, LOSSES))
    return LossTable(*axes, *shares)


def segment_of(prints: list[PreparedTemplate]) -> Segment:
    """Return a segment of prints, numbered in their order."""
    numbers = np.arange(len(prints))
    return Segment.build(numbers, numbers, prints)
