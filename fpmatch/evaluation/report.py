"""The result of an evaluation: a row a database, their mean, and all scores pooled."""

from __future__ import annotations

import math
from dataclasses import asdict, astuple, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fpmatch.evaluation.identification import Identification, identify_all
from fpmatch.evaluation.rates import Rates, error_rates
from fpmatch.evaluation.scores_set import scores_of_set
from fpmatch.reading import group_by_note
from fpmatch.text_table import count

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.evaluation.extraction import ExtractedSet
    from fpmatch.evaluation.protocol import Pairs
    from fpmatch.evaluation.scores_set import ScoresSet


@dataclass(frozen=True, slots=True)
class SetRates:
    """Hold the error rates of one database.

    Parameters
    ----------
    scores : ScoresSet
        Its comparisons.
    rates : Rates
        Error rates as fractions.
    identification : Identification or None
        Ranks of a search of every print among all others; None where not all were compared.
    failures : tuple of (Path, str)
        Images that gave no template (failures to extract), and why; they score lowest in all pairs.
    extract_ms : float
        Median CPU time to extract an image, in milliseconds; NaN where it is not known.
    match_us : float
        Median CPU time of a comparison of prepared templates, in microseconds; the same.
    """

    scores: ScoresSet = field(repr=False)
    rates: Rates
    identification: Identification | None = field(repr=False)
    failures: tuple[tuple[Path, str], ...]
    extract_ms: float
    match_us: float

    @property
    def name(self) -> str:
        """Name of the database."""
        return self.scores.name

    @property
    def genuine(self) -> int:
        """Number of genuine pairs compared."""
        return int(self.scores.trials.genuine.sum())

    @property
    def impostor(self) -> int:
        """Number of impostor pairs compared."""
        return int((~self.scores.trials.genuine).sum())

    @property
    def prints(self) -> int:
        """Number of impressions in the database; 0 where their names are not known."""
        return len(self.scores.prints)

    @property
    def failure_rate(self) -> float:
        """Share of the impressions that gave no template."""
        return len(self.failures) / max(1, self.prints)

    @property
    def rank_one(self) -> float | None:
        """Share of the probes whose own finger comes first; None without identification."""
        return None if self.identification is None else self.identification.rank_one

    def as_json(self) -> dict[str, Any]:
        """Return the figures of the row as JSON values."""
        return {
            "name": self.name,
            "genuine": self.genuine,
            "impostor": self.impostor,
            **asdict(self.rates),
            "rank_one": self.rank_one,
            "prints": self.prints,
            "failures": len(self.failures),
            "failure_rate": self.failure_rate,
            "extract_ms": _rounded(self.extract_ms),
            "match_us": _rounded(self.match_us),
        }


@dataclass(frozen=True, slots=True)
class SetResult(SetRates):
    """Hold the results on one database whose images were compared.

    Parameters
    ----------
    scores, rates, identification, failures, extract_ms, match_us
        As for `SetRates`.
    extracted : ExtractedSet
        The database and its templates.
    pairs : Pairs
        The pairs compared.
    outcomes : ndarray of OUTCOME, shape (number of pairs,)
        The comparisons; see `fpmatch.evaluation.comparison`.
    """

    extracted: ExtractedSet = field(repr=False)
    pairs: Pairs = field(repr=False)
    outcomes: NDArray[np.void] = field(repr=False)


