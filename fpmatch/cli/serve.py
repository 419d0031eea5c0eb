"""`fpmatch serve`: a local page on which prints are compared."""

from __future__ import annotations

from contextlib import suppress
from typing import Final

import click

from fpmatch.cli.progress import ProgressBars
from fpmatch.errors import FpmatchError

_STAGES: Final = {"prepare": "preparing prints"}


class _MissingExtraError(FpmatchError):
    """The packages of the extra `web` are not installed."""


@click.command(
    epilog="""\b
Token:
  On a host that others can reach, every request must bring a token. The address that is printed
  holds it; programs send it in a header: Authorization: Bearer TOKEN. What is sent is not
  encrypted: put a TLS proxy or an SSH tunnel between.

\b
Examples:
  fpmatch serve
  fpmatch serve --gallery prints.db --port 9000
  fpmatch serve --host 0.0.0.0 --name prints.example.org

Ctrl-C stops it. Exit status: 0 when it was stopped, 2 when it could not start.
"""
)
@click.option("--gallery", metavar="GALLERY", help="Search and enrol here; made if missing.")
@click.option("--host", default="127.0.0.1", show_default=True, help="Listen here.")
@click.option("--port", type=int, default=8000, show_default=True, help="0 takes any free one.")
@click.option(
    "--token",
    envvar="FPMATCH_TOKEN",
    help="What requests must bring.  [default: made up for hosts that others can reach]",
)
@click.option(
    "--name", "names", multiple=True, help="Another name under which the server may be asked for."
)
@click.option("--pattern", metavar="REGEX", help="As for enrol: how names tell whose prints are.")
@click.option(
    "--workers", type=click.IntRange(min=1), help="Processes to use.  [default: all cores]"
)
def serve(
    gallery: str | None,
    host: str,
    port: int,
    token: str | None,
    names: tuple[str, ...],
    pattern: str | None,
    workers: int | None,
) -> None:
    """Open a page on which prints are compared by eye and by score, and an HTTP API.

    Nothing that is sent is kept, unless a gallery is given and a print is enrolled in it.
    """
    _check_extra()
    from fpmatch.engine.local import available_cores
    from fpmatch.gallery.names import FVC_PATTERN, NamePattern
    from fpmatch.web.server import bind_server
    from fpmatch.web.server import serve as answer
    from fpmatch.web.settings import Settings

    settings = Settings(
        gallery=gallery,
        pattern=NamePattern(FVC_PATTERN if pattern is None else pattern).text,
        workers=workers or available_cores(),
    )
    door = bind_server(host, port, settings, token=token, names=names)

    def say() -> None:
        click.echo(f"fpmatch serves {door.address}")
        click.echo("Ctrl-C stops it", err=True)

    with door.listener, suppress(KeyboardInterrupt):
        if gallery is not None:
            _prepare(gallery, workers)
        answer(door, ready=say)


def _check_extra() -> None:
    from importlib.util import find_spec

    missing = [name for name in ("fastapi", "uvicorn", "python_multipart") if not find_spec(name)]
    if missing:
        raise _MissingExtraError(f"serve needs {', '.join(missing)}: pip install 'fpmatch[web]'")


def _prepare(gallery: str, workers: int | None) -> None:
    """Make the gallery where it is missing, and prepare its prints for searches."""
    from fpmatch.engine.engine import processes
    from fpmatch.gallery.gallery import open_gallery
    from fpmatch.gallery.search import open_search

    with open_gallery(gallery, create=True) as opened, ProgressBars(_STAGES) as bars:
        open_search(opened, engine=processes(workers), progress=bars.show)
