"""`fpmatch calibrate`: scores fitted to one's own prints."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from fpmatch.cli.notes import json_text
from fpmatch.cli.options import (
    files_argument,
    json_option,
    matcher_option,
    output_option,
    workers_option,
)
from fpmatch.cli.progress import ProgressBars
from fpmatch.matching.matchers import get_matcher

if TYPE_CHECKING:
    from pathlib import Path

_STAGES = {"extract": "extracting prints", "compare": "comparing pairs"}


@click.command(
    epilog="""\b
A score of 30 is to mean that one impostor comparison in 1,000 reaches it. Whether it does depends
on sensor and fingers. With more fingers, higher scores can be measured: 10 fingers with 8
impressions give 2,880 impostor comparisons, 100 fingers 316,800.

\b
Examples:
  fpmatch calibrate prints -o calibration.json
  fpmatch evaluate prints --scores scores.csv
  fpmatch calibrate scores.csv -o calibration.json
  fpmatch verify probe.tif reference.tif --calibration calibration.json
"""
)
@files_argument("sources", metavar="SCORES|DIR...")
@output_option(metavar="OUT.json", help="Where to write the calibration.")
@matcher_option
@json_option
@workers_option
def calibrate(
    sources: tuple[Path, ...], output: Path, matcher: str, as_json: bool, workers: int | None
) -> None:
    """Fit scores to the false match rates of one's own prints.

    Each DIR contains prints named FFF_M.tif (finger FFF, impression M); each SCORES is a file of
    fpmatch evaluate --scores or fpmatch score. At least 1,000 impostor comparisons are needed. The
    largest measured score is printed: scores beyond are extrapolated.
    """
    from fpmatch.evaluation.calibrate import calibrate_on
    from fpmatch.evaluation.calibration_report import report_calibration
    from fpmatch.evaluation.impostors import gather_impostors
    from fpmatch.output import atomic_write_bytes, check_writable

    check_writable(output)
    chosen = get_matcher(matcher)
    with ProgressBars(_STAGES) as bars:
        impostors = gather_impostors(sources, matcher=chosen, workers=workers, progress=bars.show)
    calibration = calibrate_on(impostors, chosen.name, "fpmatch calibrate")
    atomic_write_bytes(output, calibration.as_json().encode())
    report = report_calibration(calibration, impostors)
    document = {"calibration": str(output), **report.as_json()}
    click.echo(json_text(document) if as_json else f"{output}\n{report.as_text()}")
