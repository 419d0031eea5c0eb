"""The command that trains the index of large galleries: rarity of its terms, and losses."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice, product
from typing import TYPE_CHECKING, Any, Final

import click
import numpy as np

import fpmatch
from fpmatch.base.output import check_writable
from fpmatch.gallery.index.loss import LossTable, cost, with_ridges, with_votes
from fpmatch.gallery.index.model import CURVATURES, LENGTHS, MODEL_FILE, SECTORS, IndexModel
from fpmatch.gallery.index.print_segment import MOST_PRINTS, PrintSegment
from fpmatch.gallery.index.prints.candidate_list import SizeNormalization
from fpmatch.gallery.index.prints.compare import ridge_agreement
from fpmatch.gallery.index.terms import print_terms, probe_terms
from fpmatch.lab.synthesis.presets import preset_named
from fpmatch.lab.synthesis.sensor import SENSORS
from fpmatch.lab.synthesis.templates import make_templates
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.matchers.unit_circle import MATCHER
from research.commands import PATH, Command, write_json

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.matching.prints.prepare import PreparedTemplate
    from fpmatch.templates.minutiae import Template

    Impressions = tuple[float, tuple[Template, ...]]  # of one finger, and what it counts

NORMAL: Final = preset_named("normal")
CAREFUL: Final = replace(
    NORMAL, name="normal, placed with care", placement=preset_named("easy").placement
)
FAIR: Final = replace(
    NORMAL,
    name="normal, of fair skin",
    pressure=replace(
        NORMAL.pressure,
        dryness=(-0.45, 0.5),
        unevenness=0.16,
        beading=(0.02, 0.2),
        middle=(0.0, 0.2),
        wear=(0.0, 0.2),
        max_scratches=2,
    ),
)
PRESETS: Final = ((CAREFUL, 4.0), (FAIR, 1.0))  # with what a mate of each counts
EASY: Final = 0.4
"""Share of mates that no stage loses, as of the presets clean and easy: none of them are made.

With it, the shares of mates that rank behind 1, 3 and 10 % of the prints by votes are those of the
databases of FVC, and a larger share ranks behind 0.1 % by votes and descriptors.
"""
SEED: Final = 901
GALLERY_SEED: Final = 931
# of galleries
PRINTS: Final = tuple(int(k * 10**power) for power in range(4, 8) for k in (1, 3))
BUDGETS: Final = (0.1, 0.15, 0.2, 0.3, 0.45)
LOSSES: Final = (0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2)
PASSED_ON: Final = 0.2  # about the share of prints to whose scores those of a probe are normalized
TAIL: Final = 0.01  # share of the prints whose scores make the tail
RIDGES_OF: Final = 0.02  # share of the prints whose ridges are compared, and of these the tail
RIDGES_TAIL: Final = 0.1
SHARES: Final = 60  # that the first two stages may pass on, among which the fastest are chosen,
SPACING: Final = 3  # the power by which they lie closer where more mates are lost
LEAST_MATES: Final = 100  # that count, for a row of the table of its own


@click.command(
    cls=Command,
    epilog="""\b
Example:
  python -m research train index
