"""The learned model of the index: how frequent its terms are, and how many prints to pass on."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.base.parsing import parse_json
from fpmatch.errors import MatcherError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

MODEL_FILE: Final = Path(__file__).with_name("index_data") / "index.json"
LENGTHS: Final = 14  # cells of an edge's length
SECTORS: Final = 24  # of a direction relative to an edge
CURVATURES: Final = 7  # cells of the curvature across an edge; the last is that of unknown ones
TERMS: Final = LENGTHS * SECTORS * SECTORS * CURVATURES
LEAST_SHARE: Final = 1e-7  # of all edges that have a term, taken for one never seen


@dataclass(frozen=True, slots=True, eq=False)
class IndexModel:
    """The statistics of edges that ``python -m research train index`` learns on synthetic prints.

    The lengths of edges are nearly independent of what else a term consists of, so that the share
    of all edges that have a term is the product of two.
    """

    lengths: NDArray[np.float64]  # (LENGTHS,): share of all edges
    directions: NDArray[np.float64]
    """Share of all edges, (SECTORS, SECTORS, CURVATURES), by the directions of both ends."""
    edges: float  # of a print

    @property
    def share(self) -> NDArray[np.float64]:
        """Share of all edges that have each term, shape (TERMS,)."""
        product = np.multiply.outer(self.lengths, self.directions)
        shares: NDArray[np.float64] = np.maximum(product.ravel(), LEAST_SHARE)
        return shares

    @classmethod
    def of_document(cls, document: Mapping[str, Any]) -> IndexModel:
        """Return the model in the document of a file; raise MatcherError if it is none."""
        try:
            lengths = np.array(document["lengths"], np.float64)
            directions = np.array(document["directions"], np.float64)
            edges = float(document["edges"])
        except (LookupError, TypeError, ValueError) as error:
            raise MatcherError("no model of an index", code="malformed") from error
        sound = lengths.shape == (LENGTHS,) and directions.shape == (SECTORS, SECTORS, CURVATURES)
        if not (sound and (lengths >= 0).all() and (directions >= 0).all() and edges > 0):
            raise MatcherError("no model of an index", code="malformed")
        return cls(lengths, directions, edges)


@cache
def index_model() -> IndexModel:
    """Return the model of the package."""
    return IndexModel.of_document(parse_json(MODEL_FILE.read_bytes()))
