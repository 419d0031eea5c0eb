"""How many prints each stage of a search passes on, for a wanted loss.

The loss is the share of the mates that comparing all prints would find and a search in stages does
not. What it takes is measured on synthetic mates by ``python -m research train index``: with each
budget of postings, the share of other prints that the first stage ranks before a mate, by its
votes, and the second one, by votes and bit descriptors. In larger galleries, comparing all finds
fewer of the faint mates, so that smaller shares suffice.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import ceil
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import MatcherError, number_text
from fpmatch.indexing.model import MODEL_FILE
from fpmatch.parsing import parse_json

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

DEFAULT_LOSS: Final = 0.01
VOTE_WEIGHT: Final = 1 / 320
"""What a vote adds to the normalized score of the bit descriptors."""

PARTS: Final = (0.2, 0.35, 0.5, 0.65, 0.8)  # of the loss, that the first stage may have
# Costs in microseconds, for the choice among plans of the same loss: of a print of the gallery, and
# more by the budget; of one in the second stage, and in the third.
COST: Final = (0.022, 0.1, 2.0, 300.0)
LEAST_PASSED_ON: Final = (1000, 20)


@dataclass(frozen=True, slots=True)
class SearchPlan:
    """Hold how a gallery is searched in stages.

    Parameters
    ----------
    loss : float
        Share of the mates that the search is expected to lose.
    budget : float
        Postings a print that the first stage visits, for each minutia of the probe.
    by_terms, by_descriptors : int
        How many prints the first stage passes on to the second, and this to the comparison.
    """

    loss: float
    budget: float
    by_terms: int
    by_descriptors: int


@dataclass(frozen=True, slots=True, eq=False)
class LossTable:
    """Hold the shares of a gallery that have to be passed on.

    Parameters
    ----------
    prints : ndarray of float64, shape (N,)
        Sizes of galleries, ascending.
    budgets : ndarray of float64, shape (B,)
        Postings a print, for each minutia of the probe.
    losses : ndarray of float64, shape (L,)
        Shares of mates, ascending.
    by_terms, by_descriptors : ndarray of float64, shape (N, B, L)
        The share of prints, in a gallery of this size and with this budget, beyond which either
        stage ranks that share of the mates.
    """

    prints: NDArray[np.float64]
    budgets: NDArray[np.float64]
    losses: NDArray[np.float64]
    by_terms: NDArray[np.float64]
    by_descriptors: NDArray[np.float64]

    @classmethod
    def of_document(cls, document: Mapping[str, Any]) -> LossTable:
        """Return the table in the document of a model; raise MatcherError if it has none."""
        try:
            table = document["loss"]
            found = cls(**{name: np.array(table[name], np.float64) for name in cls.__slots__})
        except (LookupError, TypeError, ValueError) as error:
            raise MatcherError("no table of losses", code="malformed") from error
        axes = found.prints, found.budgets, found.losses
        shares = found.by_terms, found.by_descriptors
        rise = all(a.ndim == 1 and a.size and (np.diff(a, prepend=0) > 0).all() for a in axes)
        shape = tuple(map(np.size, axes))
        if not (rise and all(s.shape == shape and (np.abs(s - 0.5) <= 0.5).all() for s in shares)):
            raise MatcherError("no table of losses", code="malformed")
        return found

    def document(self, digits: int = 3) -> dict[str, Any]:
        """Return the table as it stands in the document of a model, with rounded numbers."""
        rounded = np.vectorize(lambda value: float(f"{value:.{digits}g}"), otypes=[np.float64])
        return {name: rounded(getattr(self, name)).tolist() for name in self.__slots__}

    def plan(self, loss: float, prints: int) -> SearchPlan:
        """Return the fastest plan of a loss, for a gallery of so many prints.

        Raises
        ------
        MatcherError
            If the loss is not between 0 and 1.
        """
        if not 0 < loss < 1:
            raise MatcherError(f"a loss is between 0 and 1, not {number_text(loss)}")
        row = max(int(np.searchsorted(self.prints, prints, "right")) - 1, 0)
        plans = []
        for budget, terms, descriptors in zip(
            self.budgets.tolist(), self.by_terms[row], self.by_descriptors[row], strict=True
        ):
            for part in PARTS:
                first = self._share(part * loss, terms) * prints
                second = self._share((1 - part) * loss, descriptors) * prints
                counts = [
                    min(max(ceil(count), least), prints)
                    for count, least in zip((first, second), LEAST_PASSED_ON, strict=True)
                ]
                counts[1] = min(counts)
                each, visited, looked_at, compared = COST
                cost = prints * (each + visited * budget)
                cost += looked_at * counts[0] + compared * counts[1]
                plans.append((cost, SearchPlan(loss, budget, *counts)))
        return min(plans, key=lambda plan: plan[0])[1]

    def _share(self, loss: float, shares: NDArray[np.float64]) -> float:
        """Return the share of prints for a loss: all, where none is lost of the measured mates."""
        if loss < self.losses[0]:
            return 1.0
        return float(np.exp(np.interp(np.log(loss), np.log(self.losses), np.log(shares + 1e-9))))


@cache
def loss_table() -> LossTable:
    """Return the table of the package."""
    return LossTable.of_document(parse_json(MODEL_FILE.read_bytes()))


def search_plan(loss: float, prints: int) -> SearchPlan:
    """Return how a gallery of so many prints is searched, with a loss of at most this share.

    Raises
    ------
    MatcherError
        If the loss is not between 0 and 1.

    Examples
    --------
    >>> careful, quick = (search_plan(loss, 1_000_000) for loss in (0.005, 0.05))
    >>> careful.by_terms > quick.by_terms
    True
    """
    return loss_table().plan(loss, prints)


def combined_scores(
    descriptors: NDArray[np.float64], votes: NDArray[np.uint16]
) -> NDArray[np.float64]:
    """Return the scores of the second stage: normalized ones of the bit descriptors, and votes.

    Either finds mates that the other loses: votes need a mesh that both prints have, descriptors
    the ridges around the minutiae.
    """
    found: NDArray[np.float64] = descriptors + VOTE_WEIGHT * votes
    return found
