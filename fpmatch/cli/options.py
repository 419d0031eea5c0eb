"""Options that several commands share."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.matching.matchers import DEFAULT_MATCHER

if TYPE_CHECKING:
    from fpmatch.image.io.raw import RawSize

# Of fpmatch.image.quality.polarity and fpmatch.image.enhancement.enhancers, which import OpenCV.
POLARITIES: Final = ("auto", "dark", "white")
ENHANCEMENTS: Final = ("learned", "filters")

FILE: Final = click.Path(path_type=Path)
FROM_0: Final = click.IntRange(min=0)
FROM_1: Final = click.IntRange(min=1)


def image_size(text: str) -> RawSize:
    """Return the size that WIDTHxHEIGHT on the command line means."""
    from fpmatch.errors import ImageError
    from fpmatch.image.io.raw import RawSize

    try:
        return RawSize.parse(text)
    except ImageError as error:
        raise click.BadParameter(str(error)) from error


def old_names(**names: str) -> dict[str, Any]:
    """Return context settings with which a command accepts old names of options, without dashes."""
    return {"token_normalize_func": lambda name: names.get(name, name)}


file_option: Final = partial(click.option, type=FILE)
output_option: Final = partial(file_option, "-o", "--output", required=True)
files_argument: Final = partial(click.argument, nargs=-1, required=True, type=FILE)
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
    help="Ridges are dark or white in the images; auto: detected, in a folder from all its images.",
)
enhance_option: Final = click.option(
    "--enhance",
    type=click.Choice(ENHANCEMENTS),
    default=ENHANCEMENTS[0],
    help="Enhancement of ridges in images: by a small neural network, or by Gabor filters.",
)
matcher_option: Final = click.option("--matcher", default=DEFAULT_MATCHER, help="Matcher to use.")
workers_option: Final = click.option(
    "--workers", type=FROM_1, help="Processes to use.  [default: all cores]"
)
json_option: Final = click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
json_array_option: Final = click.option(
    "--json", "as_json", is_flag=True, help="Print one JSON array."
)
