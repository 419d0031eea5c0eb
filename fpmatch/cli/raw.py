"""Sizes on the command line, and `--raw` of every command that reads images one by one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from collections.abc import Callable

    from fpmatch.image.io.raw import RawSize


def picture_size(words: str) -> RawSize:
    """Return the size that a word on the command line names."""
    from fpmatch.errors import ImageError
    from fpmatch.image.io.raw import RawSize

    try:
        return RawSize.parse(words)
    except ImageError as error:
        raise click.BadParameter(str(error)) from error


def raw_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the option ``--raw WxH``, a tuple ``raw`` of `RawSize`."""
    return click.option(
        "--raw",
        metavar="WxH",
        multiple=True,
        type=picture_size,
        help="Take files of W times H bytes for bare pixels; may be given again for another size.",
    )(command)
