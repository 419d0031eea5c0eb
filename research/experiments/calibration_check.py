"""Comparison of the share of impostors that reach a calibrated score with the stated rate.

A score of 20 states that one impostor comparison in a hundred reaches it, 30 one in a thousand. The
share that does on other prints than the calibration was fitted to shows how far that holds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import click
import numpy as np

from fpmatch.gallery.batch.comparer import NO_TEMPLATE
from fpmatch.lab.evaluation.databases.dataset import with_unique_names
from fpmatch.lab.evaluation.run import evaluate, load_datasets
from fpmatch.matching.calibration import load_calibration, score_to_fmr
from fpmatch.matching.registry import DEFAULT_MATCHER
from research.all_pairs import impostors_among
from research.commands import (
    Command,
    folders,
    json_file,
    print_and_write,
    synthetic_folder,
    workers,
)
from research.databases import TEST_SEED, extract_synthetic_sets
from research.markdown import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.impostors import ImpostorSet
    from fpmatch.lab.evaluation.report.results import EvaluationReport
    from fpmatch.matching.calibration import Calibration

SCORES: Final = (20.0, 30.0, 40.0)
"""The scores that are checked: one false match in 100, in 1,000, and in 10,000."""
LARGEST_FACTOR: Final = 2.0
"""The largest ratio of the measured to the stated share, or the reverse."""


@dataclass(frozen=True, slots=True)
class CalibrationCheck:
    """The numbers of impostor comparisons of a database that reach each of `SCORES`."""

    name: str
    impostors: int  # impostor comparisons, without those that lack a template
    reached: tuple[int, ...]  # how many of them reach each score or more

    @property
    def shares(self) -> tuple[float, ...]:
        """The share that reaches each score; 0 where there are no comparisons."""
        return tuple(n / max(self.impostors, 1) for n in self.reached)

    @property
    def factors(self) -> tuple[float, ...]:
        """The ratio of each share to the stated one."""
        return tuple(s / score_to_fmr(at) for s, at in zip(self.shares, SCORES, strict=True))

    @property
    def kept(self) -> tuple[bool, ...]:
        """Whether each factor lies within `LARGEST_FACTOR`, either way."""
        return tuple(1 / LARGEST_FACTOR <= f <= LARGEST_FACTOR for f in self.factors)

    def as_json(self) -> dict[str, Any]:
        """Return name, number of comparisons, and an entry a score."""
        columns = zip(SCORES, self.reached, self.shares, self.factors, strict=True)
        return {
            "name": self.name,
            "impostors": self.impostors,
            "scores": [
                {"score": at, "reached": n, "share": round(s, 7), "factor": round(f, 3)}
                for at, n, s, f in columns
            ],
        }


def check_calibration(
    report: EvaluationReport, calibration: Calibration | None = None
) -> list[CalibrationCheck]:
    """Count the impostors that reach the scores: by database, and of several all."""
    used = calibration or load_calibration(report.matcher)
    checks = []
    for row in report.sets:
        impostor = ~row.pairs.genuine & (row.outcomes["reason"] != NO_TEMPLATE)
        checks.append(_count(row.name, used.scores(row.outcomes["similarity"][impostor])))
    return checks if len(checks) == 1 else [*checks, together("all", checks)]


def together(name: str, checks: Sequence[CalibrationCheck]) -> CalibrationCheck:
    """Return the check of all comparisons of some checks."""
    reached = np.sum([check.reached for check in checks], axis=0).tolist()
    return CalibrationCheck(name, sum(check.impostors for check in checks), tuple(reached))


def check_impostors(
    impostors: ImpostorSet, matcher: str, calibration: Calibration | None = None
) -> CalibrationCheck:
    """Count the impostor comparisons by a matcher that reach the scores."""
    used = calibration or load_calibration(matcher)
    return _count(impostors.name, used.scores(impostors.trials.similarity))


def format_calibration(sets: Sequence[Mapping[str, Any]]) -> str:
    """Return the share of impostor comparisons at each score, and its ratio to the stated FMR."""
    head = ["", "impostor pairs"]
    for at in sets[0]["scores"]:
        head += [f"at {at['score']:g} or more", "times the stated FMR"]
    rows = [head]
    for row in sets:
        cells = [(f"{100 * at['share']:.4f} %", f"{at['factor']:.2f}") for at in row["scores"]]
        rows.append([row["name"], f"{row['impostors']:,}", *(c for pair in cells for c in pair)])
    return markdown_table(rows)


def _count(name: str, scores: NDArray[np.float64]) -> CalibrationCheck:
    return CalibrationCheck(name, len(scores), tuple(int((scores >= at).sum()) for at in SCORES))


@click.command(
    cls=Command,
    epilog="""\b
Example:
  python -m research check calibration fvc/*/* --synthetic --json calibration.json
""",
)
@folders
@click.option("--matcher", default=DEFAULT_MATCHER, show_default=True)
@click.option("--synthetic", is_flag=True, help="Also compare eight synthetic databases.")
@synthetic_folder
@json_file
@workers
@click.pass_context
def command(
    context: click.Context,
    folders: tuple[Path, ...],
    matcher: str,
    synthetic: bool,
    prints: Path | None,
    json_file: Path | None,
    workers: int | None,
) -> None:
    """Compare the false match rates at calibrated scores with the stated ones.

    All impressions of different fingers within each FVC-style database DIR are compared. For the
    scores 20, 30 and 40 the share of comparisons that reach them stands beside the stated 1 %,
    0.1 % and 0.01 %. --synthetic adds a row of 1.8 million comparisons by the default matcher, of
    eight synthetic databases that nothing was trained on, and a row of everything together. The
    exit status is 0 if the last row lies within a factor of two of the stated rates, 1 otherwise.
    """
    report = evaluate(with_unique_names(load_datasets(folders)), matcher=matcher, workers=workers)
    checks = check_calibration(report)
    if synthetic:
        checks.append(_check_synthetic(prints, workers))
        checks.append(together("together", checks[-2:]))
    sets = [check.as_json() for check in checks]
    print_and_write(format_calibration(sets), {"matcher": report.matcher, "sets": sets}, json_file)
    context.exit(0 if all(checks[-1].kept) else 1)


def _check_synthetic(prints: Path | None, workers: int | None) -> CalibrationCheck:
    """Compare all impressions of synthetic databases with one another."""
    sets = extract_synthetic_sets(TEST_SEED, prints, workers)
    name = f"synthetic, seeds {TEST_SEED} to {TEST_SEED + len(sets) - 1}"
    return check_impostors(impostors_among(sets, name, workers), DEFAULT_MATCHER)
