"""What revocable templates cost and hold: error rates, linkability of templates of two keys."""

from __future__ import annotations

import os
import statistics
import sys
from dataclasses import asdict, dataclass
from functools import partial
from itertools import combinations, pairwise
from timeit import timeit
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from scipy.spatial import Delaunay

from fpmatch.base.encryption.keys import Key
from fpmatch.lab.evaluation.rates.error_rates import error_rates
from research.all_pairs import compare_all_pairs
from research.commands import ROOT

sys.path.append(str(ROOT / "examples" / "revocable"))

import click

from fpmatch.lab.evaluation.databases.extraction import extract_datasets
from fpmatch.lab.evaluation.run import load_datasets
from fpmatch_revocable.compare import shared_words, similarity
from fpmatch_revocable.template import protect
from research.commands import Command, folders, json_file, workers, write_json
from research.tables.revocable import format_revocable

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path
    from typing import Self

    from numpy.typing import ArrayLike, NDArray

    from fpmatch.lab.evaluation.databases.extraction import ExtractedSet
    from fpmatch.templates.minutiae import Template
    from fpmatch_revocable.template import RevocableTemplate

KEYS: Final = 2
SPEED_PAIRS: Final = 200
DELAUNAY_POINTS: Final = 40
# How an attacker without the keys, or with both, may judge two templates of different keys.
ATTACKS: Final[dict[str, Callable[[RevocableTemplate, RevocableTemplate], float]]] = {
    "similarity, as templates of one key are compared": similarity,
    "words in common": lambda a, b: float(shared_words(a, b).sum()),
    "distributions of the words of the rows": lambda a, b: (
        -float(np.abs(_row_quantiles(a) - _row_quantiles(b)).mean())
    ),
    "words that occur twice": lambda a, b: -float(abs(_repeated(a) - _repeated(b))),
}


@dataclass(frozen=True, slots=True)
class _Judged:
    """Judgements of pairs of impressions of one finger, and of different fingers."""

    mated: NDArray[np.float64]
    non_mated: NDArray[np.float64]

    @classmethod
    def of(cls, values: NDArray[np.float64], mated: NDArray[np.bool_]) -> Self:
        """Divide the judgements of all pairs."""
        return cls(values[mated], values[~mated])


def measure_revocable(sets: Sequence[ExtractedSet]) -> dict[str, Any]:
    """Return error rates by database, linkability by attack, sizes and times."""
    keys = [Key(os.urandom(32)) for _ in range(KEYS)]
    rates: list[dict[str, Any]] = []
    judged: dict[str, list[_Judged]] = {name: [] for name in (*ATTACKS, _SAME_KEY)}
    every: list[Template] = []
    for one in sets:
        found = [
            (impression.finger, e.template)
            for impression, e in zip(one.dataset.impressions, one.extractions, strict=True)
            if e.template is not None
        ]
        templates = [template for _, template in found]
        made = [[protect(template, key) for template in templates] for key in keys]
        mated = np.array([a == b for (a, _), (b, _) in combinations(found, 2)])
        same = _Judged.of(_judge(similarity, made[0], made[0]), mated)
        plain = _Judged.of(compare_all_pairs(templates), mated)
        rates.append(
            {
                "name": one.dataset.name,
                "revocable": asdict(error_rates(same.mated, same.non_mated)),
                "minutiae": asdict(error_rates(plain.mated, plain.non_mated)),
            }
        )
        judged[_SAME_KEY].append(same)
        for name, attack in ATTACKS.items():
            judged[name].append(_Judged.of(_judge(attack, *made), mated))
        every += templates
    return {
        "sets": rates,
        "linkability": [{"attack": name, **_linkability(judged[name])} for name in judged],
        **_costs(every, keys[0]),
    }


_SAME_KEY: Final = "similarity, with one key for both (for comparison: linked by design)"


def _judge(
    judge: Callable[[RevocableTemplate, RevocableTemplate], float],
    left: Sequence[RevocableTemplate],
    right: Sequence[RevocableTemplate],
) -> NDArray[np.float64]:
    """Return the judgements of all pairs of impressions, one of each sequence."""
    return np.array([judge(left[i], right[j]) for i, j in combinations(range(len(left)), 2)])


