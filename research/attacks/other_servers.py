"""The application of `fpmatch serve` run by another server, for comparison.

``python -m research.attacks.other_servers NAME``: uvicorn (as it is, without the limits of
connections that `fpmatch serve` adds), hypercorn or granian.
"""

from __future__ import annotations

import os
import socket
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.server.app import make_app
from fpmatch.server.settings import Settings

if TYPE_CHECKING:
    from starlette.types import Receive, Scope, Send

_VARIABLE: Final = "FPMATCH_ATTACKED"  # host, port and gallery, for processes that are started
_HEADER_S: Final = 10


def make_announced_app() -> Any:
    """Return the application; it prints its address and process when it is ready."""
    port, gallery = os.environ[_VARIABLE].split(" ", 1)
    vars(sys.modules["__main__"]).pop("__file__", None)  # worker processes would run granian's
    app = make_app(Settings(gallery=gallery, workers=2))

    async def announced(scope: Scope, receive: Receive, send: Send) -> None:
        async def sending(message: Any) -> None:
            await send(message)
            if message["type"] == "lifespan.startup.complete":
                click.echo(f"fpmatch serves http://127.0.0.1:{port} {os.getpid()}")

        await app(scope, receive, sending)

    return announced


@click.command()
@click.argument("name", type=click.Choice(["uvicorn", "hypercorn", "granian"]))
@click.option("--gallery", required=True)
def main(name: str, gallery: str) -> None:
    """Serve until SIGTERM."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = str(free.getsockname()[1])
    os.environ[_VARIABLE] = f"{port} {Path(gallery).resolve()}"
    app = "research.attacks.other_servers:make_announced_app"
    words = {
        "uvicorn": ["--factory", "--port", port, "--log-level", "warning", app],
        "hypercorn": ["--bind", f"127.0.0.1:{port}", f"{app}()"],
        "granian": [
            *("--interface", "asgi", "--factory", "--port", port, "--loop", "asyncio"),
            *("--http1-header-read-timeout", f"{1000 * _HEADER_S}", app),
        ],
    }
    os.execv(sys.executable, [sys.executable, "-m", name, *words[name]])


if __name__ == "__main__":
    main()
