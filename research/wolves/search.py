"""Search for wolves, templates and images that match as many prints as possible.

The search is evolutionary: of some random candidates a dozen are kept, one of which is changed at
random in each step; the result takes the place of the least of the dozen where it matches more of
the prints that may be searched on: the mean of 10^(score / 10), where no score counts more than
31, so that a template gains by each print that it reaches and nothing by a high score of one.
"""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

import numpy as np

from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.matchers.unit_circle import MATCHER
from research.wolves.scores import Probe, References, Row, measured, scores_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.templates.minutiae import Template
    from research.wolves.scores import Prints

MOST_SEARCHED: Final = 1500  # prints of the objective
INITIAL_CANDIDATES: Final = 60  # random ones, of which the search starts from the best
KEPT: Final = 12  # candidates
LAST: Final = 31.0  # the score above which none weighs more; 30 weighs 1


class Candidate(Protocol):
    """Describe what a search changes."""

    @property
    def fingers(self) -> tuple[int, ...]:
        """The fingers of its parts, whose prints are no impostors."""

    def template(self) -> Template | None:
        """Return its template; None where it gives none."""

    def pixels(self) -> NDArray[np.uint8] | None:
        """Return the image that the template is extracted from; None where there is none."""


@dataclass(frozen=True)
class SearchSpace:
    """The kind and size of wolves, and the functions that start and change a candidate.

    `form` and `against` are the forms, of `FORMS`, of the wolves and of the prints to be matched.
    """

    kind: str
    size: int
    form: str
    against: str
    start: Callable[[np.random.Generator], Candidate]
    change: Callable[[Candidate, np.random.Generator], Candidate]


@dataclass(frozen=True)
class Budget:
    """Limit each search by a number of steps, or without one by time."""

    seconds: float
    steps: int | None = None

    def steps_of(self) -> Iterable[int]:
        """Yield the numbers of the steps."""
        end = time.monotonic() + self.seconds
        step = 0
        while step < self.steps if self.steps is not None else time.monotonic() < end:
            yield step
            step += 1


@dataclass(frozen=True, eq=False)
class Objective:
    """Measure by how much a candidate matches the searched prints, on average."""

    references: References

    @classmethod
    def on(cls, prints: Prints, form: str) -> Objective:
        """Take some of the prints that may be searched on, in a form."""
        searched = np.flatnonzero(prints.searched)
        every = -(-len(searched) // MOST_SEARCHED)
        chosen = np.zeros(len(prints.finger), bool)
        chosen[searched[::every]] = True
        return cls(References.of(prints.take(chosen), form))

    def of(self, candidate: Candidate) -> float:
        """Return the mean weight of the scores, 0 to 1.26."""
        template = candidate.template()
        if template is None or not len(template.minutiae):
            return 0.0
        score = scores_of(MATCHER, load_calibration(MATCHER.name), template, self.references.many)
        counted = ~np.isin(self.references.finger, candidate.fingers)
        return float(weight_of(score[counted]).mean()) if counted.any() else 0.0


def weight_of(score: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the weight of scores: 1 at 30, ten times less for every ten below it."""
    return np.asarray(10.0 ** ((np.minimum(score, LAST) - 30.0) / 10.0))


def evolve(
    space: SearchSpace, objective: Objective, budget: Budget, seed: Sequence[int]
) -> tuple[Candidate, float]:
    """Return the best candidate of a search, and its objective."""
    rng = np.random.default_rng(seed)
    pool = [space.start(rng) for _ in range(INITIAL_CANDIDATES)]
    rated = [(one, objective.of(one)) for one in pool]
    kept = sorted(rated, key=lambda each: -each[1])[:KEPT]
    for _ in budget.steps_of():
        trial = space.change(kept[rng.integers(KEPT)][0], rng)
        value = objective.of(trial)
        if value > kept[-1][1]:
            kept = sorted([*kept[:-1], (trial, value)], key=lambda each: -each[1])
    return kept[0]


def searched_rows(
    planned: Sequence[SearchSpace],
    prints: Prints,
    references: Mapping[str, References],
    budget: Budget,
    seed: int,
    *,
    workers: int | None,
    finished: Callable[[SearchSpace], None],
) -> list[Row]:
    """Search for a wolf of each space, and measure it on the prints that were not searched on."""
    objectives = {form: Objective.on(prints, form) for form in references}

    def run(number: int) -> Probe:
        space = planned[number]
        candidate, _ = evolve(space, objectives[space.against], budget, (seed, number))
        template = candidate.template()
        assert template is not None
        return Probe(template, pixels=candidate.pixels())

    rows = []
    with ThreadPoolExecutor(workers) as pool:
        for space, probe in zip(planned, pool.map(run, range(len(planned))), strict=True):
            forms, compared = (space.form, space.against), references[space.against]
            rows.append(
                measured(space.kind, space.size, [probe], forms, compared, adversarial=True)
            )
            finished(space)
    return rows
