"""How many prints each stage of a search passes on, for a wanted loss.

The loss is the share of the mates that comparing all prints would find and a search in stages does
not. What it takes is measured on mates of databases by ``python -m research train index``: with
each budget of postings, the share of other prints that the first stage ranks before a mate, by its
votes, and the second one, by votes and bit descriptors. In larger galleries, comparing all finds
fewer of the faint mates, so that smaller shares suffice. The same holds where candidates have to
reach a threshold. So a search looks in rounds, for clear mates first, and ends with a round that
finds one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import ceil, inf, log10
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.base.parsing import parse_json
from fpmatch.errors import MatcherError, number_text
from fpmatch.gallery.index.model import MODEL_FILE
from fpmatch.gallery.index.prints.descriptor_scores import size_normalized

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

DEFAULT_LOSS: Final = 0.01
EXHAUSTIVE_UP_TO: Final = 20_000  # prints, which are all compared by default
VOTE_WEIGHT: Final = 1 / 256
"""What a vote adds to the normalized score of the bit descriptors."""
RIDGE_WEIGHT: Final = 1.25
"""What a standard deviation of the agreement of ridges adds to it."""

# Costs in microseconds, for the choice among plans of the same loss: of a print of the gallery, and
# more by the budget; of one in the second, the third and the fourth stage.
COST: Final = (0.05, 0.16, 5.3, 75.0, 420.0)
LEAST_PASSED_ON: Final = (500, 10)
BY_RIDGES: Final = 1 / 16  # of the prints in the third stage, but at least so many
LEAST_BY_RIDGES: Final = 200
# Loss of the round before the last one, in a gallery so many times as large; it is left out where
# it costs more than a share of the last one.
TIMES: Final = 10
EARLY_LOSS: Final = 0.03
EARLY_SHARE: Final = 1 / 2


@dataclass(frozen=True, slots=True)
class SearchPlan:
    """The numbers by which a gallery is searched in stages."""

    loss: float  # share of the mates that the search is expected to lose
    budget: float  # postings a print that the first stage visits, for each minutia of the probe
    by_terms: int  # prints that the first stage passes on to the second,
    by_descriptors: int  # and this to the third, where ridges are compared in one place

    @property
    def by_ridges(self) -> int:
        """The prints that the third stage passes on to the comparison; all of a few."""
        return min(self.by_descriptors, max(ceil(BY_RIDGES * self.by_descriptors), LEAST_BY_RIDGES))

    def cost(self, prints: int) -> float:
        """Return about how many microseconds a search of so many prints takes."""
        aligned = self.by_descriptors if self.by_ridges < self.by_descriptors else 0
        return cost(self.budget, self.by_terms, aligned, self.by_ridges, prints)


@dataclass(frozen=True, slots=True, eq=False)
class LossTable:
    """The shares of a gallery that have to be passed on.

    `by_terms` and `by_descriptors`, shape (N, B, L), are the shares of the prints that the first
    and the second stage pass on, in a gallery of a size and with a budget, so that both together
    lose a share of the mates.
    """

    prints: NDArray[np.float64]  # (N,): sizes of galleries, ascending
    budgets: NDArray[np.float64]  # (B,): postings a print, for each minutia of the probe
    losses: NDArray[np.float64]  # (L,): shares of mates, ascending
    by_terms: NDArray[np.float64]
    by_descriptors: NDArray[np.float64]

    @classmethod
    def of_document(cls, document: Mapping[str, Any]) -> LossTable:
        """Return the table in the document of a model; raise MatcherError if it has none."""
        try:
            table = document["loss"]
            made = cls(**{name: np.array(table[name], np.float64) for name in cls.__slots__})
        except (LookupError, TypeError, ValueError) as error:
            raise MatcherError("no table of losses", code="malformed") from error
        axes = made.prints, made.budgets, made.losses
        shares = made.by_terms, made.by_descriptors
        rise = all(a.ndim == 1 and a.size and (np.diff(a, prepend=0) > 0).all() for a in axes)
        shape = made.prints.size, made.budgets.size, made.losses.size
        if not (rise and all(s.shape == shape and (np.abs(s - 0.5) <= 0.5).all() for s in shares)):
            raise MatcherError("no table of losses", code="malformed")
        return made

    def plan(self, loss: float, prints: int, threshold: float = 0.0, times: int = 1) -> SearchPlan:
        """Return the fastest plan of a loss; see `search_plan`."""
        if not 0 < loss < 1:
            raise MatcherError(f"a loss is between 0 and 1, not {number_text(loss)}")
        # mates of a score rank first in a gallery of a size
        size = max(times * prints, 10 ** (0.1 * threshold))
        row = max(int(np.searchsorted(self.prints, size, "right")), 1) - 1
        plans = []
        for budget, *stages in zip(
            self.budgets.tolist(), self.by_terms[row], self.by_descriptors[row], strict=True
        ):
            counts = [
                min(max(ceil(self._share(loss, shares) * prints), least), prints)
                for shares, least in zip(stages, LEAST_PASSED_ON, strict=True)
            ]
            counts[1] = min(counts)
            plans.append(SearchPlan(loss, budget, *counts))
        return min(plans, key=lambda plan: plan.cost(prints))

    def _share(self, loss: float, shares: NDArray[np.float64]) -> float:
        """Return the share of prints for a loss: all, where none is lost of the measured mates."""
        if loss < self.losses[0]:
            return 1.0
        return float(np.exp(np.interp(np.log(loss), np.log(self.losses), np.log(shares + 1e-9))))


def cost(
    budget: float, by_terms: float, by_descriptors: float, by_ridges: float, prints: float
) -> float:
    """Return about how many microseconds a search takes: of so many prints, passed on by stages."""
    each, visited, *stages = COST
    passed_on = by_terms, by_descriptors, by_ridges
    of_stages = (one * many for one, many in zip(stages, passed_on, strict=True))
    return prints * (each + visited * budget) + sum(of_stages)


@cache
def loss_table() -> LossTable:
    """Return the table of the package."""
    return LossTable.of_document(parse_json(MODEL_FILE.read_bytes()))


def search_plan(loss: float, prints: int, threshold: float = 0.0, times: int = 1) -> SearchPlan:
    """Return how a gallery of so many prints is searched, with a loss of at most this share.

    The loss, between 0 and 1 (else MatcherError), is the share of the mates that comparing all
    prints would find, and that the search may miss. Only mates above a `threshold` can be missed,
    and these are easier to find than those that reach the first rank in a gallery. With `times`,
    only mates that would reach it in a gallery so many times as large.

    Examples
    --------
    >>> careful, quick = (search_plan(loss, 1_000_000) for loss in (0.005, 0.05))
    >>> careful.by_terms > quick.by_terms > search_plan(0.05, 1_000_000, threshold=90).by_terms
    True
    """
    return loss_table().plan(loss, prints, threshold, times)


def search_rounds(
    loss: float, prints: int, threshold: float = 0.0, *, all_mates: bool = False
) -> list[tuple[SearchPlan, float]]:
    """Return the plans of the rounds of a search, and the score of a print that ends it after each.

    The last round is the `search_plan`, and the only one where `all_mates` are looked for. The
    first passes on the share of the prints that a gallery of ten times as many demands for a loss
    of 3 %, and ends the search at a score that a print reaches by chance in one search of ten, or
    at the threshold. Mates that it misses are left to the last.

    Examples
    --------
    >>> [(plan.by_terms, score) for plan, score in search_rounds(0.005, 10**6)]
    [(1299, 70.0), (38101, inf)]
    """
    last = search_plan(loss, prints, threshold)
    early = search_plan(EARLY_LOSS, prints, threshold, TIMES)
    if all_mates or early.cost(prints) >= EARLY_SHARE * last.cost(prints):
        return [(last, inf)]
    return [(early, max(10 * log10(TIMES * max(prints, 1)), threshold)), (last, inf)]


def combined_scores(
    descriptors: NDArray[np.integer],
    sizes: NDArray[np.integer],
    votes: NDArray[np.uint16],
    probe_size: int,
) -> NDArray[np.float64]:
    """Return the scores of the second stage: those of the bit descriptors, normalized, and votes.

    Either finds mates that the other loses: votes need a mesh that both prints have, descriptors
    the ridges around the minutiae. `sizes` are those of the prints, in minutiae: all that the first
    stage passed on, to which scores are normalized.
    """
    return with_votes(size_normalized(descriptors, sizes, probe_size), votes)


def with_votes(normalized: NDArray[np.float64], votes: NDArray[np.uint16]) -> NDArray[np.float64]:
    """Return the scores of the second stage, given the normalized ones of the descriptors."""
    combined: NDArray[np.float64] = normalized + VOTE_WEIGHT * votes
    return combined


def with_ridges(scores: NDArray[np.float64], agreement: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the scores of the third stage: second-stage scores plus the agreement of ridges.

    The agreement is normalized by that of all prints that the second stage passed on. Where it is
    not known (NaN), the score is infinite.
    """
    known = agreement[~np.isnan(agreement)]
    spread = float(known.std()) if len(known) else 0.0
    normalized = (agreement - known.mean()) / (spread or 1.0) if len(known) else agreement
    combined: NDArray[np.float64] = scores + RIDGE_WEIGHT * normalized
    return np.where(np.isnan(agreement), np.inf, combined)


def chosen_by_ridges(
    scores: NDArray[np.float64], agreement: NDArray[np.float64], most: int
) -> NDArray[np.intp]:
    """Return the places, ascending, of the prints that the third stage passes on.

    All whose ridges are not known, and of the others so many at `most`: one half ranks first with
    ridges, the other without, because where few descriptors agree they may misplace the ridges.
    """
    unknown, half = int(np.isnan(agreement).sum()), most // 2
    chosen = np.zeros(len(scores), bool)
    chosen[np.argsort(-with_ridges(scores, agreement), kind="stable")[: unknown + most - half]] = 1
    left = np.flatnonzero(~chosen)
    chosen[left[np.argsort(-scores[left], kind="stable")[:half]]] = True
    return np.flatnonzero(chosen)
