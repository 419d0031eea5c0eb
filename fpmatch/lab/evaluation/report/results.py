"""The result of an evaluation: a row a database, their mean, and all scores pooled."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.lab.evaluation.report.rate_text import (
    RATE_TITLES,
    decidability,
    defined_rates,
    duration,
    percent,
    rate_cells,
)
from fpmatch.printable import count, text_table
from fpmatch.prints.reading import group_by_note

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.databases.extraction import ExtractedSet
    from fpmatch.lab.evaluation.databases.protocol import Pairs
    from fpmatch.lab.evaluation.rates.error_rates import Rates
    from fpmatch.lab.evaluation.rates.scores_set import Identification, ScoresSet


IDENTICAL_NAMED: Final = 20  # pairs of identical prints in JSON
IDENTICAL_SHOWN: Final = 3  # in text
_IDENTICAL: Final = {
    True: "genuine: {} of identical prints, which make the rates too low",
    False: "impostor: {} of identical prints, whose labels contradict each other",
}


@dataclass(frozen=True, slots=True, eq=False)
class SetRates:
    """The error rates of one database.

    `scores`: its comparisons. `rates`: error rates as fractions. `identification`: ranks of a
    search of every print among all others; None where not all were compared. `failures`: images
    that gave no template (failures to extract), and why; they score lowest in all pairs.
    `extract_ms`: median CPU time to extract an image, in milliseconds; NaN where it is not known.
    `match_us`: median CPU time of a comparison of prepared templates, in microseconds; the same.
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
            **_figures(self, self.rates),
            "failure_rate": self.failure_rate,
            "extract_ms": _rounded(self.extract_ms),
            "match_us": _rounded(self.match_us),
        }


@dataclass(frozen=True, slots=True, eq=False)
class SetResult(SetRates):
    """The results on one database whose images were compared.

    `scores`, `rates`, `identification`, `failures`, `extract_ms`, `match_us`: as for `SetRates`.
    `extracted`: the database and its templates. `pairs`: the pairs compared. `outcomes` (number of
    pairs,): the comparisons; see `fpmatch.lab.evaluation.databases.comparison`. `identical`: pairs
    whose prints have the same frame and minutiae, copies of one impression, as indices.
    """

    extracted: ExtractedSet = field(repr=False)
    pairs: Pairs = field(repr=False)
    outcomes: NDArray[np.void] = field(repr=False)
    identical: tuple[int, ...] = field(default=(), repr=False)

    def identical_pairs(self, *, genuine: bool) -> list[tuple[str, str]]:
        """Return the names of probe and reference of the pairs of identical prints of one kind."""
        chosen = [k for k in self.identical if self.pairs.genuine[k] == genuine]
        return [
            (self._name(self.pairs.probe[k]), self._name(self.pairs.reference[k])) for k in chosen
        ]

    def _name(self, number: int) -> str:
        return self.extracted.dataset.impressions[number].name

    def as_json(self) -> dict[str, Any]:
        """Return the figures of the row as JSON values."""
        genuine, impostor = (self.identical_pairs(genuine=kind) for kind in (True, False))
        named = list(map(list, [*genuine, *impostor][:IDENTICAL_NAMED]))
        counts = {"genuine": len(genuine), "impostor": len(impostor), "pairs": named}
        return SetRates.as_json(self) | {"identical": counts}


