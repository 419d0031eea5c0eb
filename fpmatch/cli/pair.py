"""What `verify` and `overlay` share: two prints, their options, and the comparison."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.cli.enhance import WAYS, enhance_option
from fpmatch.cli.polarity import POLARITIES, polarity_option
from fpmatch.cli.prints import open_print
from fpmatch.cli.raw import raw_option
from fpmatch.cli.resolution import ResolutionChoice
from fpmatch.matching.matchers import DEFAULT_MATCHER

if TYPE_CHECKING:
    from collections.abc import Callable

    from fpmatch.cli.prints import GivenPrint
    from fpmatch.image.io.raw import RawSize
    from fpmatch.matching.matchers.paper import PaperMatcher
    from fpmatch.matching.result import Verification

IMAGE: Final = click.Path(path_type=Path)
FMR_HELP: Final = (
    "Decide at this false match rate: 0.0001 accepts one impostor in 10,000.  [default: 0.0001; "
    "with --matcher paper, --rho decides]"
)
RHO_HELP: Final = (
    "Matcher paper: match where more than this share of the smaller print's minutiae is paired. "
    "--fmr or --threshold decide by the score instead.  [default: 0.6, the least of the paper's "
    "experiments; its others, 0.9 and 0.95, reject most pairs of one finger]"
)
AREA_HELP: Final = (
    "Matcher paper: how far the areas of alike rings on the unit circle may differ, which the "
    "paper does not say; less is faster and finds less.  [default: 0.1]"
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
    rho, area_tolerance : float or None
        Parameters of the matcher "paper"; None for its defaults.
    raw : tuple of RawSize
        Sizes of files that are bare pixels.
    enhance : str
        How ridges are found in images, as for `fpmatch.image.extract`.
    polarity : str
        Polarity of both images, as for `fpmatch.image.io.read.read_image`.
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
    rho: float | None = None
    area_tolerance: float | None = None
    raw: tuple[RawSize, ...] = ()
    enhance: str = WAYS[0]
    polarity: str = POLARITIES[0]


def pair_options(
    command: Callable[..., Any], *, reference_required: bool = True
) -> Callable[..., Any]:
    """Give a command the arguments and options that `PairOptions` holds."""
    command = polarity_option(enhance_option(raw_option(command)))
    for decorate in reversed(
        [
            click.argument("probe", type=IMAGE),
            click.argument("reference", type=IMAGE, required=reference_required),
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
            click.option("--rho", type=float, metavar="SHARE", help=RHO_HELP),
            click.option("--area-tolerance", type=float, metavar="AREA", help=AREA_HELP),
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

    threshold = chosen_threshold(options)
    matcher = _matcher(options)
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
            options.polarity,
        )
        for path, dpi in sides
    )
    verification = verify(
        probe.template,
        reference.template,
        matcher=matcher,
        threshold=threshold,
        calibration=calibration,
    )
    _say_calibrated_otherwise(options)
    return probe, reference, verification


def _matcher(options: PairOptions) -> str | PaperMatcher:
    """Return the matcher, by name unless it has parameters."""
    if options.rho is None and options.area_tolerance is None:
        return options.matcher
    from fpmatch.matching.matchers.paper import matcher_with

    return matcher_with(options.matcher, options.rho, options.area_tolerance)


def _say_calibrated_otherwise(options: PairOptions) -> None:
    """Say on stderr where the score is of another area tolerance than the one that is used."""
    from fpmatch.pointset.unit_circle.matcher import DEFAULT_AREA_TOLERANCE

    used = options.area_tolerance
    if used not in {None, DEFAULT_AREA_TOLERANCE} and options.calibration is None:
        click.echo(
            f"fpmatch: note: the score is as measured at an area tolerance of "
            f"{DEFAULT_AREA_TOLERANCE:g}, not {used:g}",
            err=True,
        )


def chosen_threshold(options: PairOptions) -> float | None:
    """Return the score to decide at; None for the matcher's own decision."""
    from fpmatch.matching.calibration import fmr_to_score

    if options.fmr is not None and options.threshold is not None:
        raise click.UsageError("--fmr and --threshold exclude each other")
    if options.rho is not None and (options.fmr, options.threshold) != (None, None):
        raise click.UsageError("--rho decides without a score: give no --fmr or --threshold")
    return options.threshold if options.fmr is None else fmr_to_score(options.fmr)
