"""The command that trains the index of large galleries: rarity of its terms, and losses."""

from __future__ import annotations

from itertools import islice, product
from typing import TYPE_CHECKING, Any, Final

import click
import numpy as np

import fpmatch
from fpmatch.base.output import check_writable
from fpmatch.gallery.index.loss import BY_RIDGES, LossTable, cost, with_votes
from fpmatch.gallery.index.model import CURVATURES, LENGTHS, MODEL_FILE, SECTORS, IndexModel
from fpmatch.gallery.index.prints.descriptor_scores import SizeNormalization, prefilter_scores
from fpmatch.gallery.index.prints.prepared_prints import PreparedPrints
from fpmatch.gallery.index.segment import MAX_PRINTS, Segment
from fpmatch.gallery.index.terms import print_terms, probe_terms
from fpmatch.lab.synthesis.sensor import SENSORS
from fpmatch.lab.synthesis.templates import make_templates
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.matchers.unit_circle import MATCHER
from research.commands import PATH, Command, write_json
from research.databases import extract_folders, prints_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.databases.extraction import ExtractedSet
    from fpmatch.matching.prints.prepared import PreparedTemplate

    Probe = tuple[int, PreparedTemplate, list[PreparedTemplate]]
    """The number of a database, a print of it, and mates of the print."""

PRESETS: Final = ("clean", "easy", "normal", "stretched")  # of synthetic prints
SEED: Final = 901
GALLERY_SEED: Final = 931
# of galleries
PRINTS: Final = tuple(int(k * 10**power) for power in range(4, 9) for k in (1, 3))
BUDGETS: Final = (0.05, 0.1, 0.15, 0.2, 0.3, 0.45, 0.7, 1.0)
LOSSES: Final = (0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2)
PASSED_ON: Final = 0.2  # about the share of prints to whose scores those of a probe are normalized
TAIL: Final = 0.01  # share of the prints whose scores make the tail
SHARES: Final = 400  # that the first stage may pass on, among which the fastest is chosen
OF_TWO_STAGES: Final = 0.75  # share of a loss; the rest is left to the third stage
TIMES_THE_LOSS: Final = 2.0  # that a single database may lose
LEAST_MATES: Final = 100  # that count, for a row of the table of its own
PROBES: Final = 80  # of a database, at most,
MATES: Final = 7  # and mates of each


