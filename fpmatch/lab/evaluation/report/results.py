"""The error rates of a matcher: a row a database, their mean, and all scores pooled."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import DatasetError
from fpmatch.lab.evaluation.rates.error_rates import Rates, error_rates, mean_rates
from fpmatch.lab.evaluation.rates.scores import (
    finger_in_name,
    ranks_of,
    read_genuine_and_impostor,
    read_scores,
)
from fpmatch.lab.evaluation.report.text import rates_table
from fpmatch.printable import count

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.databases.extraction import DatasetSource
    from fpmatch.lab.evaluation.rates.scores import ScoresSet, Trials

    AnyPath = str | os.PathLike[str]

UNKNOWN_FINGERS: Final = (
    "its fingers are not known: comparisons are drawn for the 95 % intervals, which are too narrow "
    "where fingers come in several comparisons; --pattern finds fingers in the names of prints"
)
PROBABLY_DISTANCES: Final = (
    "genuine scores are mostly lower than impostor scores: distances need --distances"
)
_HALF: Final = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class SetRates:
    """The error rates of one database.

    `scores`: its comparisons. `rates`: error rates as fractions. `ranks`: see
    `fpmatch.lab.evaluation.rates.scores.ranks_of`. `failures`: prints that have no template
    (failures to extract) and why; they score lowest in all pairs. `about` is what is
    known of the prints: failures, notes, identical ones; `source` has the prints. Of scores from a
    file they are empty.
    """

    scores: ScoresSet = field(repr=False)
    rates: Rates
    ranks: tuple[NDArray[np.intp], NDArray[np.intp]] | None = field(repr=False)
    failures: tuple[tuple[str, str], ...]
    about: Mapping[str, Any] = field(default_factory=dict, repr=False)
    source: DatasetSource | None = field(default=None, repr=False)

    @classmethod
    def of(
        cls,
        scores: ScoresSet,
        about: Mapping[str, Any] = MappingProxyType({}),
        source: DatasetSource | None = None,
    ) -> SetRates:
        """Return the rates of scores; prints that are never compared are failures to extract."""
        reasons = about.get("failures", {})
        named = {**dict.fromkeys(scores.never_compared, "no score"), **reasons}
        rates = error_rates(*scores.split())
        return cls(scores, rates, ranks_of(scores), tuple(named.items()), about, source)

    @property
    def name(self) -> str:
        """Name of the database."""
        return self.scores.name

    def as_json(self) -> dict[str, Any]:
        """Return the figures of the row as JSON values."""
        figures = {"name": self.name, **_figures([self], self.rates)}
        figures["failure_rate"] = figures["failures"] / max(1, figures["prints"])
        if "identical" in self.about:
            figures["identical"] = self.about["identical"]
        return figures


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

    @classmethod
    def of(cls, sets: Sequence[SetRates], protocol: str = "") -> RatesReport:
        """Return the report on databases that one matcher has compared."""
        mean, pooled = mean_rates(row.rates for row in sets), error_rates(*split_scores(sets))
        return cls(sets[0].scores.matcher, protocol, tuple(sets), mean, pooled)

    def __repr__(self) -> str:
        pairs = f"{self.genuine} genuine and {self.impostor} impostor pairs"
        counts = f"{count(len(self.sets), 'database')}, {pairs}, {len(self.failures)} failed"
        eer = "no EER" if self.pooled.eer is None else f"EER {self.pooled.eer:.4f}"
        return f"{type(self).__name__}({self.matcher}, {counts}, {eer})"

    def _repr_html_(self) -> str:
        """Return the table that `fpmatch evaluate` prints, for notebooks."""
        from html import escape  # noqa: PLC0415  (for notebooks only)

        return f"<pre>{escape(self.as_text())}</pre>"

    @property
    def genuine(self) -> int:
        """Number of genuine pairs in all databases."""
        return split_scores(self.sets)[0].size

    @property
    def impostor(self) -> int:
        """Number of impostor pairs in all databases."""
        return split_scores(self.sets)[1].size

    @property
    def failures(self) -> tuple[tuple[str, str], ...]:
        """Prints of all databases that have no template, and why."""
        return tuple(failure for row in self.sets for failure in row.failures)

    @property
    def scores(self) -> list[ScoresSet]:
        """The comparisons of each database."""
        return [replace(row.scores, matcher=self.matcher) for row in self.sets]

    @property
    def impostors(self) -> list[Trials]:
        """The impostor comparisons of each database, none of a print without template."""
        return [row.scores.impostors for row in self.sets]

    def as_text(self) -> str:
        """Return the table that `fpmatch evaluate` prints."""
        return rates_table(self.as_json())

    def as_json(self) -> dict[str, Any]:
        """Return the report as JSON values: rates as fractions, null where undefined."""
        return {
            "sets": [row.as_json() for row in self.sets],
            "mean": asdict(self.mean),
            "pooled": _figures(self.sets, self.pooled),
        }


def _figures(sets: Sequence[SetRates], rates: Rates) -> dict[str, Any]:
    """Return what is reported of a database, or of the scores of several together, as JSON.

    The rank-1 rate is the share of the probes whose own finger comes first in their own database;
    None where not all pairs were compared.
    """
    genuine, impostor = split_scores(sets)
    ranks = [row.ranks[0] for row in sets if row.ranks is not None]
    known = len(ranks) == len(sets)
    return {
        "genuine": genuine.size,
        "impostor": impostor.size,
        **asdict(rates),
        "rank_one": float(np.mean(np.concatenate(ranks) == 1)) if known else None,
        "prints": sum(len(row.scores.prints) for row in sets),
        "failures": sum(len(row.failures) for row in sets),
    }


def split_scores(sets: Sequence[SetRates]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the similarities of genuine and of impostor pairs of all databases.

    Rates are computed on them and not on scores: calibration keeps their order, but ties its ends.
    """
    genuine, impostor = zip(*(row.scores.split() for row in sets), strict=True)
    return np.concatenate(genuine), np.concatenate(impostor)