""",
)
@click.option("--into", type=PATH, default=MODEL_FILE, help="File to write.")
@click.option("--mates", default=4800, show_default=True, help="Pairs of prints of one finger.")
@click.option("--others", default=8000, show_default=True, help="Prints they are ranked among.")
def command(into: Path, mates: int, others: int) -> None:
    """Train the index of large galleries on synthetic prints.

    The shares of the terms are counted in the prints of other fingers. Then each mate is ranked
    among these prints, by its votes with each budget of postings, by votes and bit descriptors, and
    by these and ridges. In a gallery a mate counts by the probability that a comparison with all
    prints finds it: that none of them, of its FMR, scores higher. The same package writes the same
    file.
    """
    into.parent.mkdir(parents=True, exist_ok=True)
    check_writable(into)
    if not 0 < others <= MOST_PRINTS:
        raise click.BadParameter(f"between 1 and {MOST_PRINTS} prints", param_hint="--others")
    with click.progressbar(gallery_prints(others), length=others, label="prints") as counted:
        prints = [template for _, (template,) in counted]
    gallery = segment_of(prints)
    terms = np.concatenate([print_terms(MATCHER.prepare(print_))[0] for print_ in prints])
    model = model_of_edges(terms, len(prints))
    with click.progressbar(mated_prints(mates), length=mates, label="mates") as pairs:
        table = measure(model, gallery, pairs)
    provenance = {
        "presets": [[preset.name, weight] for preset, weight in PRESETS],
        "mates": mates,
        "others": others,
        "seeds": [SEED, GALLERY_SEED],
        "version": fpmatch.__version__,
        "command": "python -m research train index",
    }
    write_json(into, {"provenance": provenance, **document_of(model, table)})
    click.echo(into)


def document_of(model: IndexModel, table: LossTable) -> dict[str, Any]:
    """Return a model and its table of losses as the document of a file, with rounded numbers."""
    shares = {
        name: _rounded(getattr(model, name), 4) for name in ("lengths", "directions", "edges")
    }
    loss = {name: _rounded(getattr(table, name), 3) for name in LossTable.__slots__}
    return {**shares, "loss": loss}


def _rounded(numbers: NDArray[np.float64] | float, digits: int) -> Any:
    return np.vectorize(lambda value: float(f"{value:.{digits}g}"), [np.float64])(numbers).tolist()


def model_of_edges(term: NDArray[np.uint16], prints: int) -> IndexModel:
    """Return the model of the edges of so many prints, given by their terms."""
    shape = SECTORS, SECTORS, CURVATURES
    length, directions = np.divmod(term.astype(np.int64), np.prod(shape))
    counted = np.bincount(directions, minlength=np.prod(shape)).reshape(shape)
    # an edge is read from either of its ends, from which its sides change places
    half = SECTORS // 2
    other = np.roll(counted.transpose(1, 0, 2), (half, half), (0, 1))
    other = other[:, :, [*range(CURVATURES - 2, -1, -1), CURVATURES - 1]]
    both = (counted + other) / max(2 * len(term), 1)
    shares = np.bincount(length, minlength=LENGTHS) / max(len(term), 1)
    return IndexModel(shares, both, len(term) / max(prints, 1))


def gallery_prints(count: int) -> Iterator[Impressions]:
    """Yield prints of different synthetic fingers."""
    return _impressions(GALLERY_SEED, count, 1)


def mated_prints(count: int) -> Iterator[Impressions]:
    """Yield two prints each of synthetic fingers."""
    return _impressions(SEED, count, 2)


def _impressions(seed: int, count: int, impressions: int) -> Iterator[Impressions]:
    """Yield so many prints each of fingers, of all presets and sensors in turn."""
    families = list(product(PRESETS, sorted(SENSORS)))
    fingers = range(-(-count // len(families)))
    made = [
        (weight, make_templates(seed + k, fingers, impressions, preset=preset, sensors=(sensor,)))
        for k, ((preset, weight), sensor) in enumerate(families)
    ]
    for k in range(count):
        weight, templates = made[k % len(made)]
        yield weight, tuple(islice(templates, impressions))


def measure(model: IndexModel, gallery: PrintSegment, pairs: Iterable[Impressions]) -> LossTable:
    """Return the shares of a gallery that rank before mates."""
    calibration = load_calibration(MATCHER.name)
    score, rank, weight = [], [], []
    for counts, (mate, other) in pairs:
        probe = MATCHER.prepare(other)
        score.append(calibration.score(MATCHER.compare(probe, MATCHER.prepare(mate)).similarity))
        rank.append(ranks(model, gallery, probe, mate))
        weight.append(counts)
    return table_of(np.array(score), np.array(rank), np.array(weight))


def ranks(
    model: IndexModel, gallery: PrintSegment, probe: PreparedTemplate, mate: Template
) -> NDArray[np.float64]:
    """Return the shares of the gallery that rank before a mate, (3, B), by stage and budget."""
    parts, count = (gallery, segment_of([mate])), len(gallery)
    scores = np.concatenate([one.descriptors.scores(probe) for one in parts])
    sizes = np.concatenate([one.descriptors.size for one in parts])
    shares, agreement = np.empty((3, len(BUDGETS))), np.full(count + 1, np.nan)
    agreement[count:] = _agreement(probe, parts[1], np.zeros(1, np.intp))
    for k, budget in enumerate(BUDGETS):
        terms = probe_terms(probe, budget, model)
        votes = np.concatenate([one.terms.votes(terms) for one in parts])
        passed = np.flatnonzero(votes[:-1] >= np.quantile(votes[:-1], 1 - PASSED_ON))
        by_size = SizeNormalization.fit(scores[passed], sizes[passed], len(probe))
        combined = with_votes(by_size.of(scores, sizes), votes)
        listed = np.argsort(-combined[:-1], kind="stable")[: int(RIDGES_OF * count)]
        new = listed[np.isnan(agreement[listed])]
        agreement[new] = _agreement(probe, gallery, new)
        among = np.append(listed, count)
        fused = with_ridges(combined[among], agreement[among])
        shares[0, k] = share_before(votes[:-1], votes[-1])
        shares[1, k] = share_before(combined[:-1], combined[-1])
        shares[2, k] = RIDGES_OF * share_before(fused[:-1], fused[-1], RIDGES_TAIL)
    return shares


def _agreement(
    probe: PreparedTemplate, prints: PrintSegment, which: NDArray[np.intp]
) -> NDArray[np.float64]:
    """Return how well ridges agree, all of which are known: 0 where prints cannot be aligned."""
    return np.nan_to_num(ridge_agreement(probe, prints.descriptors, prints.templates, which))


def share_before(others: NDArray[np.generic], own: float, tail: float = TAIL) -> float:
    """Return the share of others that score as high as one's own."""
    scores = others.astype(np.float64)
    start = float(np.quantile(scores, 1 - tail))
    beyond = scores[scores > start]
    if own <= start or not len(beyond):
        return float((scores >= own).mean())
    return len(beyond) / len(scores) * float(np.exp((start - own) / (beyond - start).mean()))


