"""Search of a large gallery by a candidate list, against aligning the probe with every print."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from in_turn import OURS, cpu, in_turn
from made_prints import prints, repeated, without_prefilter

from fpmatch.gallery.engine.in_threads import Threads
from fpmatch.gallery.search.search import SearchOptions
from fpmatch.gallery.search.whole import WholeSearch
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.prints.prepared_prints import PreparedPrints

if TYPE_CHECKING:
    from numpy.typing import NDArray

PRINTS = 100_000
COMPARED = 1_000  # of all: the yardstick's part


@pytest.fixture(scope="module")
def search() -> WholeSearch:
    """Return a search of prints of 40 minutiae, five of each finger."""
    few = PreparedPrints.pack(prints(np.random.default_rng(42), COMPARED))
    numbers = np.arange(PRINTS)
    return WholeSearch(MATCHER, numbers, numbers, repeated(few, PRINTS))


@cpu("search by a candidate list")
@in_turn(3)
def test_search(benchmark: Any, side: str, search: WholeSearch) -> None:
    """Score all prints by bit descriptors, compare the candidates; the yardstick aligns all."""
    probe = search.print_at(0)
    assert search.candidate_list_size() is not None

    def ours() -> NDArray[np.float64]:
        ((listed,),) = search.compare([[probe]], SearchOptions(), Threads(1))
        return listed.similarities

    def yardstick() -> NDArray[np.float64]:
        with without_prefilter():
            return MATCHER.similarities(probe, search.prints, 0, COMPARED)

    benchmark.extra_info["calls"] = PRINTS if side == OURS else COMPARED
    benchmark.pedantic(ours if side == OURS else yardstick, rounds=3, warmup_rounds=1)
