"""Attacks on revocable templates: link those of two keys, open those of a key that is known."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.lab.evaluation.rates.error_rates import error_rates
from fpmatch.matching.calibration import fmr_to_score, load_calibration
from fpmatch.matching.prints.prepare import prepare
from fpmatch_revocable.cells import DIRECTION_SECTORS, DISTANCES, GRIDS, SECTORS, pair_cells
from fpmatch_revocable.command import DEFAULT_FMR
from fpmatch_revocable.compare import shared_words, similarity
from fpmatch_revocable.matcher import CALIBRATION, MATCHER
from fpmatch_revocable.template import RevocableTemplate, protect, words_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import ArrayLike, NDArray

    from fpmatch.gallery.encryption.keys import Key
    from fpmatch.templates.minutiae import Template


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


ORDERS: Final = 400  # random orders of the templates of one side, for the D_sys by chance
CELLS: Final = GRIDS * (DISTANCES * SECTORS * DIRECTION_SECTORS) ** 2  # that there can be
CELLS_AT_ONCE: Final = 1 << 20
STRANGERS_EACH: Final = 4  # of so many prints one is compared with templates of other fingers
_HALF: Final = 1 << 16  # values of half a word


class Attack(NamedTuple):
    """A judgement of two templates of different keys: features of each, and their agreement."""

    features: Callable[[RevocableTemplate], Any]
    agreement: Callable[[Any, Any], float]


@dataclass(frozen=True, eq=False)
class PrintSet:
    """The templates of a database, and the finger of each."""

    templates: Sequence[Template]
    fingers: NDArray[np.int64]

    @property
    def mated(self) -> NDArray[np.bool_]:
        """Which pairs of templates are of one finger, shape (N, N)."""
        return np.asarray(self.fingers[:, None] == self.fingers)


def _nearness(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    return -float(np.abs(a - b).sum())


def _correlation(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    spread = float(a.std() * b.std())
    return float(((a - a.mean()) * (b - b.mean())).mean()) / spread if spread else 0.0


def _common(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> float:
    return float(np.minimum(a, b).sum(dtype=np.int64))


def _halves(shift: int) -> Callable[[RevocableTemplate], NDArray[np.uint8]]:
    """Return how often each value of half a word occurs, up to 255 times."""

    def counts(one: RevocableTemplate) -> NDArray[np.uint8]:
        values = (one.words.ravel() >> shift) & (_HALF - 1)
        return np.minimum(np.bincount(values, minlength=_HALF), 255).astype(np.uint8)

    return counts


def _bytes(shift: int) -> Callable[[RevocableTemplate], NDArray[np.float64]]:
    return lambda one: np.bincount((one.words.ravel() >> shift) & 255, minlength=256).astype(float)


def _bits(one: RevocableTemplate) -> NDArray[np.bool_]:
    return (one.words[..., None] >> np.arange(32, dtype=np.uint32) & 1).astype(bool)


def _quantiles(one: RevocableTemplate) -> NDArray[np.float64]:
    return np.quantile(one.words.astype(np.float64), [0.1, 0.3, 0.5, 0.7, 0.9], axis=1)


def _repeated(one: RevocableTemplate) -> NDArray[np.float64]:
    return np.array([one.words.size - len(np.unique(one.words))], float)


def _itself(one: RevocableTemplate) -> RevocableTemplate:
    return one


# Judgements whose templates differ in key: by all that a word, a row or the template shows.
ATTACKS: Final = {
    "similarity, as templates of one key are compared": Attack(_itself, similarity),
    "words in common": Attack(_itself, lambda a, b: float(shared_words(a, b).sum())),
    "high 16 bits in common": Attack(_halves(16), _common),
    "low 16 bits in common": Attack(_halves(0), _common),
    "histogram of the highest bytes": Attack(_bytes(24), _nearness),
    "histogram of the lowest bytes": Attack(_bytes(0), _nearness),
    "words that occur twice": Attack(_repeated, _nearness),
    "order of rows: their means": Attack(lambda one: one.words.mean(axis=1), _correlation),
    "order of rows: their first words": Attack(
        lambda one: one.words[:, 0].astype(np.float64), _nearness
    ),
    "distributions of the words of the rows": Attack(_quantiles, _nearness),
    "set bits by place in the word": Attack(lambda one: _bits(one).mean((0, 1)), _correlation),
    "set bits by row": Attack(lambda one: _bits(one).mean((1, 2)), _correlation),
    "set bits in all": Attack(lambda one: np.array([_bits(one).mean()]), _nearness),
}
SAME_KEY: Final = "similarity, one key for both (for comparison: linked by design)"


def linkability(sets: Sequence[PrintSet], keys: tuple[Key, Key]) -> list[dict[str, Any]]:
    """Return, for each attack, how well it links templates of two keys, one known or none.

    A template whose key is known has its cells in place of the words, and 0 for the others.
    """
    made = [[protect(template, key) for template in one.templates] for one in sets for key in keys]
    hidden, others = made[::2], made[1::2]
    known = [
        [
            open_template(a, template, keys[0])
            for a, template in zip(row, one.templates, strict=True)
        ]
        for row, one in zip(hidden, sets, strict=True)
    ]
    rows = [
        {
            "attack": name,
            "unknown": judged(sets, attack, hidden, others),
            "known": judged(sets, attack, known, others),
        }
        for name, attack in ATTACKS.items()
    ]
    by_design = judged(sets, Attack(_itself, similarity), hidden, hidden)
    return [*rows, {"attack": SAME_KEY, "unknown": None, "known": by_design}]


def judged(
    sets: Sequence[PrintSet],
    attack: Attack,
    left: Sequence[Sequence[RevocableTemplate]],
    right: Sequence[Sequence[RevocableTemplate]],
) -> dict[str, float]:
    """Return D_sys and EER of an attack, and the largest D_sys in random order."""
    values = np.concatenate(
        [_agreements(attack, *sides) for sides in zip(left, right, strict=True)]
    )
    rng = np.random.default_rng(0)

    def mixed() -> NDArray[np.bool_]:
        orders = [rng.permutation(len(one.fingers)) for one in sets]
        pairs = [one.mated[:, order].ravel() for one, order in zip(sets, orders, strict=True)]
        return np.concatenate(pairs)

    mated = np.concatenate([one.mated.ravel() for one in sets])
    return {
        "d_sys": d_sys(values[mated], values[~mated]),
        "by_chance": max(d_sys(values[m], values[~m]) for m in (mixed() for _ in range(ORDERS))),
        "eer": float(error_rates(values[mated], values[~mated]).eer or 0.0),
        "mated": int(mated.sum()),
        "non_mated": int((~mated).sum()),
    }


def _agreements(
    attack: Attack, left: Sequence[RevocableTemplate], right: Sequence[RevocableTemplate]
) -> NDArray[np.float64]:
    """Return the agreement of each template of the left side with each of the right."""
    a, b = ([attack.features(template) for template in side] for side in (left, right))
    return np.array([attack.agreement(one, other) for one in a for other in b], float)


def open_template(made: RevocableTemplate, template: Template, key: Key) -> RevocableTemplate:
    """Return what a dictionary of all cells makes of a template: cells, and 0 for other words."""
    cells, _ = pair_cells(prepare(template))
    words = words_of(cells, key)
    order = np.argsort(words, kind="stable")
    place = np.minimum(np.searchsorted(words[order], made.words), max(len(words) - 1, 0))
    opened = np.zeros_like(made.words)
    if len(words):
        same = words[order][place] == made.words
        opened[same] = cells[order][place[same]]
    return RevocableTemplate(opened, made.key_id)


def try_all_cells(templates: Sequence[Template], key: Key) -> dict[str, float]:
    """Return what a dictionary of all cells finds in templates of a known key, and its time.

    `right`: share of the cells it finds that are of the template.
    """
    made = [protect(template, key) for template in templates]
    stored = np.unique(np.concatenate([one.words.ravel() for one in made]))
    begin = time.process_time()
    met = []
    for first in range(0, CELLS, CELLS_AT_ONCE):
        words = words_of(np.arange(first, min(first + CELLS_AT_ONCE, CELLS)), key)
        place = np.minimum(np.searchsorted(stored, words), len(stored) - 1)
        met.append(words[stored[place] == words])
    seconds = time.process_time() - begin
    dictionary = np.sort(np.concatenate(met))  # a word as often as cells have it
    hits = 0
    for one in made:
        beyond, at = (dictionary.searchsorted(one.words, side) for side in ("right", "left"))
        hits += int((beyond - at).sum())
    cells = sum(
        np.count_nonzero(open_template(one, template, key).words)
        for one, template in zip(made, templates, strict=True)
    )
    return {"cells": CELLS, "seconds": seconds, "templates": len(made), "right": cells / hits}


def try_dictionary(
    sets: Sequence[PrintSet], keys: tuple[Key, Key], impostors: Sequence[Template]
) -> dict[str, dict[str, float]]:
    """Return what dictionaries of templates find, made with the key of the attacked or another.

    `match`: share of the prints that one of the templates of other fingers matches. `nearest`:
    share of the prints whose most similar one among the others of their database is of the same
    finger; `chance`: what a random choice finds.
    """
    scores = load_calibration(MATCHER.name, CALIBRATION).scores
    shares: dict[str, dict[str, float]] = {}
    for name, key in zip(("known", "unknown"), keys, strict=True):
        entries = [protect(template, key) for template in impostors]
        best, nearest, chance = [], [], []
        for one in sets:
            attacked = [protect(template, keys[0]) for template in one.templates]
            best += [
                max(similarity(template, entry) for entry in entries)
                for template in attacked[::STRANGERS_EACH]
            ]
            others = [protect(template, key) for template in one.templates]
            for k, template in enumerate(attacked):
                alike = np.array([_likeness(template, entry) for entry in others])
                alike[k] = -1.0
                mated = (one.fingers == one.fingers[k]) & (alike >= 0)
                nearest.append(mated[alike == alike.max()].mean())
                chance.append(mated.sum() / (len(mated) - 1))
        shares[name] = {
            "match": float(np.mean(scores(best) >= fmr_to_score(DEFAULT_FMR))),
            "nearest": float(np.mean(nearest)),
            "chance": float(np.mean(chance)),
        }
    return shares


def _likeness(a: RevocableTemplate, b: RevocableTemplate) -> float:
    """Return the similarity; among templates without any, the words in common decide."""
    return similarity(a, b) + 1e-6 * float(shared_words(a, b).sum())