def evaluate_scores(
    files: Sequence[AnyPath] = (),
    *,
    genuine_and_impostor: Sequence[tuple[AnyPath, AnyPath]] = (),
    distances: bool = False,
    pattern: str | None = None,
) -> list[RatesReport]:
    r"""Compute the error rates of scores in files, one report a matcher.

    `files`: files of scores, see `fpmatch.lab.evaluation.rates.scores`. Without a column
    ``matcher``, or where files have scores of the same matcher and database, the matcher is named
    after the file. Without a column ``set`` the database is the only one that other files name, if
    any. `genuine_and_impostor`: files of genuine, and of impostor scores of a matcher, which is
    named after the first. `distances`: whether lower scores are more similar. `pattern`: finds the
    fingers in names of prints, as for `fpmatch.gallery.listing.entry.NamePattern`; by default
    prints are named FFF_M. Raises a `DatasetError` if there is no file, one cannot be read, or a
    matcher comes twice; a `GalleryError` if the pattern is none.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from fpmatch.lab.evaluation.report.results import evaluate_scores
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "mine.csv")
    ...     _ = file.write_text("probe,reference,score\n1_1,1_2,.9\n1_1,2_1,.2\n1_2,2_1,.1\n")
    ...     (report,) = evaluate_scores([file])
    >>> report.matcher, report.genuine, report.impostor, report.pooled.eer
    ('mine', 1, 2, 0.0)
    """
    of_name = finger_in_name(pattern)
    given: list[tuple[Path, ScoresSet]] = []
    for file in map(Path, files):
        read = read_scores(file, name="", distances=distances, finger_of=of_name)
        given += [(file, one) for one in read]
    for genuine, impostor in genuine_and_impostor:
        of_pair = read_genuine_and_impostor(genuine, impostor, distances=distances)
        given.append((Path(genuine), replace(of_pair, name="")))
    if not given:
        raise DatasetError("no file of scores given")
    named = {one.name for _, one in given if one.name}
    name = named.pop() if len(named) == 1 else "scores"
    given = [(file, one if one.name else replace(one, name=name)) for file, one in given]
    times = Counter((one.matcher, one.name) for _, one in given)
    by_matcher: dict[str, list[ScoresSet]] = {}
    for file, one in given:
        matcher = one.matcher
        if not matcher or times[matcher, one.name] > 1:
            matcher = f"{matcher} ({file.stem})" if matcher else file.stem
        by_matcher.setdefault(matcher, []).append(replace(one, matcher=matcher))
    for matcher, sets in by_matcher.items():
        if len({one.name for one in sets}) < len(sets):
            raise DatasetError(f"two files of scores of the same name: {matcher}")
    return [RatesReport.of([SetRates.of(one) for one in sets]) for sets in by_matcher.values()]


def notes_on(report: RatesReport) -> list[str]:
    """Return what a user should know of how the scores of a report were understood."""
    notes = []
    if failed := sum(int((~one.compared).sum()) for one in report.scores):
        total = sum(one.compared.size for one in report.scores)
        notes.append(f"{failed:,} of {total:,} comparisons have no score and count as the lowest")
    if not all(one.trials.fingers for one in report.scores):
        notes.append(UNKNOWN_FINGERS)
    if report.pooled.eer is not None and report.pooled.eer > _HALF:
        notes.append(PROBABLY_DISTANCES)
    return notes
