"""The results of the experiment on random point sets, and the JSON file that keeps them.

The file holds ``{"settings": {...}, "cells": [...], "skipped": [...]}``. Rates in it are fractions,
times in milliseconds, medians unless they are called means; `rho`, `eta`, `lambda`, `m` and `n`
name a place of the paper's tables.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fpmatch.errors import FpmatchError
from fpmatch.evaluation.points.places import Place, places
from fpmatch.output import atomic_write_bytes, reason

if TYPE_CHECKING:
    import os


@dataclass(frozen=True, slots=True)
class PointCell:
    """Hold what the trials of one matcher at one place found.

    Parameters
    ----------
    place : Place
        Where in the tables.
    matcher : str
        Name of the matcher.
    outcomes : str
        A character a genuine pair, in the order of the trials: "1" recognised, "0" not.
    false_matches, independent_trials : int
        Matches claimed on independent pairs, and how many of those were tried.
    time_ms, scipy_delaunay_ms : float
        Median time of a match on genuine pairs, and of scipy's triangulations of the same pairs.
    independent_time_ms : float
        Median time of a match on independent pairs.
    first_ms : float
        Time of the first match on a genuine pair.
    stopped : int
        Matches that were stopped for taking too long, which count as no match.
    mean_ms, independent_mean_ms : float or None
        Average time of a match on genuine and on independent pairs; None where only medians are
        known.
    """

    place: Place
    matcher: str
    outcomes: str
    false_matches: int
    independent_trials: int
    time_ms: float
    scipy_delaunay_ms: float
    independent_time_ms: float
    first_ms: float
    stopped: int = 0
    mean_ms: float | None = None
    independent_mean_ms: float | None = None

    @property
    def trials(self) -> int:
        """Genuine pairs tried."""
        return len(self.outcomes)

    @property
    def right(self) -> int:
        """Genuine pairs recognised."""
        return self.outcomes.count("1")

    @property
    def recognised(self) -> float:
        """Share of genuine pairs recognised."""
        return self.right / self.trials

    @property
    def false_match(self) -> float:
        """Share of independent pairs for which a match was claimed."""
        return self.false_matches / self.independent_trials

    def as_json(self) -> dict[str, Any]:
        """Return the cell as the file has it."""
        return {
            **_named(self.place, self.matcher),
            "trials": self.trials,
            "recognised": self.recognised,
            "false_match": self.false_match,
            "time_ms": self.time_ms,
            "scipy_delaunay_ms": self.scipy_delaunay_ms,
            "independent_trials": self.independent_trials,
            "false_matches": self.false_matches,
            "independent_time_ms": self.independent_time_ms,
            "mean_ms": self.mean_ms,
            "independent_mean_ms": self.independent_mean_ms,
            "first_ms": self.first_ms,
            "stopped": self.stopped,
            "outcomes": self.outcomes,
        }


@dataclass(frozen=True, slots=True)
class SkippedCell:
    """Hold a cell that was not run, and why.

    Parameters
    ----------
    place : Place
        Where in the tables.
    matcher : str
        Name of the matcher.
    reason : str
        Why it was not run.
    """

    place: Place
    matcher: str
    reason: str

    def as_json(self) -> dict[str, Any]:
        """Return the cell as the file has it."""
        return {**_named(self.place, self.matcher), "reason": self.reason}


@dataclass(slots=True)
class BenchResults:
    """Gather the results of an experiment.

    Parameters
    ----------
    settings : dict
        What the results depend on: how much was tried, versions, the machine. JSON values.
    cells : list of PointCell
        The cells that were run.
    skipped : list of SkippedCell
        The cells that were not, because they would have taken too long.
    """

    settings: dict[str, Any]
    cells: list[PointCell] = field(default_factory=list)
    skipped: list[SkippedCell] = field(default_factory=list)

    def cell(self, place: Place, matcher: str) -> PointCell | None:
        """Return the cell of a matcher at a place, if it was run."""
        found = (c for c in self.cells if (c.place, c.matcher) == (place, matcher))
        return next(found, None)

    def as_json(self) -> dict[str, Any]:
        """Return the content of the file, the cells in the order of the tables."""
        order = {place: rank for rank, place in enumerate(places())}
        return {
            "settings": self.settings,
            "cells": [c.as_json() for c in sorted(self.cells, key=lambda c: order[c.place])],
            "skipped": [c.as_json() for c in sorted(self.skipped, key=lambda c: order[c.place])],
        }


def write_results(path: str | os.PathLike[str], results: BenchResults) -> None:
    """Write results as a JSON file, whole or not at all.

    Parameters
    ----------
    path : path-like
        The file to write or replace.
    results : BenchResults
        The results.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    text = json.dumps(results.as_json(), indent=1, allow_nan=False)
    atomic_write_bytes(path, f"{text}\n".encode())


