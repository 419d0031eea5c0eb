"""Matching of templates of 40 minutiae, in triangulations by scipy; scores of many prints."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
from in_turn import OURS, cpu, in_turn
from made_prints import prints, without_prefilter

from fpmatch.gallery.index.compare import PreparedPrints, similarities
from fpmatch.gallery.index.segment import Segment
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.verify import verify
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from fpmatch.matching.prints.prepared import PreparedTemplate

FIELD_CELLS = (22, 19)
PRINTS = 100_000
COMPARED = 1_000  # of all: the yardstick's part


@cpu("comparison, 1:1")
@in_turn(7)
def test_comparison(
    benchmark: Any,
    side: str,
    prepared: list[PreparedTemplate],
    triangulations: Callable[[], object],
) -> None:
    """Compare each with each of fifteen prints of three fingers, 30 genuine pairs among 105."""
    pairs = list(combinations(prepared[:15], 2))
    work = (lambda: [MATCHER.compare(a, b) for a, b in pairs]) if side == OURS else triangulations
    benchmark.extra_info["calls"] = len(pairs) if side == OURS else 50
    benchmark.pedantic(work, rounds=5, warmup_rounds=1)


@cpu("comparison of sample prints")
@in_turn(5)
def test_sample_prints(
    benchmark: Any, side: str, templates: dict[str, Template], nist_minutiae: list[Any]
) -> None:
    """Compare each two of sixteen sample prints of four fingers, 24 genuine pairs among 120."""
    if side == OURS:
        ours = combinations([MATCHER.prepare(one) for one in templates.values()], 2)
        pairs, compare = list(ours), MATCHER.compare
    else:
        pairs, compare = list(combinations(nist_minutiae, 2)), lambda a, b: a.compare(b)
    benchmark.extra_info["calls"] = len(pairs)
    work = lambda: [compare(a, b) for a, b in pairs]  # noqa: E731
    benchmark.pedantic(work, rounds=3, warmup_rounds=1)


@cpu("comparison, 1:N")
@in_turn(7)
def test_comparison_with_many(
    benchmark: Any,
    side: str,
    prepared: list[PreparedTemplate],
    triangulations: Callable[[], object],
) -> None:
    """Compare a print with a thousand, packed, of which five are of its finger's ten."""
    many = PreparedPrints(prepared * 20)
    work = (lambda: similarities(MATCHER, prepared[0], many)) if side == OURS else triangulations
    benchmark.extra_info["calls"] = len(many) if side == OURS else 50
    benchmark.pedantic(work, rounds=5, warmup_rounds=1)


@cpu("preparation")
@in_turn(7)
def test_preparation(
    benchmark: Any,
    side: str,
    prepared: list[PreparedTemplate],
    triangulations: Callable[[], object],
) -> None:
    """Prepare fifty templates with ridge fields for comparison."""
    templates = [_template_of(print_, seed) for seed, print_ in enumerate(prepared)]
    work = (lambda: [MATCHER.prepare(t) for t in templates]) if side == OURS else triangulations
    benchmark.extra_info["calls"] = 50
    benchmark.pedantic(work, rounds=7, warmup_rounds=1)


@cpu("verification, no with reasons")
@in_turn(7)
def test_verification(benchmark: Any, side: str, templates: dict[str, Template]) -> None:
    """Decide on pairs that do not match, and on pairs that do, with all that `verify` prints."""
    pairs = [
        (a, b)
        for (name, a), (other, b) in combinations(sorted(templates.items()), 2)
        if (name[:3] != other[:3]) == (side == OURS)
    ]

    def work() -> list[object]:
        results = [verify(a, b) for a, b in pairs]
        return [(r.reason, r.compared, r.transform, r.scale) for r in results]

    benchmark.extra_info["calls"] = len(pairs)
    benchmark.pedantic(work, rounds=3, warmup_rounds=1)


@cpu("scoring of bit descriptors")
@in_turn(3)
def test_descriptors(benchmark: Any, side: str) -> None:
    """Score prints by bit descriptors, a thousand again and again; the yardstick aligns them."""
    few = prints(np.random.default_rng(42), COMPARED)
    segment, many = Segment.build(range(COMPARED), range(COMPARED), few), PreparedPrints(few)
    which = np.tile(np.arange(COMPARED), PRINTS // COMPARED)

    def ours() -> NDArray[np.int32]:
        return segment.scores(few[0], which)

    def yardstick() -> NDArray[np.float64]:
        with without_prefilter():
            return similarities(MATCHER, few[0], many)

    benchmark.extra_info["calls"] = PRINTS if side == OURS else COMPARED
    benchmark.pedantic(ours if side == OURS else yardstick, rounds=3, warmup_rounds=1)


def _template_of(print_: PreparedTemplate, seed: int) -> Template:
    """Return a template of a prepared print's minutiae, with ridges of its own."""
    rng = np.random.default_rng(seed)
    x, y, c, s = print_.points
    minutiae = Minutiae(x, -y, np.arctan2(s, c), quality=100 * print_.quality)
    inside = np.ones(FIELD_CELLS, bool)
    ridges = rng.integers(0, 2**64, FIELD_CELLS, np.uint64)
    field = RidgeField(16.0, rng.uniform(0, np.pi, FIELD_CELLS), inside, ridges)
    return Template(minutiae, 16 * FIELD_CELLS[1], 16 * FIELD_CELLS[0], field=field)
