"""The option `--enhance`, of the commands in which ridges can be found in one way or the other."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import click

if TYPE_CHECKING:
    from collections.abc import Callable

# Those of fpmatch.image.enhancement.enhancers, whose import takes OpenCV's time.
WAYS: Final = ("learned", "filters")


def enhance_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the option ``--enhance``, a word ``enhance`` of `WAYS`."""
    return click.option(
        "--enhance",
        type=click.Choice(WAYS),
        default=WAYS[0],
        show_default=True,
        help="How ridges are found in images: by a small network that has learned them from "
        "synthetic prints, or by filters along the ridges.",
    )(command)