def table_of(
    score: NDArray[np.float64], rank: NDArray[np.float64], counts: NDArray[np.float64]
) -> LossTable:
    """Return the table of mates with these scores (M,), ranks (M, 3, B), and weights (M,)."""
    found = np.ones((len(PRINTS), len(BUDGETS), len(LOSSES), 3))
    for k, prints in enumerate(PRINTS):
        weight = np.exp(-prints * 10 ** (-0.1 * score))
        if weight.sum() < LEAST_MATES and k:
            found[k] = found[k - 1]
            continue
        weight *= counts
        for b, budget in enumerate(BUDGETS):
            found[k, b] = shares_to_pass_on(rank[:, :, b], weight, budget)
    prints_, budgets, losses = (np.array(axis, np.float64) for axis in (PRINTS, BUDGETS, LOSSES))
    scores = 10 * np.log10(prints_)
    return LossTable(prints_, scores, budgets, losses, *np.moveaxis(found, -1, 0))


def shares_to_pass_on(
    rank: NDArray[np.float64], weight: NDArray[np.float64], budget: float
) -> NDArray[np.float64]:
    """Return the shares that the three stages pass on at the least cost, for each loss: (L, 3).

    `rank` (M, 3) are the shares that the stages rank before each mate, which counts as `weight`
    states. With a smaller loss, no stage passes fewer prints on.
    """
    found = np.ones((len(LOSSES), 3))
    order = np.argsort(-rank[:, 2], kind="stable")
    if not weight.sum():
        return found
    rank, weight = rank[order], weight[order] * ((1 - EASY) / weight.sum())
    levels = np.linspace(0, 1, SHARES) ** SPACING
    shares = [np.unique(np.quantile(one, 1 - levels, method="higher")) for one in rank.T[:2]]
    least = np.zeros(3)
    for k in reversed(range(len(LOSSES))):
        best = np.inf
        for first, second in product(
            *(np.maximum(s, a) for s, a in zip(shares, least, strict=False))
        ):
            beyond = (rank[:, 0] > first) | (rank[:, 1] > second)
            lost = np.cumsum(np.where(beyond, 0.0, weight)) + weight[beyond].sum()
            if weight[beyond].sum() > LOSSES[k]:
                continue
            kept = np.flatnonzero((lost > LOSSES[k]) & ~beyond)
            third = max(rank[kept[0], 2] if len(kept) else 0.0, least[2])
            taken = cost(budget, (first, second, third), 1.0)
            if taken < best:
                best, found[k] = taken, (first, second, third)
        least = found[k]
    return found


def segment_of(prints: Sequence[Template]) -> PrintSegment:
    """Return a segment of prints, numbered in their order."""
    return PrintSegment.build([(k, k, t, MATCHER.prepare(t)) for k, t in enumerate(prints)])
