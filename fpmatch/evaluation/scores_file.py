"""Write every comparison of an evaluation to a CSV file."""

from __future__ import annotations

import csv
import secrets
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final, TextIO

import numpy as np

from fpmatch.errors import OutputError
from fpmatch.matching.calibration import calibrated_matchers, load_calibration

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator

    from fpmatch.evaluation.report import EvaluationReport, SetResult

_GEOMETRY: Final = ("scale", "rotation_deg", "tx", "ty", "rms_px", "agreement", "overlap")
COLUMNS: Final = (
    *("set", "probe", "reference", "genuine", "similarity", "score", "pairs"),
    *_GEOMETRY,
    "reason",
)


def write_scores(path: str | os.PathLike[str], report: EvaluationReport) -> None:
    """Write a row a comparison, by set and pair, with the columns `COLUMNS`.

    `genuine` is 1 or 0; values that do not exist (the transform of a pair without one, the score
    of a matcher without calibration) are left empty. The file appears whole or not at all.

    Parameters
    ----------
    path : path
        The file, replaced where it exists.
    report : EvaluationReport
        The evaluation.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    check_writable(path)
    with _replacing(Path(path)) as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        for row in report.sets:
            writer.writerows(_rows(row, report.matcher))


def check_writable(path: str | os.PathLike[str]) -> None:
    """Refuse a file that `write_scores` could not write, before hours of work go into it.

    Raises
    ------
    OutputError
        If `path` is a folder, or nothing can be written beside it.
    """
    target = Path(path)
    probe = target.with_name(f".{secrets.token_hex(8)}.part")
    if target.is_dir():
        raise OutputError(f"{path}: is a folder")
    try:
        probe.touch(exist_ok=False)
        probe.unlink()
    except OSError as error:
        raise OutputError(f"{path}: cannot be written ({error.strerror or error})") from error


def _rows(result: SetResult, matcher: str) -> Iterator[list[object]]:
    names = [i.path.name for i in result.extracted.dataset.impressions]
    outcomes, pairs = result.outcomes, result.pairs
    score = np.full(len(pairs), np.nan)
    if matcher in calibrated_matchers():
        score = load_calibration(matcher).scores(outcomes["similarity"])
    geometry = [[_short(v) for v in outcomes[column].tolist()] for column in _GEOMETRY]
    columns = (
        [names[i] for i in pairs.probe],
        [names[i] for i in pairs.reference],
        pairs.genuine.astype(int).tolist(),
        outcomes["similarity"].tolist(),
        [_short(v) for v in score.tolist()],
        outcomes["pairs"].tolist(),
        *geometry,
        outcomes["reason"].tolist(),
    )
    for values in zip(*columns, strict=True):
        yield [result.name, *values]


def _short(value: float) -> str:
    """Return a measured value with six digits; "" where there is none."""
    return "" if np.isnan(value) else f"{value:.6g}"


@contextmanager
def _replacing(path: Path) -> Iterator[TextIO]:
    """Open an unfinished file beside `path` that takes its place once all went well."""
    unfinished = path.with_name(f".{secrets.token_hex(8)}.part")
    try:
        with unfinished.open("x", encoding="utf-8", newline="") as stream:
            yield stream
        unfinished.replace(path)
    except OSError as error:
        raise OutputError(f"{path}: cannot be written ({error.strerror or error})") from error
    finally:
        unfinished.unlink(missing_ok=True)