@dataclass(frozen=True, slots=True, repr=False, eq=False)
class RatesReport:
    """The error rates of one matcher on some databases.

    `matcher`, `protocol`: names of the matcher and the protocol; of scores from a file, the latter
    is "". `sets`: a row a database. `mean`: the mean over the databases of each rate; None where a
    database lacks it. `pooled`: the rates of all databases' scores together, one threshold for all.
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

        return f"<pre>{escape(self.as_text())}</pre>"

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

    @property
    def identical_note(self) -> str:
        """What is known of pairs of identical prints; "" for scores from a file."""
        return ""

    def as_text(self) -> str:
        """Return a line a database, and of several their mean and all scores pooled, in percent.

        FMR10000 is left out where no database has enough pairs for it. A note on pairs of identical
        prints follows.
        """
        defined = defined_rates([*(row.rates for row in self.sets), self.pooled])
        names = [name for name in RATE_TITLES if name != "fmr10000" or name in defined]
        titles = [RATE_TITLES[name] for name in names]

        def cells(title: str, row: SetRates | RatesReport, rates: Rates) -> list[str]:
            counts = title, str(row.genuine), str(row.impostor)
            ranks = percent(row.rank_one), str(len(row.failures))
            return [*counts, *rate_cells(rates, names), decidability(rates), *ranks]

        times = [
            (duration(row.extract_ms, 1, "ms"), duration(row.match_us, 0, "µs"))
            for row in self.sets
        ]
        head = ("database", "genuine", "impostor", *titles, "d'", "rank-1", "failed")
        rows = [
            (*head, "extract", "match"),
            *((*cells(r.name, r, r.rates), *t) for r, t in zip(self.sets, times, strict=True)),
        ]
        if len(self.sets) > 1:
            mean = rate_cells(self.mean, names), decidability(self.mean)
            rows += [("mean", "", "", *mean[0], mean[1], *[""] * 4)]
            rows += [(*cells("pooled", self, self.pooled), "", "")]
        timed = any(math.isfinite(row.match_us) for row in self.sets)
        table = text_table(rows if timed else [row[: len(head)] for row in rows])
        return "\n\n".join(filter(None, (table, self.identical_note)))

    def as_json(self) -> dict[str, Any]:
        """Return the report as JSON values: rates as fractions, null where undefined."""
        return {
            "sets": [row.as_json() for row in self.sets],
            "mean": {
                **asdict(self.mean),
                "extract_ms": _rounded(float(np.mean([row.extract_ms for row in self.sets]))),
                "match_us": _rounded(float(np.mean([row.match_us for row in self.sets]))),
            },
            "pooled": _figures(self, self.pooled),
        }


@dataclass(frozen=True, slots=True, repr=False, eq=False)
class EvaluationReport(RatesReport):
    """The results of one matcher on some databases whose images were compared.

    Parameters are those of `RatesReport`; `sets` has a `SetResult` a database.
    """

    sets: tuple[SetResult, ...]

    @property
    def identical_note(self) -> str:
        """How many pairs compare copies of one impression, and the first of them; "" for none."""
        notes = []
        for genuine, words in _IDENTICAL.items():
            pairs = [names for row in self.sets for names in row.identical_pairs(genuine=genuine)]
            if pairs:
                first = ", ".join(map(" with ".join, pairs[:IDENTICAL_SHOWN]))
                more = " and others" * (len(pairs) > IDENTICAL_SHOWN)
                notes.append(f"{words.format(count(len(pairs), 'pair'))}: {first}{more}")
        return "\n".join(notes)

    @property
    def dpi_assumed(self) -> tuple[Path, ...]:
        """Images whose resolution had to be assumed."""
        return tuple(path for row in self.sets for path in row.extracted.assumed)

    @property
    def noted(self) -> dict[str, tuple[Path, ...]]:
        """The notes on reading the images, each once, with its images."""
        return group_by_note(note for row in self.sets for note in row.extracted.notes)


def split_scores(sets: Sequence[SetRates]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the similarities of genuine and of impostor pairs of all databases.

    Rates are computed on them and not on scores: calibration keeps their order, but ties its ends.
    """
    genuine, impostor = zip(*(row.scores.split() for row in sets), strict=True)
    return np.concatenate(genuine), np.concatenate(impostor)


def scores_of(report: RatesReport) -> list[ScoresSet]:
    """Return the comparisons of an evaluation, one `ScoresSet` a database."""
    return [replace(row.scores, matcher=report.matcher) for row in report.sets]


def _figures(row: SetRates | RatesReport, rates: Rates) -> dict[str, Any]:
    """Return what is reported of one database, and of all scores pooled, as JSON values."""
    return {
        "genuine": row.genuine,
        "impostor": row.impostor,
        **asdict(rates),
        "rank_one": row.rank_one,
        "prints": row.prints,
        "failures": len(row.failures),
    }


def _rounded(time: float) -> float | None:
    return round(time, 3) if math.isfinite(time) else None
