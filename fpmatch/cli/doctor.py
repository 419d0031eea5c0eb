"""`fpmatch doctor`: what is installed."""

from __future__ import annotations

import click

from fpmatch.base.printable import json_text
from fpmatch.cli.notes import say_errors, show
from fpmatch.cli.options import json_option


@click.command(
    epilog="""\b
Examples:
  fpmatch doctor
  fpmatch doctor --json

Exit status: 0 when all is well, 1 when a package that fpmatch needs is missing, a plug-in cannot be
used or kernels are out of date (a line on stderr says so). Kernels that are not compiled work, but
slowly; one that is out of date was compiled before its file changed.
"""
)
@json_option
def doctor(as_json: bool) -> int:
    """Show what is installed: versions, compiled kernels, extras, plug-ins, cores and memory.

    Send it along when you report a problem: it contains no prints and no names of files of yours
    other than the folder of the installation.
    """
    from fpmatch.cli.installation import inspect_installation

    installation = inspect_installation()
    show(json_text(installation.as_dict()) if as_json else installation.as_text())
    say_errors(installation.problems)
    return 1 if installation.problems else 0
