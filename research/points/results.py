"""The results of the experiment on random point sets, and their JSON file.

The file holds ``{"settings": {...}, "cells": [...], "skipped": [...]}``. Rates in it are fractions,
times in milliseconds, medians unless they are called means; `model`, `rho`, `eta`, `lambda`, `m`
and `n` determine a condition.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fpmatch.base.output import atomic_write_bytes, reason
from fpmatch.base.parsing import ParseError, parse_json
from fpmatch.errors import FpmatchError
from research.points.conditions import Condition, conditions

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence


@dataclass(frozen=True, slots=True)
class PointCell:
    """The results of one matcher under one condition; times are medians or called means."""

    condition: Condition
    matcher: str
    outcomes: str  # a character a genuine pair, in the order of the trials: "1" recognised, "0" not
    false_positives: int  # matches of independent pairs
    independent_trials: int
    time_ms: float  # of a match of genuine pairs
    scipy_delaunay_ms: float  # of scipy's triangulations of the same pairs
    independent_time_ms: float  # of a match of independent pairs
    first_ms: float  # of the first match of a genuine pair
    stopped: int = 0  # matches that were stopped for taking too long, which count as no match
    mean_ms: float | None = None  # None where only medians are known
    independent_mean_ms: float | None = None

    @property
    def trials(self) -> int:
        """Genuine pairs tried."""
        return len(self.outcomes)

    @property
    def true_positives(self) -> int:
        """Genuine pairs recognised."""
        return self.outcomes.count("1")

    @property
    def true_positive_rate(self) -> float:
        """Share of genuine pairs recognised."""
        return self.true_positives / self.trials

    @property
    def false_positive_rate(self) -> float:
        """Share of independent pairs matched."""
        return self.false_positives / self.independent_trials

    def as_json(self) -> dict[str, Any]:
        """Return the cell as in the file."""
        return {
            **_key(self.condition, self.matcher),
            "trials": self.trials,
            "recognised": self.true_positive_rate,
            "false_match": self.false_positive_rate,
            "time_ms": self.time_ms,
            "scipy_delaunay_ms": self.scipy_delaunay_ms,
            "independent_trials": self.independent_trials,
            "false_matches": self.false_positives,
            "independent_time_ms": self.independent_time_ms,
            "mean_ms": self.mean_ms,
            "independent_mean_ms": self.independent_mean_ms,
            "first_ms": self.first_ms,
            "stopped": self.stopped,
            "outcomes": self.outcomes,
        }


@dataclass(frozen=True, slots=True)
class SkippedCell:
    """The condition and matcher of a cell that was not run, and the reason."""

    condition: Condition
    matcher: str
    reason: str

    def as_json(self) -> dict[str, Any]:
        """Return the cell as in the file."""
        return {**_key(self.condition, self.matcher), "reason": self.reason}


@dataclass(slots=True)
class BenchResults:
    """Gather the results of an experiment; `skipped` are the cells that would take too long."""

    settings: dict[str, Any]
    cells: list[PointCell] = field(default_factory=list)
    skipped: list[SkippedCell] = field(default_factory=list)

    def add(self, outcome: PointCell | SkippedCell) -> None:
        """Add a cell, run or skipped."""
        if isinstance(outcome, PointCell):
            self.cells.append(outcome)
        else:
            self.skipped.append(outcome)

    def cell(self, condition: Condition, matcher: str) -> PointCell | None:
        """Return the cell of a matcher under a condition, if it was run."""
        cells = (c for c in self.cells if (c.condition, c.matcher) == (condition, matcher))
        return next(cells, None)

    def as_json(self) -> dict[str, Any]:
        """Return the content of the file, the cells in the order of the tables."""
        order = conditions().index

        def in_order(outcomes: Sequence[PointCell | SkippedCell]) -> list[dict[str, Any]]:
            return [one.as_json() for one in sorted(outcomes, key=lambda one: order(one.condition))]

        cells, skipped = in_order(self.cells), in_order(self.skipped)
        return {"settings": self.settings, "cells": cells, "skipped": skipped}


def write_results(path: str | os.PathLike[str], results: BenchResults) -> None:
    """Write results as a JSON file, atomically; raise `OutputError` if that fails."""
    text = json.dumps(results.as_json(), indent=1, allow_nan=False)
    atomic_write_bytes(path, f"{text}\n".encode(), public=True)


def read_results(path: str | os.PathLike[str]) -> BenchResults:
    """Read a file of results; raise `FpmatchError` if it cannot be read or is not such a file."""
    try:
        document = parse_json(Path(path).read_bytes())
    except OSError as error:
        raise FpmatchError(f"{path}: cannot be read: {reason(error)}") from error
    except ParseError as error:
        raise FpmatchError(f"{path}: not a file of results: {error}") from error
    try:
        return BenchResults(
            settings=document.get("settings", {}),
            cells=[_cell_of(entry) for entry in document["cells"]],
            skipped=[
                SkippedCell(_condition_of(entry), str(entry["matcher"]), str(entry["reason"]))
                for entry in document.get("skipped", [])
            ],
        )
    except (AttributeError, KeyError, TypeError, ValueError, OverflowError) as error:
        what = f"lacks {error}" if isinstance(error, KeyError) else str(error)
        raise FpmatchError(f"{path}: not a file of results: {what}") from error


def _key(condition: Condition, matcher: str) -> dict[str, Any]:
    rho, eta, lambda_ = condition.parameters.setting
    sets = {"rho": rho, "eta": eta, "lambda": lambda_, "m": condition.m, "n": condition.n}
    return {"model": condition.model, "matcher": matcher, **sets}


def _condition_of(entry: dict[str, Any]) -> Condition:
    key = tuple(entry[name] for name in ("model", "rho", "eta", "lambda", "m", "n"))
    for condition in conditions():
        model, _, *numbers = _key(condition, "").values()
        if key == (model, *numbers):
            return condition
    raise ValueError(f"the paper's tables have no condition {key}")


def _cell_of(entry: dict[str, Any]) -> PointCell:
    own = {one.name: entry[one.name] for one in fields(PointCell) if one.name in entry}
    return PointCell(**own, condition=_condition_of(entry), false_positives=entry["false_matches"])
