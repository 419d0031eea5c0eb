"""`fpmatch calibrate`: scores fitted to one's own prints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_slow_kernels, show
from fpmatch.cli.options import (
    json_option,
    matcher_option,
    output_option,
    reading_options,
)
from fpmatch.cli.progress import ProgressBars
from fpmatch.gallery.cli.options import pattern_option, places_argument, workers_option
from fpmatch.lab.cli.evaluate import STAGES
from fpmatch.matching.registry import get_matcher
from fpmatch.printable import count, json_text, printable

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.image.io.grey import RawSize
    from fpmatch.image.quality.polarity import Polarity


@click.command(
    cls=Command,
    epilog="""\b
A score of 30 is to mean that one impostor comparison in 1,000 reaches it. Whether it does depends
on sensor and fingers. With more fingers, higher scores can be measured: 10 fingers with 8
impressions give 2,880 impostor comparisons, 100 fingers 316,800.

\b
Examples:
  fpmatch calibrate prints -o calibration.json
  fpmatch evaluate prints --matcher unit-circle:beyond_share=0 --scores scores.csv
  fpmatch calibrate scores.csv -o calibration.json
  fpmatch verify probe.tif reference.tif --calibration calibration.json
""",
)
@places_argument("sources", metavar="SCORES|DIR|MANIFEST...")
@output_option(metavar="OUT.json", help="Where to write the calibration.")
@pattern_option
@reading_options
@matcher_option
@json_option
@workers_option
def calibrate(
    sources: tuple[str, ...],
    output: Path,
    pattern: str | None,
    dpi: float | None,
    polarity: Polarity,
    raw: tuple[RawSize, ...],
    matcher: str,
    as_json: bool,
    workers: int | None,
) -> None:
    """Fit scores to the false match rates of one's own prints.

    The prints of DIR and MANIFEST are as for fpmatch evaluate; each SCORES is a file of fpmatch
    evaluate --scores or fpmatch score, of the default matcher only those with beyond_share=0. At
    least 1,000 impostor comparisons are needed. The largest measured score is printed: scores
    beyond are extrapolated.
    """
    from fpmatch.base.output import atomic_write_bytes, check_writable
    from fpmatch.lab.evaluation import calibrate as fitting
    from fpmatch.prints.reading import PrintReader

    check_writable(output)
    chosen = get_matcher(matcher)
    say_slow_kernels()
    with ProgressBars(STAGES) as bars:
        impostors = fitting.gather_impostors(
            sources,
            matcher=chosen,
            workers=workers,
            progress=bars.show,
            naming={"pattern": pattern, "dpi": dpi},
            reader=PrintReader(raw, quiet=True),
            polarity=polarity,
        )
    calibration = fitting.calibrate_on(impostors, chosen.name, "fpmatch calibrate")
    atomic_write_bytes(output, calibration.as_json().encode(), public=True)
    report = fitting.report_calibration(calibration, impostors)
    document = {"calibration": str(output), **report}
    text = f"{printable(output)}\n{calibration_text(report)}"
    show(json_text(document) if as_json else text)


def calibration_text(report: dict[str, Any]) -> str:
    """Return the report on a calibration as text, a line an item."""
    from fpmatch.lab.evaluation.calibrate import MIN_ABOVE
    from fpmatch.matching.calibration import score_to_fmr
    from fpmatch.matching.decision import DEFAULT_THRESHOLD
    from fpmatch.prints.report import odds

    measured, fmr = report["largest_measured_score"], odds(report["smallest_measured_fmr"])
    fingers = count(report["fingers"], "finger") if report["fingers"] else "unknown fingers"
    beyond = "scores are extrapolated, and verify notes it"
    if measured < DEFAULT_THRESHOLD:
        needed = round(MIN_ABOVE / score_to_fmr(DEFAULT_THRESHOLD))
        beyond += f"""
              so is the default threshold, {DEFAULT_THRESHOLD:g}: to measure it takes
              some {needed:,} impostor comparisons"""
    if interval := report["smallest_measured_fmr_interval"]:
        lowest = odds(interval[0]) if interval[0] > 0 else "none"
        fmr += f"\n              (95 % interval over fingers: {odds(interval[1])} to {lowest})"
    return f"""\
  Matcher     {report["matcher"]}
  Fitted to   {report["impostors"]:,} impostor comparisons
              of {fingers} ({count(report["databases"], "database")})
  Measured    up to score {measured:.1f}, a false match rate of {fmr}
  Beyond      {beyond}
  Highest     the highest of these comparisons scores {report["highest_impostor_score"]:.1f}"""