def read_results(path: str | os.PathLike[str]) -> BenchResults:
    """Read the results that `write_results` has written.

    Parameters
    ----------
    path : path-like
        The file.

    Returns
    -------
    BenchResults
        The results.

    Raises
    ------
    FpmatchError
        If the file cannot be read, or is not such a file.
    """
    try:
        document = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise FpmatchError(f"{path}: cannot be read: {reason(error)}") from error
    except ValueError as error:
        raise FpmatchError(f"{path}: not a file of results: {error}") from error
    try:
        return BenchResults(
            settings=dict(document.get("settings", {})),
            cells=[_cell_of(entry) for entry in document["cells"]],
            skipped=[
                SkippedCell(_place_of(entry), str(entry["matcher"]), str(entry["reason"]))
                for entry in document.get("skipped", [])
            ],
        )
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        what = f"lacks {error}" if isinstance(error, KeyError) else str(error)
        raise FpmatchError(f"{path}: not a file of results: {what}") from error


def _named(place: Place, matcher: str) -> dict[str, Any]:
    row = place.parameters
    return {
        "reading": place.reading,
        "matcher": matcher,
        "rho": row.rho,
        "eta": row.eta,
        "lambda": row.lambda_,
        "m": place.m,
        "n": place.n,
    }


_NAMING = ("reading", "rho", "eta", "lambda", "m", "n")


def _place_of(entry: dict[str, Any]) -> Place:
    named = tuple(entry[key] for key in _NAMING)
    for place in places():
        if named == tuple(_named(place, "")[key] for key in _NAMING):
            return place
    raise ValueError(f"the paper's tables have no place {named}")


def _cell_of(entry: dict[str, Any]) -> PointCell:
    """Return a cell of the file; what others than us may leave out follows from the rest."""
    place, trials = _place_of(entry), int(entry["trials"])
    right = round(_share(entry["recognised"]) * trials)
    outcomes = str(entry.get("outcomes", "1" * right + "0" * (trials - right)))
    independent = int(entry.get("independent_trials", trials))
    cell = PointCell(
        place=place,
        matcher=str(entry["matcher"]),
        outcomes=outcomes,
        false_matches=round(_share(entry["false_match"]) * independent),
        independent_trials=independent,
        time_ms=_milliseconds(entry["time_ms"]),
        scipy_delaunay_ms=_milliseconds(entry["scipy_delaunay_ms"]),
        independent_time_ms=_milliseconds(entry.get("independent_time_ms", entry["time_ms"])),
        first_ms=_milliseconds(entry.get("first_ms", entry["time_ms"])),
        stopped=int(entry.get("stopped", 0)),
        mean_ms=_average(entry, "mean_ms"),
        independent_mean_ms=_average(entry, "independent_mean_ms"),
    )
    if min(trials, independent) < 1 or (cell.trials, cell.right) != (trials, right):
        raise ValueError(f"trials and outcomes disagree: {cell.matcher}, {place}")
    return cell


def _share(value: Any) -> float:
    if not (isinstance(value, int | float) and 0 <= value <= 1):
        raise ValueError(f"a rate must be a fraction: {value!r}")
    return float(value)


def _average(entry: dict[str, Any], key: str) -> float | None:
    return None if entry.get(key) is None else _milliseconds(entry[key])


def _milliseconds(value: Any) -> float:
    if not (isinstance(value, int | float) and 0 < value < math.inf):
        raise ValueError(f"a time must be positive: {value!r}")
    return float(value)
