"""Whether the fused scores of two fingers state how often impostors reach them."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Any, Final

import click
import numpy as np

from fpmatch.gallery.fingers.fused_fingers import fuse_fingers
from fpmatch.lab.evaluation.report.results import scores_of
from fpmatch.lab.evaluation.run import evaluate
from fpmatch.matching.calibration import load_calibration, score_to_fmr
from research.commands import Command, folders, json_file, print_and_write, workers
from research.tables.identification import format_fusion

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.rates.scores_set import ScoresSet
    from fpmatch.matching.calibration import Calibration

CHECKED: Final = (5.0, 10.0, 15.0, 20.0, 25.0, 30.0)


def impostor_pairs(scores: ScoresSet, calibration: Calibration, apart: int) -> NDArray[np.float64]:
    """Return the scores of both fingers of impostor pairs of virtual subjects, shape (N, 2).

    A subject is a finger and the one `apart` places after it; a finger is of one subject. Print k
    of a subject's finger goes with print k of the other. All pairs must have been compared.
    """
    trials, count = scores.trials, len(scores.prints)
    finger, table = np.zeros(count, np.intp), np.full((count, count), np.nan)
    finger[scores.probe], finger[scores.reference] = trials.probe, trials.reference
    found = calibration.scores(trials.similarity)
    table[scores.probe, scores.reference] = table[scores.reference, scores.probe] = found
    prints = [np.flatnonzero(finger == k) for k in range(trials.fingers)]
    firsts = [k for k in range(trials.fingers - apart) if k // apart % 2 == 0]
    subjects = [list(zip(prints[k], prints[k + apart], strict=False)) for k in firsts]
    both = [
        (table[a, c], table[b, d])
        for one, other in combinations(subjects, 2)
        for a, b in one
        for c, d in other
    ]
    return np.array(both).reshape(-1, 2)


def check_fusion(sets: Sequence[ScoresSet], calibration: Calibration, apart: int) -> dict[str, Any]:
    """Return the measured rates at the scores `CHECKED` as multiples of what these state."""
    from scipy.stats import spearmanr  # noqa: PLC0415

    each = [impostor_pairs(one, calibration, apart) for one in sets]
    pairs = np.concatenate(each)
    of_both, of_one = fuse_fingers(pairs), pairs[:, 0]
    return {
        "apart": apart,
        "pairs": len(pairs),
        "rank_correlation": max(abs(float(spearmanr(*one.T).statistic)) for one in each),
        "scores": list(CHECKED),
        "two_fingers": [float(np.mean(of_both >= s) / score_to_fmr(s)) for s in CHECKED],
        "one_finger": [float(np.mean(of_one >= s) / score_to_fmr(s)) for s in CHECKED],
    }


@click.command(cls=Command)
@folders
@json_file
@workers
def command(folders: tuple[Path, ...], json_file: Path | None, workers: int | None) -> None:
    """Measure whether the fused scores of two fingers state how often impostors reach them.

    Two fingers of a database stand for a subject: neighbouring ones, and fingers five apart.
    """
    report = evaluate(list(folders), workers=workers)
    calibration = load_calibration(report.matcher)
    results = [check_fusion(scores_of(report), calibration, apart) for apart in (1, 5)]
    print_and_write(format_fusion(results), results, json_file)