def _linkability(parts: Sequence[_Judged]) -> dict[str, float]:
    """Return D_sys of all databases together, and that of the same judgements in random order."""
    mated = np.concatenate([one.mated for one in parts])
    non_mated = np.concatenate([one.non_mated for one in parts])
    mixed = np.random.default_rng(0).permutation(np.concatenate([mated, non_mated]))
    return {
        "d_sys": d_sys(mated, non_mated),
        "by_chance": d_sys(mixed[: len(mated)], mixed[len(mated) :]),
        "mated": len(mated),
        "non_mated": len(non_mated),
    }


def _costs(templates: Sequence[Template], key: Key) -> dict[str, float]:
    """Return bytes of a template, and times as ratios to scipy's Delaunay of 40 points."""
    points = np.random.default_rng(0).uniform(0, 300, (DELAUNAY_POINTS, 2))
    some = templates[:SPEED_PAIRS]
    made = [protect(template, key) for template in some]
    for one in made:
        one.index  # noqa: B018  (sorted once for all comparisons)
    unit = _median_s([lambda: Delaunay(points)] * SPEED_PAIRS)
    pairs = [partial(similarity, a, b) for a, b in pairwise(made)]
    protected = [partial(protect, template, key) for template in some]
    return {
        "bytes": made[0].words.nbytes,
        "delaunay_us": unit * 1e6,
        "compare_ratio": _median_s(pairs) / unit,
        "protect_ratio": _median_s(protected) / unit,
    }


def _median_s(calls: Sequence[Callable[[], object]]) -> float:
    return statistics.median(timeit(call, number=1) for call in calls)


def _row_quantiles(template: RevocableTemplate) -> NDArray[np.float64]:
    return np.quantile(template.words.astype(np.float64), [0.1, 0.3, 0.5, 0.7, 0.9], axis=1)


def _repeated(template: RevocableTemplate) -> int:
    return template.words.size - len(np.unique(template.words))


@click.command(cls=Command)
@folders
@json_file
@workers
def command(folders: tuple[Path, ...], json_file: Path | None, workers: int | None) -> None:
    """Measure revocable templates of the prints of FVC-style databases DIR.

    All impressions of a database are compared, those of one finger as genuine pairs: as revocable
    templates of one key, and by the default matcher. Templates of two random keys are judged by
    each attack; D_sys (ISO/IEC 30136) is 0 where mated and non-mated pairs are judged alike.

    --json writes what ``python -m research tables revocable --measured`` reads.
    """
    found = measure_revocable(extract_datasets(load_datasets(folders), workers=workers))
    click.echo(format_revocable({"measured": found}))
    if json_file:
        write_json(json_file, found)


def d_sys(mated: ArrayLike, non_mated: ArrayLike, *, omega: float = 1.0) -> float:
    """Return how far judgements tell pairs of one finger from others: 0 not at all, 1 always.

    Both distributions are estimated by histograms of the same bins, which contain about as many
    judgements each, a bin for each value where there are few: about the square root of the number
    of mated ones. `mated`, `non_mated` (M,): judgements of pairs of templates of one finger, and of
    different fingers. `omega`: ratio of the prior probabilities of both.

    By Gomez-Barrero, Galbally, Rathgeb, Busch: General framework to evaluate unlinkability in
    biometric template protection systems, IEEE TIFS 13(6), 2018, eq. 4 to 8.
    """
    m, n = np.sort(np.asarray(mated, float)), np.sort(np.asarray(non_mated, float))
    edges = _edges(m, n)
    of_mated, of_others = _shares(m, edges), _shares(n, edges)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = omega * of_mated / of_others
        local = np.where(ratio > 1, 2 * ratio / (1 + ratio) - 1, 0.0)
    local[(of_others == 0) & (of_mated > 0)] = 1.0
    return float((of_mated * local).sum())


def _edges(mated: NDArray[np.float64], non_mated: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the lower ends of the bins."""
    bins = max(2, round(len(mated) ** 0.5))
    pooled = np.concatenate([np.quantile(s, np.arange(bins) / bins) for s in (mated, non_mated)])
    return np.unique(pooled)


def _shares(values: NDArray[np.float64], edges: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return which share of the values lies in each bin."""
    bins = np.searchsorted(edges, values, "right")
    return np.bincount(bins, minlength=len(edges) + 1) / len(values)
