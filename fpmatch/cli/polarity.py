"""The option `--polarity`, of the commands that read images one by one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import click

if TYPE_CHECKING:
    from collections.abc import Callable

# Those of fpmatch.image.quality.polarity, whose import takes OpenCV's time.
POLARITIES: Final = ("auto", "dark", "white")


def polarity_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the option ``--polarity``, a word ``polarity`` of `POLARITIES`."""
    return click.option(
        "--polarity",
        type=click.Choice(POLARITIES),
        default=POLARITIES[0],
        show_default=True,
        help="How images show their ridges: dark on white, or white on dark; auto: white where it "
        "is sure, for a folder as its images together say.",
    )(command)
