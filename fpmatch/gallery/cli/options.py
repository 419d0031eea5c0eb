"""Options that commands on many prints share."""

from __future__ import annotations

import os
from functools import partial
from typing import Final

import click

FROM_0: Final = click.IntRange(min=0)
FROM_1: Final = click.IntRange(min=1)


def _use_key(ctx: click.Context, param: click.Parameter, value: str | None) -> None:
    """Set the source of the keys in the environment, which worker processes inherit."""
    if value is None:
        return
    from fpmatch.errors import EncryptionError
    from fpmatch.gallery.encryption.keys import KEY_VARIABLE, path_of

    try:
        path_of(value)
    except EncryptionError as error:
        raise click.BadParameter(str(error)) from error
    os.environ[KEY_VARIABLE] = value


def check_where(workers: int | None, scheduler: str | None) -> None:
    """Fail if both processes and a cluster are requested."""
    if workers is not None and scheduler is not None:
        raise click.UsageError("--workers and --scheduler exclude each other")


places_argument: Final = partial(click.argument, nargs=-1, required=True)  # with URLs
pattern_option: Final = click.option(
    "--pattern", metavar="REGEX", help="Pattern of file names; see fpmatch enrol --help-all."
)
workers_option: Final = click.option(
    "--workers", type=FROM_1, help="Processes to use.  [default: all cores]"
)
scheduler_option: Final = click.option(
    "--scheduler",
    metavar="URL",
    hidden=True,
    help="Work on the Dask cluster of this scheduler, tcp://host:8786; needs fpmatch[dask].",
)
key_option: Final = click.option(
    "--key",
    metavar="SOURCE",
    expose_value=False,
    callback=_use_key,
    hidden=True,
    help="Keys of encrypted galleries, file:PATH; see fpmatch key --help.  [default: that of the "
    "environment variable FPMATCH_KEY]",
)
