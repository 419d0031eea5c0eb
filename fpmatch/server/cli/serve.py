"""`fpmatch serve`: web interface and HTTP API."""

from __future__ import annotations

import importlib.util
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Final, Literal

import click

from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_slow_kernels, show_line
from fpmatch.cli.options import file_option
from fpmatch.errors import FpmatchError
from fpmatch.gallery.cli.options import key_option, workers_option

if TYPE_CHECKING:
    from pathlib import Path

_PACKAGES: Final = (
    "fastapi",
    "hypercorn",
    "prometheus_client",
    "python_multipart",
    "pythonjsonlogger",
)


class _MissingExtraError(FpmatchError):
    """The packages of the extra `web` are not installed."""


@click.command(
    cls=Command,
    details="""\b
Token:
  On a host that other machines can reach, and where tokens are given, every request needs one. The
  address that is printed contains it, but no token of a client; programs send it in a header:
  Authorization: Bearer TOKEN. Requests are not encrypted: use a TLS proxy or an SSH tunnel.

\b
Settings:
  A table of FILE.toml is a client, with a role (read: the state of the server; verify: compare and
  identify too; enrol: enrol too; admin: remove too) and its token, or the token's SHA-256. The
  table limits bounds sizes, times and requests; an unknown name is answered with all of them:
    [reception]
    role = "verify"
    token = "WNfOYJvW3B3A0nUqVYxw"
    [limits]
    wait_seconds = 60
""",
    epilog="""\b
Examples:
  fpmatch serve
  fpmatch serve --gallery prints.db --port 9000
  fpmatch serve --host 0.0.0.0 --allowed-host prints.example.org
  fpmatch serve --gallery prints.db --settings server.toml --log json

Ctrl-C or SIGTERM stops the server; requests have 5 seconds to end.

Exit status: 0 when it was stopped, 2 when it could not start.
""",
)
@click.option(
    "--gallery", metavar="GALLERY", help="Gallery to search and to enrol in; made if missing."
)
@click.option("--host", default="127.0.0.1", help="Name or address to listen on.")
@click.option("--port", type=int, default=8000, help="0 chooses a free one.")
@click.option(
    "--token",
    envvar="FPMATCH_TOKEN",
    help="Token of requests.  [default: random on hosts that other machines can reach]",
)
@file_option(
    "--settings",
    "file",
    metavar="FILE.toml",
    help="Clients with roles and tokens, and limits; see --help-all.",
)
@click.option(
    "--log",
    type=click.Choice(["none", "text", "json"]),
    default="none",
    help="Log every request on stderr.",
)
@click.option(
    "--allowed-host",
    "allowed_hosts",
    metavar="NAME",
    multiple=True,
    help="Another name of this server in requests; may be repeated.",
)
@workers_option
@key_option
def serve(
    gallery: str | None,
    host: str,
    port: int,
    token: str | None,
    file: Path | None,
    log: Literal["none", "text", "json"],
    allowed_hosts: tuple[str, ...],
    workers: int | None,
) -> None:
    """Serve a web interface to compare prints, and an HTTP API.

    No uploaded file is kept; of a print that is enrolled in the gallery, the template is.
    """
    missing = [name for name in _PACKAGES if not importlib.util.find_spec(name)]
    if missing:
        raise _MissingExtraError(f"serve needs {', '.join(missing)}: pip install 'fpmatch[web]'")
    from fpmatch.base.threads import available_cores
    from fpmatch.server.server import bind_server
    from fpmatch.server.server import serve as serve_requests
    from fpmatch.server.settings import Settings, load_settings

    settings = replace(
        Settings() if file is None else load_settings(file),
        gallery=gallery,
        workers=workers or available_cores(),
    )
    server = bind_server(host, port, settings, token=token, allowed_hosts=allowed_hosts)

    def say_ready() -> None:
        show_line(f"fpmatch serves {server.address}")
        click.echo("Ctrl-C stops it", err=True)

    say_slow_kernels()
    with server.listener, suppress(KeyboardInterrupt):
        if gallery is not None:
            from fpmatch.gallery.gallery import open_gallery

            with open_gallery(gallery, create=True) as opened:
                opened.check_keys()
        serve_requests(server, log=log, ready=say_ready)
