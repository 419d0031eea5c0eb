"""Search for wolves, templates and images that match as many prints as possible.

The search is hill climbing: it starts from the best of some random templates and fragments (or
compositions), makes a small random change, and keeps it where the smoothed share of matched prints
does not fall. After many steps without a gain it restarts from the next best; it returns the best
of all.
"""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

import numpy as np

from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.matchers.unit_circle import MATCHER
from research.wolves.scores import AT, FORMS, Probe, References, Row, measured, scores_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.templates.minutiae import Template
    from research.wolves.scores import Prints

MOST_SEARCHED: Final = 160  # prints of the objective
INITIAL_CANDIDATES: Final = 100  # random ones, of which the search starts from the best
PATIENCE: Final = 150  # steps without a gain before a restart
SMOOTHING: Final = 5.0  # of the share of matched prints, in units of score


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
    """The kind and size of wolves, and the functions that start and change a candidate."""

    kind: str
    size: int
    form: str
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
    """Measure the share of the searched prints that a candidate matches, smoothed."""

    references: References

    @classmethod
    def on(cls, prints: Prints) -> Objective:
        """Take some of the prints that may be searched on, with their ridges."""
        searched = np.flatnonzero(prints.searched)
        every = -(-len(searched) // MOST_SEARCHED)
        chosen = np.zeros(len(prints.finger), bool)
        chosen[searched[::every]] = True
        return cls(References.of(prints.take(chosen), FORMS[0]))

    def of(self, candidate: Candidate) -> float:
        """Return the objective, 0 to a little more than 1."""
        template = candidate.template()
        if template is None:
            return 0.0
        score = scores_of(MATCHER, load_calibration(MATCHER.name), template, self.references.many)
        counted = ~np.isin(self.references.finger, candidate.fingers)
        return float(smoothed(score[counted]).mean()) if counted.any() else 0.0


def smoothed(score: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the weight of scores: 1 at the threshold, little more above, less below."""
    return np.asarray(np.exp((np.minimum(score, AT + 2.0) - AT) / SMOOTHING))


def climb(
    space: SearchSpace, objective: Objective, budget: Budget, seed: Sequence[int]
) -> tuple[Candidate, float]:
    """Return the best candidate of a search, and its objective."""
    rng = np.random.default_rng(seed)
    pool = [space.start(rng) for _ in range(INITIAL_CANDIDATES)]
    starts = sorted(((objective.of(one), k) for k, one in enumerate(pool)), reverse=True)
    most, k = starts[0]
    best = pool[k]
    reached, at, idle, begun = most, best, 0, 1
    for _ in budget.steps_of():
        if idle == PATIENCE:
            reached, k = starts[begun % INITIAL_CANDIDATES]
            at, idle, begun = pool[k], 0, begun + 1
        trial = space.change(at, rng)
        found = objective.of(trial)
        idle = 0 if found > reached else idle + 1
        if found >= reached:
            at, reached = trial, found
        if reached > most:
            best, most = at, reached
    return best, most


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
    objective = Objective.on(prints)

    def run(number: int) -> Probe:
        candidate, _ = climb(planned[number], objective, budget, (seed, number))
        template = candidate.template()
        assert template is not None
        return Probe(template, pixels=candidate.pixels())

    rows = []
    with ThreadPoolExecutor(workers) as pool:
        for space, probe in zip(planned, pool.map(run, range(len(planned))), strict=True):
            for form, compared in references.items():
                forms = (space.form, form)
                rows.append(
                    measured(space.kind, space.size, [probe], forms, compared, adversarial=True)
                )
            finished(space)
    return rows