@click.command(
    cls=Command,
    epilog="""\b
Example:
  python -m research train index prints/db1 prints/db2
""",
)
@click.argument("folders", metavar="[DIR]...", nargs=-1, type=PATH)
@click.option("--into", type=PATH, default=MODEL_FILE, help="File to write.")
@click.option("--mates", default=6000, show_default=True, help="Pairs of prints of one finger.")
@click.option("--others", default=8000, show_default=True, help="Prints they are ranked among.")
def command(folders: tuple[Path, ...], into: Path, mates: int, others: int) -> None:
    """Train the index of large galleries on synthetic prints, and on the mates of databases.

    The shares of the terms are counted in synthetic prints of other fingers. Then each mate is
    ranked among these prints, by its votes with each budget of postings, and by votes and bit
    descriptors. In a gallery a mate counts by the probability that a comparison with all prints
    ranks it first. Each print has a higher score with the FMR of the mate's score. The mates are
    prints of the FVC-style databases DIR, where some are given, else synthetic; no database loses
    more than twice the share stated. The same package writes the same file.
    """
    into.parent.mkdir(parents=True, exist_ok=True)
    check_writable(into)
    if not 0 < others <= MAX_PRINTS:
        raise click.BadParameter(f"between 1 and {MAX_PRINTS} prints", param_hint="--others")
    databases = extract_folders(folders)
    with click.progressbar(gallery_prints(others), length=others, label="prints") as counted:
        prints = list(counted)
    terms = np.concatenate([print_terms(print_)[0] for print_ in prints])
    model = model_of_edges(terms, len(prints))
    probes = database_probes(databases) if databases else synthetic_probes(mates)
    of_all = None if databases else mates
    with click.progressbar(probes, length=of_all, label="mates") as counted_probes:
        table = measure(model, prints, counted_probes)
    names = [extracted.dataset.name for extracted in databases]
    provenance = {
        "presets": PRESETS,
        **({"databases": names} if names else {"mates": mates}),
        "others": others,
        "seeds": [SEED, GALLERY_SEED],
        "version": fpmatch.__version__,
        "command": "python -m research train index" + " DIR..." * bool(names),
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


def gallery_prints(count: int) -> Iterator[PreparedTemplate]:
    """Yield prints of different synthetic fingers."""
    return (print_ for (print_,) in _impressions(GALLERY_SEED, count, 1))


def synthetic_probes(count: int) -> Iterator[Probe]:
    """Yield prints of synthetic fingers, and of each another print, its mate."""
    return ((0, probe, [mate]) for mate, probe in _impressions(SEED, count, 2))


def database_probes(databases: Sequence[ExtractedSet]) -> Iterator[Probe]:
    """Yield prints of FVC-style databases, evenly chosen, and of each some mates."""
    for number, extracted in enumerate(databases):
        kept = prints_of(extracted)
        prints = [MATCHER.prepare(template) for _, template in kept]
        for probe in range(0, len(kept), -(-len(kept) // PROBES)):
            finger = kept[probe][0].finger
            mates = [k for k, (shown, _) in enumerate(kept) if shown.finger == finger]
            mates.remove(probe)
            yield number, prints[probe], [prints[k] for k in mates[:: -(-len(mates) // MATES) or 1]]


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
    probes: Iterable[Probe],
) -> LossTable:
    """Return the shares of `prints` that rank before the mates of probes."""
    several = PreparedPrints.pack(prints)
    gallery = segment_of(prints)
    calibration = load_calibration(MATCHER.name)
    score: list[float] = []
    rank: list[NDArray[np.float64]] = []
    of: list[int] = []
    for database, probe, mates in probes:
        of += [database] * len(mates)
        score += [calibration.score(MATCHER.compare(probe, mate).similarity) for mate in mates]
        rank += [*ranks(model, gallery, several, probe, mates)]
    return table_of(np.array(score), np.array(rank), np.array(of))


def ranks(
    model: IndexModel,
    gallery: Segment,
    several: PreparedPrints,
    probe: PreparedTemplate,
    mates: list[PreparedTemplate],
) -> NDArray[np.float64]:
    """Return the shares of the gallery that rank before mates, (M, 2, B), by stage and budget."""
    alone, packed = segment_of(mates), PreparedPrints.pack(mates)
    scores, sizes = prefilter_scores(probe, several), np.diff(several.minutiae_start)
    own_scores, own_sizes = prefilter_scores(probe, packed), np.diff(packed.minutiae_start)
    found = np.empty((len(mates), 2, len(BUDGETS)))
    for k, budget in enumerate(BUDGETS):
        terms = probe_terms(probe, budget, model)
        votes, own = gallery.votes(terms), alone.votes(terms)
        passed = votes >= np.quantile(votes, 1 - PASSED_ON)
        by_size = SizeNormalization.fit(scores[passed], sizes[passed], len(probe))
        others = with_votes(by_size.of(scores, sizes), votes)
        of_mates = with_votes(by_size.of(own_scores, own_sizes), own)
        found[:, 0, k] = [share_before(votes, one) for one in own]
        found[:, 1, k] = [share_before(others, one) for one in of_mates]
    return found


def share_before(others: NDArray[np.generic], own: float) -> float:
    """Return the share of others that score as high as one's own."""
    scores = others.astype(np.float64)
    start = float(np.quantile(scores, 1 - TAIL))
    beyond = scores[scores > start]
    if own <= start or not len(beyond):
        return float((scores >= own).mean())
    return len(beyond) / len(scores) * float(np.exp((start - own) / (beyond - start).mean()))


def table_of(
    score: NDArray[np.float64], rank: NDArray[np.float64], database: NDArray[np.int64]
) -> LossTable:
    """Return the table of mates with these scores (M,), ranks (M, 2, B) and databases (M,)."""
    found = np.ones((len(PRINTS), len(BUDGETS), len(LOSSES), 2))
    for k, prints in enumerate(PRINTS):
        weight = np.exp(-prints * 10 ** (-0.1 * score))
        if weight.sum() < LEAST_MATES and k:
            found[k] = found[k - 1]
            continue
        for b, budget in enumerate(BUDGETS):
            found[k, b] = shares_to_pass_on(rank[:, :, b], weight, database, budget)
    prints_, budgets, losses = (np.array(axis, np.float64) for axis in (PRINTS, BUDGETS, LOSSES))
    return LossTable(prints_, budgets, losses, found[..., 0], found[..., 1])


def shares_to_pass_on(
    rank: NDArray[np.float64],
    weight: NDArray[np.float64],
    database: NDArray[np.int64],
    budget: float,
) -> NDArray[np.float64]:
    """Return the shares that the two stages pass on at the least cost, for each loss: (L, 2).

    `rank` (M, 2) are the shares that either stage ranks before each mate, which counts as `weight`
    states. Of all mates no more are lost, and of one `database` no more than twice as many, or one.
    With a smaller loss, no stage passes fewer prints on.
    """

    def work(by_terms: float, by_descriptors: float) -> float:
        return cost(budget, by_terms, by_descriptors, BY_RIDGES * by_descriptors, 1.0)

    found = np.ones((len(LOSSES), 2))
    order = np.argsort(-rank[:, 1], kind="stable")
    first, second = rank[order].T
    of_each = [database[order] == one for one in np.unique(database)]
    weights = weight[order] * np.array([np.ones(len(order), bool), *of_each])
    if not weight.sum():
        return found
    shares = np.unique(np.quantile(first, np.linspace(0, 1, SHARES), method="higher"))
    least = np.zeros(2)
    for k in reversed(range(len(LOSSES))):
        allowed = OF_TWO_STAGES * LOSSES[k] * weights.sum(axis=1, keepdims=True)
        allowed[1:] = np.maximum(TIMES_THE_LOSS / OF_TWO_STAGES * allowed[1:], 1.0)
        best = np.inf
        for share in np.maximum(shares, least[0]):
            if work(share, least[1]) >= best:
                break
            by_first = first > share
            lost = weights[:, by_first].sum(axis=1, keepdims=True)
            if (lost > allowed).any():
                continue
            lost = lost + np.cumsum(np.where(by_first, 0.0, weights), axis=1)
            needed = np.flatnonzero((lost > allowed).any(axis=0) & ~by_first)
            passed = max(second[needed[0]] if len(needed) else 0.0, least[1])
            if work(share, passed) < best:
                best, found[k] = work(share, passed), (share, passed)
        least = found[k]
    return found


def segment_of(prints: list[PreparedTemplate]) -> Segment:
    """Return a segment of prints, numbered in their order."""
    numbers = np.arange(len(prints))
    return Segment.build(numbers, numbers, prints)