@dataclass(frozen=True, slots=True, repr=False)
class RatesReport:
    """Hold the error rates of one matcher on some databases.

    Parameters
    ----------
    matcher, protocol : str
        Names of the matcher and the protocol; of scores from a file, the latter is "".
    sets : tuple of SetRates
        A row a database.
    mean : Rates
        The mean over the databases of each rate; None where a database lacks it.
    pooled : Rates
        The rates of all databases' scores together, one threshold for all.
    """

    matcher: str
    protocol: str
    sets: tuple[SetRates, ...]
    mean: Rates
    pooled: Rates

    def __repr__(self) -> str:
        sets, failed = len(self.sets), len(self.failures)
        pairs = f"{self.genuine} genuine and {self.impostor} impostor pairs"
        counts = f"{count(sets, 'database')}, {pairs}, {failed} failed"
        eer = "no EER" if self.pooled.eer is None else f"EER {self.pooled.eer:.4f}"
        return f"{type(self).__name__}({self.matcher}, {counts}, {eer})"

    def _repr_html_(self) -> str:
        """Return the table that `fpmatch evaluate` prints, for notebooks."""
        from html import escape  # noqa: PLC0415  (for notebooks only)

        from fpmatch.evaluation.tables import format_report  # noqa: PLC0415

        return f"<pre>{escape(format_report(self))}</pre>"

    @property
    def prints(self) -> int:
        """Number of impressions in all databases."""
        return sum(row.prints for row in self.sets)

    @property
    def genuine(self) -> int:
        """Number of genuine pairs in all databases."""
        return sum(row.genuine for row in self.sets)

    @property
    def impostor(self) -> int:
        """Number of impostor pairs in all databases."""
        return sum(row.impostor for row in self.sets)

    @property
    def failures(self) -> tuple[tuple[Path, str], ...]:
        """Images of all databases that gave no template, and why."""
        return tuple(failure for row in self.sets for failure in row.failures)

    @property
    def rank_one(self) -> float | None:
        """Share of all probes whose own finger comes first, each in its own database.

        None where a database has no identification.
        """
        ranks = [row.identification.rank for row in self.sets if row.identification]
        if len(ranks) < len(self.sets):
            return None
        return float(np.mean(np.concatenate(ranks) == 1))

    def as_json(self) -> dict[str, Any]:
        """Return the report as JSON values: rates as fractions, null where undefined."""
        return {
            "sets": [row.as_json() for row in self.sets],
            "mean": {
                **asdict(self.mean),
                "extract_ms": _rounded(float(np.mean([row.extract_ms for row in self.sets]))),
                "match_us": _rounded(float(np.mean([row.match_us for row in self.sets]))),
            },
            "pooled": {
                "genuine": self.genuine,
                "impostor": self.impostor,
                **asdict(self.pooled),
                "rank_one": self.rank_one,
                "prints": self.prints,
                "failures": len(self.failures),
            },
        }


@dataclass(frozen=True, slots=True, repr=False)
class EvaluationReport(RatesReport):
    """Hold the results of one matcher on some databases whose images were compared.

    Parameters are those of `RatesReport`; `sets` has a `SetResult` a database.
    """

    sets: tuple[SetResult, ...]

    @property
    def dpi_assumed(self) -> tuple[Path, ...]:
        """Images whose resolution had to be assumed."""
        return tuple(path for row in self.sets for path in row.extracted.assumed)

    @property
    def noted(self) -> dict[str, tuple[Path, ...]]:
        """The notes on reading the images, each once, with its images."""
        return group_by_note(note for row in self.sets for note in row.extracted.notes)


def summarise_set(
    matcher: str, extracted: ExtractedSet, pairs: Pairs, outcomes: NDArray[np.void]
) -> SetResult:
    """Summarise the comparisons of one database."""
    cpu_us = outcomes["cpu_us"][np.isfinite(outcomes["cpu_us"])]
    scores = scores_of_set(matcher, extracted, pairs, outcomes)
    return SetResult(
        scores=scores,
        rates=error_rates(*scores.split()),
        identification=identify_all(scores),
        failures=tuple(extracted.failures),
        extract_ms=extracted.median_cpu_ms,
        match_us=float(np.median(cpu_us)) if cpu_us.size else math.nan,
        extracted=extracted,
        pairs=pairs,
        outcomes=outcomes,
    )


def summarise(matcher: str, protocol: str, sets: Sequence[SetResult]) -> EvaluationReport:
    """Summarise the rows of all databases."""
    return EvaluationReport(matcher, protocol, tuple(sets), *_together(sets))


def summarise_scores(sets: Sequence[ScoresSet]) -> RatesReport:
    """Return the error rates of scores that one matcher gave, a row a database.

    Prints none of whose comparisons has a score count as failures to extract.
    """
    rows = tuple(
        SetRates(
            scores=scores,
            rates=error_rates(*scores.split()),
            identification=identify_all(scores),
            failures=tuple((Path(name), f"{name}: no score") for name in scores.never_compared),
            extract_ms=math.nan,
            match_us=math.nan,
        )
        for scores in sets
    )
    return RatesReport(sets[0].matcher, "", rows, *_together(rows))


def _together(sets: Sequence[SetRates]) -> tuple[Rates, Rates]:
    """Return the mean of the rates of all databases, and the rates of all their scores."""
    columns = zip(*(astuple(row.rates) for row in sets), strict=True)
    mean = Rates(*(None if None in column else float(np.mean(column)) for column in columns))
    return mean, error_rates(*split_scores(sets))


def split_scores(sets: Sequence[SetRates]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the similarities of genuine and of impostor pairs of all databases.

    Rates are computed on them and not on scores: calibration keeps their order, but ties its ends.
    """
    genuine, impostor = zip(*(row.scores.split() for row in sets), strict=True)
    return np.concatenate(genuine), np.concatenate(impostor)


def _rounded(time: float) -> float | None:
    return round(time, 3) if math.isfinite(time) else None
