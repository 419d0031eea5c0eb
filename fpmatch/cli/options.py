"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.matching.matchers import DEFAULT_MATCHER

if TYPE_CHECKING:
    from collections.abc import Callable

    from fpmatch.image.io.raw import RawSize

# Of fpmatch.image.quality.polarity and fpmatch.image.enhancement.enhancers, which import OpenCV.
POLARITIES: Final = ("auto", "dark", "white")
ENHANCEMENTS: Final = ("learned", "filters")

FILE: Final = click.Path(path_type=Path)


def image_size(text: str) -> RawSize:
    """Return the size that WIDTHxHEIGHT on the command line means."""
    from fpmatch.errors import ImageError
    from fpmatch.image.io.raw import RawSize

    try:
        return RawSize.parse(text)
    except ImageError as error:
        raise click.BadParameter(str(error)) from error


raw_option: Final = click.option(
    "--raw",
    metavar="WxH",
    multiple=True,
    type=image_size,
    help="Read files of W times H bytes as pixels without a header; may be repeated.",
)
polarity_option: Final = click.option(
    "--polarity",
    type=click.Choice(POLARITIES),
    default=POLARITIES[0],
    show_default=True,
    help="Ridges are dark or white in the images; auto: detected, in a folder from all its images.",
)
enhance_option: Final = click.option(
    "--enhance",
    type=click.Choice(ENHANCEMENTS),
    default=ENHANCEMENTS[0],
    show_default=True,
    help="Enhancement of ridges in images: by a small neural network, or by Gabor filters.",
)
matcher_option: Final = click.option(
    "--matcher", default=DEFAULT_MATCHER, show_default=True, help="Matcher to use."
)
calibration_option: Final = click.option(
    "--calibration",
    metavar="FILE",
    type=FILE,
    help="Score as fitted by fpmatch calibrate.  [default: that of the package]",
)
workers_option: Final = click.option(
    "--workers", type=click.IntRange(min=1), help="Processes to use.  [default: all cores]"
)
json_option: Final = click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")

_PAIR_OPTIONS: Final = (
    click.option("--dpi", type=float, help="Resolution of both prints, in dots per inch."),
    click.option("--probe-dpi", type=float, help="Resolution of the probe."),
    click.option("--reference-dpi", type=float, help="Resolution of the reference."),
    click.option(
        "--fmr",
        type=float,
        metavar="RATE",
        help="Decide at this false match rate: 0.0001 accepts one impostor in 10,000.  [default: "
        "0.0001; with --matcher paper, --rho decides]",
    ),
    click.option(
        "--threshold", type=float, metavar="SCORE", help="Decide at this score, 0 to 100."
    ),
    matcher_option,
    click.option(
        "--rho",
        type=float,
        metavar="SHARE",
        help="Matcher paper: match where more than this share of the smaller print's minutiae is "
        "paired; --fmr or --threshold decide by the score instead.  [default: 0.6, the lowest of "
        "the paper's experiments; 0.9 and 0.95 reject most genuine pairs]",
    ),
    click.option(
        "--area-tolerance",
        type=float,
        metavar="AREA",
        help="Matcher paper: largest difference in area of corresponding rings on the unit circle, "
        "which the paper does not state; a smaller one is faster and finds less.  [default: 0.1]",
    ),
    calibration_option,
    polarity_option,
    enhance_option,
    raw_option,
)


def pair_options(
    command: Callable[..., Any], *, reference_required: bool = True
) -> Callable[..., Any]:
    """Give a command PROBE, REFERENCE and the options of one comparison."""
    for decorate in reversed(_PAIR_OPTIONS):
        command = decorate(command)
    command = click.argument("reference", type=FILE, required=reference_required)(command)
    return click.argument("probe", type=FILE)(command)
