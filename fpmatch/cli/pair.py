"""What `verify` and `overlay` share: two prints, their options, and the comparison."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.cli.enhance import WAYS, enhance_option
from fpmatch.cli.prints import open_print
from fpmatch.cli.raw import raw_option
from fpmatch.cli.resolution import ResolutionChoice
from fpmatch.matching.matchers import DEFAULT_MATCHER

if TYPE_CHECKING:
    from collections.abc import Callable

    from fpmatch.cli.prints import GivenPrint
    from fpmatch.image.raw import RawSize
    from fpmatch.matching.result import Verification
    from fpmatch.scale import ScaleMeasurement

IMAGE: Final = click.Path(path_type=Path)
FMR_HELP: Final = (
    "Decide at this false match rate: 0.0001 accepts one impostor in 10,000.  [default: 0.0001]"
)


@dataclass(frozen=True, slots=True)
class PairOptions:
    """Hold what the command line says about one comparison.

    Parameters
    ----------
    probe, reference : Path
        The two files, images or templates.
    dpi, probe_dpi, reference_dpi : float or None
        Resolution of both, or of either, in dots per inch; None where the file shall tell.
    matcher : str
        Name of the matcher.
    fmr, threshold : float or None
        False match rate or score to decide at; at most one of them.
    calibration : Path or None
        What `fpmatch calibrate` wrote; None for the package's own.
    raw : tuple of RawSize
        Sizes of files that are bare pixels.
    enhance : str
        How ridges are found in images, as for `fpmatch.image.extract`.
    """

    probe: Path
    reference: Path
    dpi: float | None
    probe_dpi: float | None
    reference_dpi: float | None
    matcher: str
    fmr: float | None
    threshold: float | None
    calibration: Path | None
    raw: tuple[RawSize, ...] = ()
    enhance: str = WAYS[0]


def pair_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the arguments and options that `PairOptions` holds."""
    command = enhance_option(raw_option(command))
    for decorate in reversed(
        [
            click.argument("probe", type=IMAGE),
            click.argument("reference", type=IMAGE),
            click.option("--dpi", type=float, help="Resolution of both prints, in dots per inch."),
            click.option("--probe-dpi", type=float, help="Resolution of the probe."),
            click.option("--reference-dpi", type=float, help="Resolution of the reference."),
            click.option("--fmr", type=float, metavar="RATE", help=FMR_HELP),
            click.option(
                "--threshold", type=float, metavar="SCORE", help="Decide at this score, 0 to 100."
            ),
            click.option(
                "--matcher", default=DEFAULT_MATCHER, show_default=True, help="Matcher to use."
            ),
            click.option(
                "--calibration",
                metavar="FILE",
                type=click.Path(path_type=Path),
                help="Score as fitted by fpmatch calibrate.  [default: as on the FVC databases]",
            ),
        ]
    ):
        command = decorate(command)
    return command


def compare(options: PairOptions) -> tuple[GivenPrint, GivenPrint, Verification]:
    """Return both prints of a pair as they were read, and the decision on them.

    Raises
    ------
    FpmatchError
        If a print cannot be read or used, or an option is out of its range.
    """
    from fpmatch.matching.calibration import load_calibration
    from fpmatch.matching.verify import verify

    threshold = _threshold(options)
    calibration = (
        load_calibration(options.matcher, options.calibration) if options.calibration else None
    )
    resolution = ResolutionChoice()
    sides = (options.probe, options.probe_dpi), (options.reference, options.reference_dpi)
    probe, reference = (
        open_print(
            path,
            resolution,
            options.dpi if dpi is None else dpi,
            options.raw,
            options.enhance,
        )
        for path, dpi in sides
    )
    verification = verify(
        probe.template,
        reference.template,
        matcher=options.matcher,
        threshold=threshold,
        calibration=calibration,
    )
    return probe, reference, verification


def scale_between(verification: Verification, options: PairOptions) -> ScaleMeasurement | None:
    """Return the scale between the prints of a verification, at the resolutions that they claim."""
    from functools import partial

    from fpmatch.matching.calibration import load_calibration
    from fpmatch.matching.verify import verify
    from fpmatch.scale import find_scale

    same = partial(
        verify,
        matcher=options.matcher,
        threshold=verification.threshold,
        calibration=load_calibration(options.matcher, options.calibration),
    )
    return find_scale(verification, same)


def _threshold(options: PairOptions) -> float:
    """Return the score to decide at."""
    from fpmatch.matching.calibration import fmr_to_score
    from fpmatch.matching.verify import DEFAULT_THRESHOLD

    if options.fmr is not None and options.threshold is not None:
        raise click.UsageError("--fmr and --threshold exclude each other")
    if options.fmr is not None:
        return fmr_to_score(options.fmr)
    return DEFAULT_THRESHOLD if options.threshold is None else options.threshold
